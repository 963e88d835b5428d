//! A point of the engagement arc.

/// A point of the engagement arc.
#[derive(Clone, Copy, Debug)]
pub struct Immersion {
    /// sin φ: how much of the feed lies along the chip.
    pub sin: f64,
    /// Radially outwards, in the machine's x and y.
    pub(super) outward: [f64; 2],
}
