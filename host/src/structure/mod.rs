//! The structure: how the tool centre point gives way to a force.

mod definiteness;
mod direction;
mod error;
mod first_order;
mod matrices;
mod modal;
mod modes;

pub use definiteness::{Indefinite, Remedy};
pub use direction::{Direction, feed_axes};
pub use error::StructureError;
pub use first_order::FirstOrder;
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

/// The two ways to say how a structure moves.
#[derive(Clone, Debug, PartialEq)]
pub enum Form {
    /// Mass, damping and stiffness.
    Matrices(Matrices),
    /// Complex modes with left and right shapes.
    Modes(Vec<Mode>),
}

impl Structure {
    /// Judges mass, damping and stiffness.
    ///
    /// # Errors
    /// What is indefinite, its smallest eigenvalue, and the entries to blame.
    pub fn check(&self) -> Result<(), StructureError> {
        let found = match &self.form {
            Form::Matrices(matrices) => definiteness::indefinite(matrices, &self.directions),
            Form::Modes(_) => Vec::new(),
        };
        if found.is_empty() {
            Ok(())
        } else {
            Err(StructureError::Indefinite(found))
        }
    }

    /// True where the case has cubic terms that are not all zero.
    pub fn is_nonlinear(&self) -> bool {
        let Form::Matrices(matrices) = &self.form else {
            return false;
        };
        [&matrices.cubic_damping, &matrices.cubic_stiffness]
            .into_iter()
            .flatten()
            .any(|cubic| cubic.iter().any(|&entry| entry != 0.0))
    }
}
