//! One more mode in the receptance of a direction: H += 1/(m·(ω² − Ω² + 2iζωΩ)).

use std::sync::Arc;

use super::place::axis_of;
use super::{Effect, EffectError, Kind};
use crate::Dynamics;
use crate::structure::{Direction, Structure};

pub(super) const KIND: Kind = Kind {
    name: "missing-mode",
    keys: "frequency_hz, damping_ratio, modal_mass_kg and direction",
    build: |parameters| {
        let frequency_hz = parameters.main("frequency_hz")?;
        let damping_ratio = parameters.number(
            "damping_ratio",
            |zeta| (0.0..1.0).contains(&zeta),
            "a ratio from 0 to below 1",
        )?;
        let missing = |key| EffectError::Missing {
            name: "missing-mode".into(),
            key,
        };
        if frequency_hz <= 0.0 {
            return Err(EffectError::Value {
                effect: "missing-mode".into(),
                found: frequency_hz.to_string(),
                needed: "a frequency greater than 0",
            });
        }
        Ok(Arc::new(MissingMode {
            frequency_hz,
            damping_ratio: damping_ratio.unwrap_or(0.02),
            modal_mass_kg: parameters
                .positive("modal_mass_kg")?
                .ok_or_else(|| missing("modal_mass_kg"))?,
            direction: parameters.direction("direction")?,
        }))
    },
};

#[derive(Clone, Copy, Debug)]
struct MissingMode {
    frequency_hz: f64,
    damping_ratio: f64,
    modal_mass_kg: f64,
    direction: Option<Direction>,
}

impl Effect for MissingMode {
    fn name(&self) -> &'static str {
        KIND.name
    }

    fn alter_dynamics(&self, structure: &Structure, dynamics: &mut Dynamics) -> Result<(), EffectError> {
        let axis = axis_of(structure, self.direction, KIND.name)?;
        dynamics.add_mode(axis, self.frequency_hz, self.damping_ratio, self.modal_mass_kg);
        Ok(())
    }
}
