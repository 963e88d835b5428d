//! A crossing of the unit circle by a Floquet multiplier along the axial depth.

use num_complex::Complex64;

/// Crossing of the unit circle by a Floquet multiplier along the axial depth.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Crossing {
    /// Axial depth, m.
    pub(crate) depth_m: f64,
    /// Multiplier e^{iθ} on the unit circle, with θ in [0, π].
    pub(crate) multiplier: Complex64,
}
