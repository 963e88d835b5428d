//! Meaning of a column of a recorded file: the channel that it becomes.

use super::Quantity;
use super::understood::Basis;

/// Meaning of one column of a recorded file: the channel that it becomes.
#[derive(Clone, Debug)]
pub(super) struct Meaning {
    /// Name of the channel.
    pub(super) name: String,
    pub(super) quantity: Quantity,
    /// Factor from the samples in the file to the SI unit of the channel; negative if `is_negative`.
    pub(super) factor: f64,
    /// True if the sensor points against its axis, so that the samples change their sign.
    pub(super) is_negative: bool,
    pub(super) from: Basis,
    /// Unit of the column as the file or the user states it, shown in the report of the import; `None` if neither does.
    pub(super) unit: Option<String>,
    /// Sensitivity of the sensor that the user states, in volts per SI unit, shown in the report of the import; `None`
    /// if the user states none.
    pub(super) sensitivity: Option<String>,
}
