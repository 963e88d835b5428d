//! How much better than the limit an advised point must be.

/// Depths must be stable this far around the advised one, relative to it: what tables, computed from measured dynamics and
/// force coefficients, may be wrong by near the middle of a pocket.
pub const DEPTH_MARGIN: f32 = 0.1;

/// Speeds must be stable this far around the advised one, relative to it: a spindle under load holds its speed to a
/// fraction of this, a natural frequency (and with it the place of a pocket) is known to about this.
pub const SPEED_BAND: f32 = 0.01;

/// A smaller depth is taken at another speed than the present one only where it is this many times the one at the present
/// speed: two changes must earn more than the margin.
pub const BETTER: f32 = 1.1;
