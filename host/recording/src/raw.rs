//! Content of a recorded file before the meaning of its columns is determined.

use super::unit::Unit;

/// Columns, sample rate and start time of one record of a file, as every reader of a format returns them.
#[derive(Debug, Default)]
pub(super) struct Raw {
    pub(super) columns: Vec<RawColumn>,
    /// Sample rate that the format of the file states, samples per second; `None` if it states none.
    pub(super) sample_rate_hz: Option<f64>,
    /// Sample rate, samples per second, that a text or a variable of the file states, such as `Fs = 25600`; the sidecar
    /// takes precedence. `None` if none is stated so.
    pub(super) worded_rate_hz: Option<f64>,
    /// Time of the first sample of the record, s; a time column replaces it unless the option `--rate` replaces that
    /// column.
    pub(super) start_s: f64,
    /// Name of the group (TDMS), structure element (MAT) or block (LabVIEW) that holds the record; `None` for the only
    /// record of a TDMS or LabVIEW file, for variables of a MAT-file outside structures, and in other formats.
    pub(super) label: Option<String>,
    /// Number of the first line with numbers in a text file without a row of names, whose columns are called by their
    /// numbers; `None` if there is a row of names, and in other formats.
    pub(super) unnamed_line: Option<u64>,
    /// True if there are several columns and all come from one matrix of a MAT-file, which has no names for them, so
    /// that the user must give them.
    pub(super) asks_names: bool,
    /// Number of each column in the file, from 1, if some of its columns were left out; empty otherwise.
    pub(super) numbers: Vec<usize>,
    /// Facts about the reading of the file that the user should see: separator, encoding, omitted columns.
    pub(super) notes: Vec<String>,
}

impl Raw {
    /// Number in the file, from 1, of the column with this index.
    pub(super) fn number(&self, index: usize) -> usize {
        self.numbers.get(index).copied().unwrap_or(index + 1)
    }
}

/// One column of a file: name, unit and samples in that unit.
#[derive(Debug)]
pub(super) struct RawColumn {
    pub(super) name: String,
    /// Unit of the column's samples as the file states it.
    pub(super) unit: FoundUnit,
    pub(super) samples: Vec<f64>,
}

/// Unit of a column as a file states it.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum FoundUnit {
    /// The file states no unit of the column.
    None,
    /// Text of the unit in the file, which may be no known unit.
    Text(String),
    /// Quantity and factor to SI of the column, from a format with its own system of units such as UFF.
    Known(Unit),
}

impl From<Option<Unit>> for FoundUnit {
    fn from(unit: Option<Unit>) -> Self {
        unit.map_or(Self::None, Self::Known)
    }
}

impl RawColumn {
    /// Makes a column whose unit the file does not state.
    pub(super) fn without_unit(name: impl Into<String>, samples: Vec<f64>) -> Self {
        Self {
            name: name.into(),
            unit: FoundUnit::None,
            samples,
        }
    }
}
