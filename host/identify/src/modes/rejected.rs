//! Rejected poles.

use num_complex::Complex64;

/// A rejected pole.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
pub struct Rejected {
    /// Its frequency |λ|/2π, Hz.
    pub frequency_hz: f64,
    /// Its damping ratio.
    pub damping_ratio: f64,
    /// Reason of the rejection.
    pub why: String,
}

pub(super) fn reject(pole: Complex64, why: String) -> Rejected {
    Rejected {
        frequency_hz: pole.norm() / std::f64::consts::TAU,
        damping_ratio: -pole.re / pole.norm(),
        why,
    }
}
