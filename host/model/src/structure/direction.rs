//! Degrees of freedom of the structure, and the axes of a feed direction.

use std::fmt;
use std::str::FromStr;

use nalgebra::Matrix3;

/// A displacement along, or a rotation about, an axis of the machine.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Direction {
    /// Displacement along x.
    X,
    /// Displacement along y.
    Y,
    /// Displacement along z, the tool axis.
    Z,
    /// Rotation about x.
    Rx,
    /// Rotation about y.
    Ry,
    /// Rotation about z.
    Rz,
}

impl Direction {
    /// All six directions, in the order x, y, z, rx, ry, rz.
    pub const ALL: [Self; 6] = [Self::X, Self::Y, Self::Z, Self::Rx, Self::Ry, Self::Rz];

    /// The name of the direction in files: x, y, z, rx, ry, rz.
    pub fn name(self) -> &'static str {
        match self {
            Self::X => "x",
            Self::Y => "y",
            Self::Z => "z",
            Self::Rx => "rx",
            Self::Ry => "ry",
            Self::Rz => "rz",
        }
    }

    /// Index 0, 1, 2 of x, y, z; `None` for rotations: in the model neither cutting forces nor chip thickness depend on
    /// them, nor have cutting forces a moment.
    pub fn axis(self) -> Option<usize> {
        match self {
            Self::X => Some(0),
            Self::Y => Some(1),
            Self::Z => Some(2),
            Self::Rx | Self::Ry | Self::Rz => None,
        }
    }
}

impl fmt::Display for Direction {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

/// Matrix whose columns are the feed, normal and axial direction of a feed at `angle_deg` from x towards y, degrees;
/// rows are the machine's x, y, z.
pub fn feed_axes(angle_deg: f64) -> Matrix3<f64> {
    let (sin, cos) = angle_deg.to_radians().sin_cos();
    Matrix3::new(cos, -sin, 0.0, sin, cos, 0.0, 0.0, 0.0, 1.0)
}

/// A word that is not the name of a direction.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("\"{0}\" is no direction; x, y, z, rx, ry or rz is needed")]
pub struct UnknownDirection(pub String);

impl FromStr for Direction {
    type Err = UnknownDirection;

    fn from_str(name: &str) -> Result<Self, Self::Err> {
        Self::ALL
            .into_iter()
            .find(|direction| direction.name() == name)
            .ok_or_else(|| UnknownDirection(name.into()))
    }
}
