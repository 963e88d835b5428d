//! How the tool meets the workpiece.

/// A cut, without its spindle speed and axial depth: those are what charts vary.
///
/// x is the feed direction, y the normal, z the tool axis. Immersion is measured clockwise from +y:
/// up-milling runs from 0 to the exit angle, down-milling from the start angle to 180.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cut {
    /// Immersion angle where a tooth enters, degrees, in [0, 180).
    pub start_deg: f64,
    /// Immersion angle where a tooth leaves, degrees, in (start, 180].
    pub exit_deg: f64,
    /// Feed per tooth f_t, mm.
    pub feed_per_tooth_mm: f64,
    /// Angle from the machine's x to the feed, towards the machine's y, degrees.
    pub feed_direction_deg: f64,
}
