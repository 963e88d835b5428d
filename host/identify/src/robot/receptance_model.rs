//! Receptance of a robot's tool at one posture and frequency, and its derivatives by the joint parameters.

use nalgebra::{DMatrix, Matrix3, Matrix3xX};
use num_complex::Complex64;

use super::joint_parameter::JointParameter;
use quietcut_model::structure::Robot;

/// A robot at one posture and frequency: joint angles per force on the tool, and receptance of the tool.
pub(super) struct Model {
    omega: f64,
    /// Joint angles per force on the tool, Z⁻¹Jᵀ, with the dynamic stiffness Z of the joints and the Jacobian J of the
    /// tool: joints by directions, rad/N.
    angles: DMatrix<Complex64>,
    /// Receptance of the tool, m/N.
    pub(super) receptance: Matrix3<Complex64>,
}

impl Model {
    /// The robot at the angular frequency `omega`, rad/s; `mass` is the mass matrix of its joints. `None` if the
    /// dynamic stiffness of the joints is singular (undamped resonance).
    pub(super) fn new(robot: &Robot, mass: &DMatrix<f64>, omega: f64) -> Option<Self> {
        Self::with(robot, &robot.jacobian(), mass, omega)
    }

    /// As [`Model::new`], with the Jacobian of the tool as `jacobian`.
    pub(super) fn with(
        robot: &Robot,
        jacobian: &Matrix3xX<f64>,
        mass: &DMatrix<f64>,
        omega: f64,
    ) -> Option<Self> {
        let mut dynamic = mass.map(|entry| Complex64::new(-omega * omega * entry, 0.0));
        for (index, joint) in robot.joints.iter().enumerate() {
            dynamic[(index, index)] +=
                Complex64::new(joint.stiffness_nm_per_rad, omega * joint.damping_nms_per_rad);
        }
        let jacobian = jacobian.map(Complex64::from);
        let angles = dynamic.lu().solve(&jacobian.transpose())?;
        let h = &jacobian * &angles;
        let angles = DMatrix::from_fn(angles.nrows(), 3, |i, j| angles[(i, j)]);
        Some(Self {
            omega,
            angles,
            receptance: Matrix3::from_fn(|i, j| h[(i, j)]),
        })
    }

    /// Derivative of the receptance by the logarithm of a joint parameter: dH = −(Z⁻¹Jᵀ)ᵀ dZ (Z⁻¹Jᵀ), with the dynamic
    /// stiffness Z of the joints and the Jacobian J of the tool.
    pub(super) fn slope(
        &self,
        parameter: JointParameter,
        robot: &Robot,
        payload: &Matrix3xX<f64>,
    ) -> Matrix3<Complex64> {
        let value = parameter.value(robot);
        let of_joint = |joint: usize, factor: Complex64| {
            Matrix3::from_fn(|i, j| factor * self.angles[(joint, i)] * self.angles[(joint, j)])
        };
        match parameter {
            JointParameter::Stiffness(joint) => of_joint(joint, Complex64::from(-value)),
            JointParameter::Damping(joint) => of_joint(joint, Complex64::new(0.0, -self.omega * value)),
            // The predicted receptance is that at vanishing force, which cubic terms of the joints do not affect.
            JointParameter::CubicStiffness(_) | JointParameter::CubicDamping(_) => Matrix3::zeros(),
            JointParameter::Payload => {
                let moved = payload.map(Complex64::from) * &self.angles;
                let product = moved.tr_mul(&moved) * Complex64::from(self.omega * self.omega * value);
                Matrix3::from_fn(|i, j| product[(i, j)])
            }
        }
    }
}
