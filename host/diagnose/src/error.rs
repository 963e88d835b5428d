//! Errors of a diagnosis.

use std::path::PathBuf;

use quietcut_model::case::CaseError;
use quietcut_recording::RecordingError;
use quietcut_simulate::SimulateError;

/// The case or a recording cannot be diagnosed.
#[derive(Debug, thiserror::Error)]
pub enum DiagnoseError {
    /// The case file cannot be read or used; for example, an entry is missing or wrong.
    #[error(transparent)]
    Case(#[from] CaseError),
    /// A recording cannot be read or used; for example, it lacks a required channel.
    #[error(transparent)]
    Recording(#[from] RecordingError),
    /// The case cannot be simulated.
    #[error("{path}: {error}")]
    Simulate {
        /// File of the case.
        path: PathBuf,
        /// The reason from the simulation.
        error: SimulateError,
    },
    /// A recording that cannot be compared with the baseline.
    #[error("{path}: {what}")]
    Record {
        /// File of the recording.
        path: PathBuf,
        /// The reason why the recording cannot be compared.
        what: String,
    },
    /// No recording is given.
    #[error("at least one recording is required")]
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
