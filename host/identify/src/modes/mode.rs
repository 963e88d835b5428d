//! An identified mode.

use quietcut_model::structure::Mode;

/// A mode identified from receptances or records, with standard deviations.
#[derive(Clone, Debug, PartialEq)]
pub struct IdentifiedMode {
    /// The mode; its left shape has an entry per excited direction, its right shape an entry per measured direction.
    pub mode: Mode,
    /// Standard deviation of the natural frequency, Hz.
    pub frequency_std_hz: f64,
    /// Standard deviation of the damping ratio.
    pub damping_ratio_std: f64,
    /// Standard deviations of the real and the imaginary part of each entry of the left shape.
    pub left_std: Vec<[f64; 2]>,
    /// Standard deviations of the real and the imaginary part of each entry of the right shape.
    pub right_std: Vec<[f64; 2]>,
}
