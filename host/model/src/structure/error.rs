//! Errors of a structure.

use std::fmt;

use quietcut_numerics::eigenvalues::EigenvalueError;

use super::Indefinite;

/// Reason for which a structure is refused.
#[derive(Clone, Debug, PartialEq)]
pub enum StructureError {
    /// The indefinite matrices, at least one, in the order mass, stiffness, damping.
    Indefinite(Vec<Indefinite>),
    /// The mass matrix has no inverse.
    SingularMass,
    /// The poles of the structure cannot be computed.
    Poles(EigenvalueError),
}

impl fmt::Display for StructureError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Indefinite(found) => {
                for (index, indefinite) in found.iter().enumerate() {
                    write!(f, "{}{indefinite}", if index == 0 { "" } else { ". Also, " })?;
                }
                Ok(())
            }
            Self::SingularMass => f.write_str("the mass matrix has no inverse"),
            Self::Poles(error) => write!(
                f,
                "the poles of mass, damping and stiffness cannot be computed ({error}); check their units"
            ),
        }
    }
}

impl std::error::Error for StructureError {}
