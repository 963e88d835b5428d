//! Content of a file before the sidecar is applied.

use super::unit::Unit;

/// Columns, sample rate and start time of a file, before the sidecar is applied.
pub(super) struct Raw {
    pub(super) columns: Vec<RawColumn>,
    /// Sample rate, samples per second; `None` if the format does not state it.
    pub(super) sample_rate_hz: Option<f64>,
    /// Time of the first sample, s; a time column replaces it.
    pub(super) start_s: f64,
}

/// One column of a file: name, unit and samples in that unit.
pub(super) struct RawColumn {
    pub(super) name: String,
    /// Unit of the samples; `None` if the file does not state it.
    pub(super) unit: Option<Unit>,
    pub(super) samples: Vec<f64>,
}
