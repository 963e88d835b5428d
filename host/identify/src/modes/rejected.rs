//! Rejected poles.

use num_complex::Complex64;

/// A pole of the modal identification that was not accepted as a mode.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
pub struct Rejected {
    /// Frequency |λ|/2π of the pole, Hz.
    pub frequency_hz: f64,
    /// Damping ratio of the pole.
    pub damping_ratio: f64,
    /// Reason of the rejection, for the user.
    pub why: String,
}

pub(super) fn reject(pole: Complex64, why: String) -> Rejected {
    Rejected {
        frequency_hz: pole.norm() / std::f64::consts::TAU,
        damping_ratio: -pole.re / pole.norm(),
        why,
    }
}
