//! The structure: linear dynamics of the tool centre point, with optional cubic terms.

mod cubic_force;
mod definiteness;
mod direction;
mod error;
mod first_order;
mod joints;
mod matrices;
mod modal;
mod modes;
mod speed_dependence;

use std::borrow::Cow;

pub use cubic_force::CubicForce;
pub use definiteness::{Indefinite, Remedy};
pub use direction::{Direction, feed_axes};
pub use error::StructureError;
pub use first_order::FirstOrder;
pub use joints::{Joint, Robot};
pub use matrices::Matrices;
pub use modal::ModalPart;
pub use modes::Mode;
pub use speed_dependence::{ModesAtSpeed, PairingError, SpeedDependence};

/// The structure of a case, in the machine's directions.
#[derive(Clone, Debug, PartialEq)]
pub struct Structure {
    /// For matrices the direction of each row and column, for modes that of each entry of the mode shapes, for joints
    /// x, y and z of the base. Cutting forces and chip thickness depend on x, y and z only.
    pub directions: Vec<Direction>,
    /// Representation of the dynamics: matrices, modes or joints.
    pub form: Form,
}

/// Representations of the dynamics of a structure.
#[derive(Clone, Debug, PartialEq)]
pub enum Form {
    /// Mass, damping and stiffness.
    Matrices(Matrices),
    /// Complex modes in the order of the case file.
    Modes(Vec<Mode>),
    /// Links on compliant joints, at a posture.
    Joints(Box<Robot>),
}

impl Structure {
    /// Checks that, in a structure given by matrices, the symmetric part of the mass matrix is positive definite, and
    /// those of damping and stiffness at least positive semidefinite. Modes and joints pass unchecked.
    ///
    /// # Errors
    /// A matrix does not meet this; see [`Indefinite`].
    pub fn check(&self) -> Result<(), StructureError> {
        let found = match &self.form {
            Form::Matrices(matrices) => definiteness::indefinite(matrices, &self.directions),
            // The matrices of a robot are definite: a case gives each link a positive mass and a positive definite
            // inertia, and each joint a positive stiffness and a damping of 0 or more.
            Form::Modes(_) | Form::Joints(_) => Vec::new(),
        };
        if found.is_empty() {
            Ok(())
        } else {
            Err(StructureError::Indefinite(found))
        }
    }

    /// The matrices of the equation of motion in displacements and rotations, or in joint angles; `None` for modes,
    /// which have no such matrices.
    pub fn equation(&self) -> Option<Cow<'_, Matrices>> {
        match &self.form {
            Form::Matrices(matrices) => Some(Cow::Borrowed(matrices)),
            Form::Modes(_) => None,
            Form::Joints(robot) => Some(Cow::Owned(robot.matrices())),
        }
    }

    /// True if the structure has a cubic stiffness or a cubic damping different from zero.
    pub fn is_nonlinear(&self) -> bool {
        match &self.form {
            Form::Matrices(matrices) => [&matrices.cubic_damping, &matrices.cubic_stiffness]
                .into_iter()
                .flatten()
                .any(|cubic| cubic.iter().any(|&entry| entry != 0.0)),
            Form::Modes(_) => false,
            Form::Joints(robot) => robot.joints.iter().any(|joint| {
                joint.cubic_stiffness_nm_per_rad3 != 0.0 || joint.cubic_damping_nms3_per_rad3 != 0.0
            }),
        }
    }
}
