//! The cutting force is not in proportion to the chip: F = K·b·h₀·(h/h₀)^p.

use std::sync::Arc;

use super::{Effect, Kind};
use crate::{ChipLaw, Cutter, ModelError};

pub(super) const KIND: Kind = Kind {
    name: "force-exponent",
    keys: "exponent and reference_chip_mm (without it the feed per tooth)",
    build: |parameters| {
        let exponent = match parameters.positive("")? {
            Some(exponent) => exponent,
            None => match parameters.positive("exponent")? {
                Some(exponent) => exponent,
                None => parameters.needed("exponent")?,
            },
        };
        Ok(Arc::new(ForceExponent {
            exponent,
            reference_m: parameters.positive("reference_chip_mm")?.map(|mm| 1e-3 * mm),
        }))
    },
};

#[derive(Clone, Copy, Debug)]
struct ForceExponent {
    exponent: f64,
    reference_m: Option<f64>,
}

impl Effect for ForceExponent {
    fn name(&self) -> &'static str {
        KIND.name
    }

    fn alter_cutter(&self, cutter: &mut Cutter) -> Result<(), ModelError> {
        cutter.force.chip = Some(ChipLaw {
            exponent: self.exponent,
            reference_m: self.reference_m.unwrap_or(cutter.feed_per_tooth_m),
        });
        Ok(())
    }
}
