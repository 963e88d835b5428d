//! Tolerances within which a layer of a table is valid for a cut.

use crate::units::Degrees;

/// Largest difference in degrees between the immersion angles of the cut and of a layer, at entry and at exit.
///
/// Half a degree changes the mean directional coefficients of a 90° cut by about 1 %, well below the depth margin of advice.
pub const IMMERSION_TOLERANCE: Degrees = Degrees(0.5);

/// Relative tolerance of the feed per tooth at the ends of a layer's feed range. It covers rounding only.
pub const FEED_TOLERANCE: f32 = 1e-4;

/// Largest angle in degrees between the feed directions of two layers that are interpolated. Unfounded.
pub const FEED_DIRECTION_SPAN: Degrees = Degrees(45.0);

/// Largest angle in degrees between two feed directions that count as equal. Unfounded.
pub const FEED_DIRECTION_TOLERANCE: Degrees = Degrees(0.5);
