//! Safety margins of advice against the stability limit.

/// Relative depth margin: all depths within ±10 % of the advised depth must be stable.
///
/// It covers the error of limits computed from measured dynamics and force coefficients, near the middle of a stable pocket.
/// Unfounded.
pub const DEPTH_MARGIN: f32 = 0.1;

/// Relative speed margin: all speeds within ±1 % of the advised speed must be stable.
///
/// A natural frequency, and with it the speed of a pocket, is known to about 1 %. A spindle under load holds its speed more closely.
pub const SPEED_BAND: f32 = 0.01;

/// Factor by which the quiet depth at another speed must exceed that at the present speed to be advised.
///
/// Changing both speed and depth must gain at least as much as [`DEPTH_MARGIN`].
pub const BETTER: f32 = 1.1;
