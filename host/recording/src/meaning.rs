//! Meaning of a column: the channel that it becomes.

use super::Quantity;
use super::understood::Basis;

/// Meaning of one column: the channel that it becomes.
#[derive(Clone, Debug)]
pub(super) struct Meaning {
    /// Name of the channel.
    pub(super) name: String,
    pub(super) quantity: Quantity,
    /// Factor from the samples in the file to SI.
    pub(super) factor: f64,
    /// True if the channel points against its axis.
    pub(super) is_negative: bool,
    pub(super) from: Basis,
    /// Unit as it is stated, for the report.
    pub(super) unit: Option<String>,
    /// Sensitivity as it is stated, for the report.
    pub(super) sensitivity: Option<String>,
}
