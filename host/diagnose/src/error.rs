//! Why a diagnosis cannot be made.

use std::path::PathBuf;

use quietcut_model::case::CaseError;
use quietcut_recording::RecordingError;
use quietcut_simulate::SimulateError;

/// What is wrong with case or recordings.
#[derive(Debug, thiserror::Error)]
pub enum DiagnoseError {
    /// The case lacks something.
    #[error(transparent)]
    Case(#[from] CaseError),
    /// A recording lacks a channel.
    #[error(transparent)]
    Recording(#[from] RecordingError),
    /// The case cannot be simulated.
    #[error("{path}: {error}")]
    Simulate {
        /// The case.
        path: PathBuf,
        /// Why.
        error: SimulateError,
    },
    /// A recording from which nothing can be learned.
    #[error("{path}: {what}")]
    Record {
        /// The recording.
        path: PathBuf,
        /// What is wrong, and what is needed.
        what: String,
    },
    /// No recording.
    #[error("a recording is needed")]
    NoRecording,
}

impl DiagnoseError {
    pub(crate) fn record(path: &std::path::Path, what: impl Into<String>) -> Self {
        Self::Record {
            path: path.into(),
            what: what.into(),
        }
    }

    pub(crate) fn simulate(path: &std::path::Path, error: impl Into<SimulateError>) -> Self {
        Self::Simulate {
            path: path.into(),
            error: error.into(),
        }
    }
}
