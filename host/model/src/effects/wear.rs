//! The edge wears: all forces of the cut grow with time, × (1 + r·t).

use std::sync::Arc;

use super::{Class, Effect, EffectName, EffectSpec, Locations, Parameter, Treatment};
use crate::{Cutter, ModelError};

/// The specification.
pub(super) const WEAR: EffectSpec = EffectSpec {
    id: EffectName::Wear,
    name: "wear",
    class: Class::CuttingForce,
    locations: Locations::Cut,
    parameters: &[
        Parameter::number("", "", "relative growth of the forces over the record").main(),
        Parameter::number("relative_rate_per_s", "1/s", "relative growth per second").linear(),
    ],
    treatment: Treatment::OfMoment(
        "forces that grow with time have limits for one moment only; give the coefficients of that moment in \
         [extension.force-coefficients] instead, or say after how long (--after-s 0 and --after-s T: between, limits lie \
         between)",
    ),
    candidates: &["growth at a constant rate"],
    shares_term_with: &[],
    summary: "the forces of the cut grow with time",
    equation: "F → F·(1 + r·t)",
    shows: "all tooth lines grow alike along the record",
    hidden_by: "a sensor whose gain drifts; it moves no frequency",
    source: "Altintas, Manufacturing Automation (2012), ch. 2",
    example: "relative_rate_per_s = 1e-3",
    describing_function: None,
    build: |values| {
        Ok(Arc::new(Wear {
            relative_rate_per_s: values.rate("relative_rate_per_s")?,
        }))
    },
};

#[derive(Clone, Copy, Debug)]
struct Wear {
    relative_rate_per_s: f64,
}

impl Effect for Wear {
    fn id(&self) -> EffectName {
        EffectName::Wear
    }

    fn alter_cutter(&self, cutter: &mut Cutter) -> Result<(), ModelError> {
        cutter.force.wear_per_s = self.relative_rate_per_s;
        Ok(())
    }
}
