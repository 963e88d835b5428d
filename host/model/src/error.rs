//! Errors of the machine model.

use crate::effects::EffectError;
use crate::structure::StructureError;

/// A machine model that cannot be assembled.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum ModelError {
    /// A structure whose equation of motion is refused: see [`StructureError`].
    #[error(transparent)]
    Structure(#[from] StructureError),
    /// A fault of an effect: see [`EffectError`].
    #[error(transparent)]
    Effect(#[from] EffectError),
    /// A tool without teeth, or pitch angles whose number differs from the number of teeth or whose sum is not 360
    /// degrees to 1e-6 degrees.
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
