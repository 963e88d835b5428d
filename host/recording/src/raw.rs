//! Content of a file before its columns are understood.

use super::unit::Unit;

/// Columns, sample rate and start time of one record of a file, as every reader of a format returns them.
#[derive(Debug, Default)]
pub(super) struct Raw {
    pub(super) columns: Vec<RawColumn>,
    /// Sample rate, samples per second; `None` if the format does not state it.
    pub(super) sample_rate_hz: Option<f64>,
    /// Sample rate that a word states, such as `Fs = 25600` in a line of text; the sidecar takes precedence.
    pub(super) worded_rate_hz: Option<f64>,
    /// Time of the first sample, s; a time column replaces it.
    pub(super) start_s: f64,
    /// Group, structure element or block that holds the record; `None` if the file has only one record.
    pub(super) label: Option<String>,
    /// Number of the first line of numbers, if no row of names stands before it; the columns are then called by their numbers.
    pub(super) unnamed_line: Option<u64>,
    /// True if the columns are those of one matrix, so that their names say nothing.
    pub(super) asks_names: bool,
    /// Facts about the reading that the user should see: separator, encoding, what was left out.
    pub(super) notes: Vec<String>,
}

/// One column of a file: name, unit and samples in that unit.
#[derive(Debug)]
pub(super) struct RawColumn {
    pub(super) name: String,
    /// Unit of the samples as the file states it.
    pub(super) unit: FoundUnit,
    pub(super) samples: Vec<f64>,
}

/// Unit of a column as a file states it.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum FoundUnit {
    /// The file does not state it.
    None,
    /// The text in the file, which may be no known unit.
    Text(String),
    /// Quantity and factor, from a format with its own system of units.
    Known(Unit),
}

impl From<Option<Unit>> for FoundUnit {
    fn from(unit: Option<Unit>) -> Self {
        unit.map_or(Self::None, Self::Known)
    }
}

impl RawColumn {
    /// A column whose unit the file does not state.
    pub(super) fn without_unit(name: impl Into<String>, samples: Vec<f64>) -> Self {
        Self {
            name: name.into(),
            unit: FoundUnit::None,
            samples,
        }
    }
}
