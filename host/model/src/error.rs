//! Why the equations of a machine cannot be set up.

use crate::effects::EffectError;
use crate::structure::StructureError;

/// What is wrong with a model.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum ModelError {
    /// A structure that no machine has.
    #[error(transparent)]
    Structure(#[from] StructureError),
    /// An effect that the structure cannot have.
    #[error(transparent)]
    Effect(#[from] EffectError),
    /// Pitches that do not fit the number of teeth or do not go once around.
    #[error(
        "{teeth} teeth with the pitches {pitch_deg:?} degrees: as many pitches as teeth are needed, with the sum 360"
    )]
    Pitch {
        /// Number of teeth.
        teeth: usize,
        /// The pitches.
        pitch_deg: Vec<f64>,
    },
}
