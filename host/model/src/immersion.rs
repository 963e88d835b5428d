//! Directions at one immersion angle.

/// Sine and radial direction at one immersion angle φ.
#[derive(Clone, Copy, Debug)]
pub struct Immersion {
    /// sin φ, the component of the feed along the radial direction.
    pub sin: f64,
    /// Unit vector radially outwards, in the machine's x and y.
    pub(super) outward: [f64; 2],
}
