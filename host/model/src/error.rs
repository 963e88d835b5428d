//! Errors of the machine model.

use crate::effects::EffectError;
use crate::structure::StructureError;

/// A machine model that cannot be assembled.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum ModelError {
    /// A structure with an indefinite mass, damping or stiffness matrix, with a singular mass matrix, or whose poles
    /// cannot be computed.
    #[error(transparent)]
    Structure(#[from] StructureError),
    /// An effect that does not apply to the structure or the cut.
    #[error(transparent)]
    Effect(#[from] EffectError),
    /// A tool without teeth, or pitch angles that do not fit the number of teeth or whose sum is not 360 degrees.
    #[error(
        "{teeth} teeth with the pitches {pitch_deg:?} degrees: as many pitches as teeth are needed, with the sum 360"
    )]
    Pitch {
        /// Number of teeth.
        teeth: usize,
        /// Pitch angles, degrees.
        pitch_deg: Vec<f64>,
    },
}
