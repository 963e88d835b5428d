//! The cutting force is not proportional to the chip thickness: F = K·b·h₀·(h/h₀)^p.

use std::sync::Arc;

use super::{Class, Effect, EffectName, EffectSpec, Locations, Parameter, Prior, Treatment};
use crate::{ChipLaw, Cutter, ModelError};

/// The specification.
pub(super) const FORCE_EXPONENT: EffectSpec = EffectSpec {
    id: EffectName::ForceExponent,
    name: "force-exponent",
    class: Class::CuttingForce,
    locations: Locations::Cut,
    parameters: &[
        Parameter::number("exponent", "", "exponent of the chip thickness")
            .main()
            .within(Prior::POSITIVE),
        Parameter::number(
            "reference_chip_mm",
            "mm",
            "chip thickness h₀; the feed per tooth without the key",
        )
        .within(Prior::POSITIVE),
    ],
    treatment: Treatment::ChipLaw,
    candidates: &["one exponent about one reference chip"],
    shares_term_with: &[],
    summary: "the cutting force grows with a power of the chip thickness",
    equation: "F = K·b·h₀·(h/h₀)^p",
    shows: "a force that grows less than the chip, at two feeds or over the chips of one tooth passing",
    hidden_by: "recordings at one chip thickness, where it is other coefficients",
    source: "Kienzle, VDI-Z 94 (1952)",
    example: "exponent = 0.8\nreference_chip_mm = 0.05",
    describing_function: None,
    build: |values| {
        Ok(Arc::new(ForceExponent {
            exponent: values.main("exponent")?,
            reference_m: values.number("reference_chip_mm")?.map(|mm| 1e-3 * mm),
        }))
    },
};

#[derive(Clone, Copy, Debug)]
struct ForceExponent {
    exponent: f64,
    reference_m: Option<f64>,
}

impl Effect for ForceExponent {
    fn id(&self) -> EffectName {
        EffectName::ForceExponent
    }

    fn alter_cutter(&self, cutter: &mut Cutter) -> Result<(), ModelError> {
        cutter.force.chip = Some(ChipLaw {
            exponent: self.exponent,
            reference_m: self.reference_m.unwrap_or(cutter.feed_per_tooth_m),
        });
        Ok(())
    }
}
