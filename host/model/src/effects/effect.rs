//! The interface of an effect.

use std::fmt::Debug;

use super::pickup::Pickup;
use super::{EffectError, EffectName};
use crate::structure::Structure;
use crate::{Cutter, Dynamics, ModelError, Spindle, Term};

/// An effect with values. It acts by one of these methods; the others change nothing.
pub trait Effect: Debug + Send + Sync {
    /// Its entry in the list.
    fn id(&self) -> EffectName;

    /// Its name in cases, answers and on the command line.
    fn name(&self) -> &'static str {
        self.id().name()
    }

    /// Changes a parameter of the structure.
    ///
    /// # Errors
    /// The structure has no such parameter.
    fn alter_structure(&self, _structure: &mut Structure) -> Result<(), EffectError> {
        Ok(())
    }

    /// Changes the equations of the `structure` beyond what a case can say.
    ///
    /// # Errors
    /// The structure does not have the direction.
    fn alter_dynamics(&self, _structure: &Structure, _dynamics: &mut Dynamics) -> Result<(), EffectError> {
        Ok(())
    }

    /// Terms that the equation of motion of `structure` gets.
    ///
    /// # Errors
    /// The structure does not have the direction, or cannot have the term.
    fn terms(&self, _structure: &Structure) -> Result<Vec<Box<dyn Term>>, EffectError> {
        Ok(Vec::new())
    }

    /// Changes the tool or its cut.
    ///
    /// # Errors
    /// What the cutter refuses.
    fn alter_cutter(&self, _cutter: &mut Cutter) -> Result<(), ModelError> {
        Ok(())
    }

    /// Changes the rotation of the spindle.
    fn alter_spindle(&self, _spindle: &mut Spindle) {}

    /// Changes what a channel reads.
    fn alter_channel(&self, _channel: &mut Pickup) {}
}
