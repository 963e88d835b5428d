//! Structure in complex modal form.

use num_complex::Complex64;

/// One complex mode. It contributes right·leftᵀ/(s − λ) to the receptance H(s), plus the same term with residue and
/// pole conjugated.
///
/// The pole is λ = −ζω + iω√(1 − ζ²) with ω = 2π·frequency. The residue right·leftᵀ has no conjugation and no further
/// factor.
#[derive(Clone, Debug, PartialEq)]
pub struct Mode {
    /// Natural frequency, Hz.
    pub frequency_hz: f64,
    /// Damping ratio ζ, in [0, 1).
    pub damping_ratio: f64,
    /// Left mode shape Ψᴸ, by which forces excite the mode; one entry per direction of the structure, in their order.
    pub left: Vec<Complex64>,
    /// Right mode shape Ψᴿ, by which the mode displaces the structure; one entry per direction of the structure, in
    /// their order.
    pub right: Vec<Complex64>,
}

impl Mode {
    /// The pole λ, rad/s.
    pub fn pole(&self) -> Complex64 {
        let omega = std::f64::consts::TAU * self.frequency_hz;
        Complex64::new(
            -self.damping_ratio * omega,
            omega * (1.0 - self.damping_ratio * self.damping_ratio).sqrt(),
        )
    }

    /// This mode with its natural frequency multiplied by `factor` r, positive, at the same modal mass and damping ratio: the
    /// left shape, and with it the residue, is divided by r, so that its part of the receptance is h(ω/r)/r².
    #[must_use]
    pub fn with_frequency_scaled(&self, factor: f64) -> Self {
        let mut scaled = self.clone();
        scaled.frequency_hz *= factor;
        for entry in &mut scaled.left {
            *entry /= factor;
        }
        scaled
    }
}
