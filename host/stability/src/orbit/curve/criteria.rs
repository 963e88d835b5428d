//! Thresholds of the continuation of curves over two parameters.
//!
//! The comment of each states where the number comes from; "unfounded" as in the crate's `criteria`.

/// First step along a curve of stability losses over two parameters, in units in which each parameter has its requested
/// range as its unit, the orbit its start, the angle of the multiplier π and the mode ten times its norm. Unfounded.
pub(super) const CURVE_STEP_FIRST: f64 = 0.01;

/// Longest step along a curve of stability losses, in the units of [`CURVE_STEP_FIRST`]. Unfounded: the positions of the
/// points do not depend on it, only their distances.
pub(super) const CURVE_STEP_MAX: f64 = 0.05;

/// Shortest step along a curve of stability losses, in the units of [`CURVE_STEP_FIRST`]; a curve that is not found with
/// it is lost. Unfounded.
pub(super) const CURVE_STEP_MIN: f64 = 1e-6;

/// Least cosine of the angle between the tangents at neighbouring points of a curve of stability losses: 18°. A larger
/// angle halves the step, so that a curve does not jump to another one. Unfounded.
pub(super) const CURVE_COSINE_MIN: f64 = 0.95;
