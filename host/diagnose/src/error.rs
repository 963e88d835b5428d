//! Errors of a diagnosis.

use std::path::{Path, PathBuf};

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
    /// A recording whose orders another input explains than the given one.
    #[error("{}", contradiction(path, *given, fitting, of_given_tool))]
    Contradiction {
        /// File of the recording.
        path: PathBuf,
        /// χ² per value (1 for noise alone) of the orders with the given input.
        given: f64,
        /// Inputs that explain the orders, the best first.
        fitting: Vec<FittingInput>,
        /// Recordings that fit the given tool.
        of_given_tool: Vec<PathBuf>,
    },
    /// No recording is given.
    #[error("at least one recording is required")]
    NoRecording,
}

/// An input that explains the orders of a recording.
#[derive(Clone, Debug, PartialEq)]
pub struct FittingInput {
    /// The input in words.
    pub what: String,
    /// χ² per value (1 for noise alone) of the orders with it.
    pub left: f64,
}

/// The sentence of [`DiagnoseError::Contradiction`].
fn contradiction(path: &Path, given: f64, fitting: &[FittingInput], of_given_tool: &[PathBuf]) -> String {
    let inputs: Vec<String> = fitting
        .iter()
        .map(|input| format!("{} (χ² per value {:.1})", input.what, input.left))
        .collect();
    let mut text = format!(
        "{}: the orders contradict the case, its cut or the channels: χ² per value is {given:.1}, even with cutting \
         force, runout, structure and gains of the sensors free. They fit {}; correct the input and diagnose again",
        path.display(),
        inputs.join(", or ")
    );
    if !of_given_tool.is_empty() {
        let others: Vec<String> = of_given_tool
            .iter()
            .map(|path| path.display().to_string())
            .collect();
        text += &format!(
            ". {} fits the tool of the case: are these recordings of different tools?",
            others.join(", ")
        );
    }
    text
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
