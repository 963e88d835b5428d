//! An identified mode.

use quietcut_model::structure::Mode;

/// An identified mode with standard deviations.
#[derive(Clone, Debug, PartialEq)]
pub struct IdentifiedMode {
    /// The mode; its left shape has an entry per excited direction, its right shape an entry per response.
    pub mode: Mode,
    /// Standard deviation of the natural frequency, Hz.
    pub frequency_std_hz: f64,
    /// Standard deviation of the damping ratio.
    pub damping_ratio_std: f64,
    /// Standard deviations of real and imaginary part of the left shape.
    pub left_std: Vec<[f64; 2]>,
    /// Standard deviations of real and imaginary part of the right shape.
    pub right_std: Vec<[f64; 2]>,
}
