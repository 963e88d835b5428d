//! Directional coefficients of a cut: exact, smoothed as in the thesis, or averaged over a tooth period.
//!
//! The exact coefficients jump where a tooth enters or leaves the arc of cut. For continuation by a program that needs
//! smooth right-hand sides, the thesis multiplies those of each tooth by
//!
//!   g = ½ tanh(δ(φ, φ_st)/ε) − ½ tanh(δ(φ, φ_ex)/ε)   (eq. A.5)
//!
//! with the difference δ of two angles. For two teeth at half immersion this is eq. 6.19, whose argument is −½ sin(2φ)/ε, to
//! the order ε². Angles are exact here. Eq. A.3 replaces the angle modulo 2π by
//!
//!   φ_mod = π − 2 arctan(sin ½φ cos ½φ/(sin² ½φ + ε₅)) = φ + 2 ε₅ cot ½φ + O(ε₅²),
//!
//! which moves entry and exit by −2 ε₅ cot ½φ, and lets a tooth cut over some 2 ε₅ beyond φ = 0, where φ_mod falls from 2π to
//! 0 through the arc of cut: limits would converge as ε₅ only.
//!
//! The appended oscillator of eq. 6.13 makes the system autonomous. It does not depend on the motion of the tool, so that
//! the orbits and their Floquet multipliers are those of the system that depends on time; the oscillator adds the
//! multipliers 1 and e^{−2T} of its cycle.
//!
//! Order: g − g_exact is an odd function about entry and exit, so that the force on the tool, and with it every limit,
//! converges as ε².
//!
//! With averaged coefficients (the mean of α over a tooth period) the equation is autonomous, the forced orbit an
//! equilibrium. A multiplier e^{λτ} is −1 only if λ = iπ(2k + 1)/τ, and the conjugate of λ is a root too: two multipliers
//! pass −1 together, a torus of rotation ½. There is no flip.

use std::f64::consts::{PI, TAU};

use quietcut_model::milling::Engagement;

/// Directional coefficients with which forced orbits are computed.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Coefficients {
    /// Those of the cut: a tooth enters and leaves at once.
    #[default]
    Exact,
    /// Teeth enter and leave smoothly.
    Smoothed(Smoothing),
    /// Their mean over a tooth period.
    Averaged,
}

/// Smoothing of entry and exit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Smoothing {
    /// Width ε of entry and exit, rad: ε₁ of eq. 6.19, ε₆ of eq. A.5.
    pub width: f64,
}

impl Smoothing {
    /// Entry and exit of a width ε.
    pub fn of_width(width: f64) -> Self {
        Self { width }
    }

    /// Share of a tooth at an immersion angle (rad) that cuts.
    pub(super) fn share(self, engagement: &Engagement, angle: f64) -> f64 {
        let middle = 0.5 * (engagement.start + engagement.exit);
        // The angle nearest to the middle of the arc of cut: g is continued smoothly through both ends of the arc.
        let near = middle + (angle - middle + PI).rem_euclid(TAU) - PI;
        let rise = |from: f64| ((near - from) / self.width).tanh();
        0.5 * (rise(engagement.start) - rise(engagement.exit))
    }
}
