//! Structure in matrix form.

use nalgebra::DMatrix;

/// Matrices of mass, damping and stiffness, linear and cubic, in M q̈ + C q̇ + K q + C₃ q̇∘³ + K₃ q∘³ = F, with ∘³ the
/// cube of each element.
///
/// All matrices are square with one row per direction of the structure, or per joint of a robot, in SI units. The
/// stated units are those of displacements; for rotations and joint angles moments and radians take the place of forces
/// and metres.
#[derive(Clone, Debug, PartialEq)]
pub struct Matrices {
    /// M, kg.
    pub mass: DMatrix<f64>,
    /// C, N s/m.
    pub damping: DMatrix<f64>,
    /// K, N/m.
    pub stiffness: DMatrix<f64>,
    /// Matrix C₃ of cubic damping, which multiplies the cubes of the velocities, N s³/m³; `None` stands for zero.
    pub cubic_damping: Option<DMatrix<f64>>,
    /// Matrix K₃ of cubic stiffness, which multiplies the cubes of the displacements, N/m³; `None` stands for zero.
    pub cubic_stiffness: Option<DMatrix<f64>>,
}
