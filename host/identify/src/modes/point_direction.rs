//! Degrees of freedom of a structure with named points.

use std::fmt;

use quietcut_model::structure::Direction;

/// Degree of freedom: a direction at a named point.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct PointDirection {
    /// Name of the point.
    pub point: String,
    /// Direction at the point.
    pub direction: Direction,
}

impl fmt::Display for PointDirection {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}{}", self.point, self.direction)
    }
}
