//! The columns of a file before its sidecar is consulted.

use super::unit::Unit;

/// What a file says before the sidecar is consulted.
pub(super) struct Raw {
    pub(super) columns: Vec<RawColumn>,
    /// Samples per second, where the format carries it.
    pub(super) sample_rate_hz: Option<f64>,
    /// Time of the first sample, s, where no column says so.
    pub(super) start_s: f64,
}

/// A column of a file.
pub(super) struct RawColumn {
    pub(super) name: String,
    /// `None` where the file does not say.
    pub(super) unit: Option<Unit>,
    pub(super) samples: Vec<f64>,
}
