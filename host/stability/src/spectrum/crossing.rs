//! A crossing of the unit circle along the depth.

use num_complex::Complex64;

/// A point where a multiplier crosses the unit circle.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Crossing {
    /// Depth, m.
    pub(crate) depth_m: f64,
    /// The multiplier e^{iθ}, with θ in (0, π].
    pub(crate) multiplier: Complex64,
}
