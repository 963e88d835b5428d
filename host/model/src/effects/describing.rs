//! Describing functions of restoring forces, as part of the specification of an effect.
//!
//! Under x = X·sin ωt the fundamental of f_r is N(X, ω)·x: the real part of N is in phase with the displacement, the
//! imaginary part in phase with the velocity.

use num_complex::Complex64;

/// Harmonic motion at which a describing function is evaluated, with the bend of its force law.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Harmonic {
    /// Displacement amplitude X, m.
    pub amplitude_m: f64,
    /// Angular frequency ω, rad/s.
    pub omega: f64,
    /// Displacement at which the force law bends, m: half of a gap, or the yield displacement. Force laws without a
    /// bend do not use it.
    pub bend_m: f64,
}

impl Harmonic {
    /// A harmonic motion for a force law without a bend: displacement amplitude, m, and angular frequency, rad/s.
    pub const fn new(amplitude_m: f64, omega: f64) -> Self {
        Self {
            amplitude_m,
            omega,
            bend_m: 0.0,
        }
    }

    /// This motion for a force law that bends at the displacement `bend_m`, m.
    #[must_use]
    pub const fn with_bend_m(self, bend_m: f64) -> Self {
        Self { bend_m, ..self }
    }
}

/// Describing functions N(X, ω) of up to two terms of a restoring force, each for a unit coefficient, such as those of
/// x³ and x⁵. The second is zero if the force has only one term.
pub type DescribingFunction = fn(Harmonic) -> [Complex64; 2];
