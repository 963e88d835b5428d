//! The structure: how the tool centre point gives way to a force.

mod definiteness;
mod direction;
mod error;
mod first_order;
mod joints;
mod matrices;
mod modal;
mod modes;

use std::borrow::Cow;

pub use definiteness::{Indefinite, Remedy};
pub use direction::{Direction, feed_axes};
pub use error::StructureError;
pub use first_order::FirstOrder;
pub use joints::{Joint, Robot};
pub use matrices::Matrices;
pub use modal::ModalPart;
pub use modes::Mode;

/// A structure as a case gives it, in the machine's directions.
#[derive(Clone, Debug, PartialEq)]
pub struct Structure {
    /// The direction of each degree of freedom (matrices) or of each entry of the mode shapes (modes).
    /// Forces and chip thickness see x, y and z.
    pub directions: Vec<Direction>,
    /// The equations.
    pub form: Form,
}

/// The ways to say how a structure moves.
#[derive(Clone, Debug, PartialEq)]
pub enum Form {
    /// Mass, damping and stiffness.
    Matrices(Matrices),
    /// Complex modes with left and right shapes.
    Modes(Vec<Mode>),
    /// Compliant joints at a posture; the directions are x, y and z of the base.
    Joints(Box<Robot>),
}

impl Structure {
    /// Judges mass, damping and stiffness.
    ///
    /// # Errors
    /// What is indefinite, its smallest eigenvalue, and the entries to blame.
    pub fn check(&self) -> Result<(), StructureError> {
        let found = match &self.form {
            Form::Matrices(matrices) => definiteness::indefinite(matrices, &self.directions),
            // A passive robot is definite: its joints have positive mass and stiffness.
            Form::Modes(_) | Form::Joints(_) => Vec::new(),
        };
        if found.is_empty() {
            Ok(())
        } else {
            Err(StructureError::Indefinite(found))
        }
    }

    /// The equation of motion in coordinates of its own, displacements or joint angles; `None` for modes, which have none.
    pub fn equation(&self) -> Option<Cow<'_, Matrices>> {
        match &self.form {
            Form::Matrices(matrices) => Some(Cow::Borrowed(matrices)),
            Form::Modes(_) => None,
            Form::Joints(robot) => Some(Cow::Owned(robot.matrices())),
        }
    }

    /// True where the case has cubic terms that are not all zero.
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
