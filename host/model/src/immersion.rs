//! Directions at one immersion angle.

/// Sine and radial direction at one immersion angle φ.
#[derive(Clone, Copy, Debug)]
pub struct Immersion {
    /// sin φ: component of a unit feed along the radial direction, outwards.
    pub sin: f64,
    /// Unit vector from the tool axis to the tooth, in the machine's x and y.
    pub(super) outward: [f64; 2],
}
