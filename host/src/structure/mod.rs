//! The structure: how the tool centre point gives way to a force.

mod direction;
mod matrices;
mod modes;

pub use direction::Direction;
pub use matrices::Matrices;
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
