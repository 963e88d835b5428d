//! Radial immersion and feed of a cut.

/// Radial immersion and feed of a cut. Spindle speed and axial depth are not part of it: stability charts vary them.
///
/// The immersion angle is measured clockwise from the normal of the feed: up-milling runs from 0° to the exit angle,
/// down-milling from the start angle to 180°.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cut {
    /// Start angle: immersion angle at which a tooth enters, degrees, in [0, 180).
    pub start_deg: f64,
    /// Exit angle: immersion angle at which a tooth leaves, degrees, in (start, 180].
    pub exit_deg: f64,
    /// Feed per tooth f_t, mm.
    pub feed_per_tooth_mm: f64,
    /// Angle from the machine's x to the feed, towards the machine's y, degrees.
    pub feed_direction_deg: f64,
}
