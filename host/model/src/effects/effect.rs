//! The interface of an effect.

use std::fmt::Debug;

use super::pickup::Pickup;
use super::{EffectError, EffectName};
use crate::structure::Structure;
use crate::{Cutter, Dynamics, ModelError, RestoringForce, Spindle};

/// An effect with values for its parameters. It acts through one or more of the methods that change a model; by default
/// they do nothing.
pub trait Effect: Debug + Send + Sync {
    /// Entry of the effect in the list of all effects.
    fn id(&self) -> EffectName;

    /// Name of the effect in cases, in answers and on the command line, such as `cubic-stiffness`.
    fn name(&self) -> &'static str {
        self.id().name()
    }

    /// Changes parameters of the structure that a case can also state.
    ///
    /// # Errors
    /// The effect does not apply to the structure: see [`EffectError::Structure`].
    fn alter_structure(&self, _structure: &mut Structure) -> Result<(), EffectError> {
        Ok(())
    }

    /// Changes `dynamics`, the equation of motion of `structure`, for example by an additional mode.
    ///
    /// # Errors
    /// The direction of the effect cannot be used: see [`EffectError::Direction`].
    fn alter_dynamics(&self, _structure: &Structure, _dynamics: &mut Dynamics) -> Result<(), EffectError> {
        Ok(())
    }

    /// Restoring forces that the effect adds to the equation of motion of `structure`.
    ///
    /// # Errors
    /// The direction of the effect cannot be used (see [`EffectError::Direction`]), or the static stiffness of the
    /// structure is not known.
    fn restoring_forces(&self, _structure: &Structure) -> Result<Vec<Box<dyn RestoringForce>>, EffectError> {
        Ok(Vec::new())
    }

    /// Changes tool, cut or cutting force. `cutter` holds the mean spindle speed of the cut, if that is known.
    ///
    /// # Errors
    /// The tool or the cut lacks a quantity that the effect requires.
    fn alter_cutter(&self, _cutter: &mut Cutter) -> Result<(), ModelError> {
        Ok(())
    }

    /// Changes the rotation of the spindle.
    fn alter_spindle(&self, _spindle: &mut Spindle) {}

    /// Changes the reading of a measured channel, for example its weights or its delay.
    fn alter_channel(&self, _channel: &mut Pickup) {}
}
