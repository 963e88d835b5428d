//! How far a cut may be from what a layer of a table holds for.

use crate::units::Degrees;

/// How far the immersion of the cut may be from that of a layer, in degrees, at entry and at exit.
///
/// A table is made for one immersion. Half a degree moves the mean directional coefficients of a cut of
/// 90° by about 1 %, well below the depth margin of advice.
pub const IMMERSION_TOLERANCE: Degrees = Degrees(0.5);

/// How far the feed per tooth of the cut may be outside of a layer, relative to it: rounding, nothing more.
pub const FEED_TOLERANCE: f32 = 1e-4;

/// How far apart the feed directions of two layers may be for interpolation between them, in degrees.
pub const FEED_DIRECTION_SPAN: Degrees = Degrees(45.0);

/// How far the feed direction of the cut may be from that of a layer to be the same, in degrees.
pub const FEED_DIRECTION_TOLERANCE: Degrees = Degrees(0.5);
