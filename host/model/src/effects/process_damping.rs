//! The flank rubs on the wave that the edge has just cut. The force on the edge along the chip thickness is
//! −(C/V)·b·v_n, with the process damping coefficient C, the cutting speed V, the axial depth b and the velocity v_n of
//! the edge in that direction; the tangential force is (C/V)·b·v_n times the friction coefficient, against the spindle
//! rotation.

use std::sync::Arc;

use super::{Class, Effect, EffectError, EffectName, EffectSpec, Locations, Parameter, Treatment};
use crate::{Cutter, ModelError, ProcessDamping};

/// The specification.
pub(super) const PROCESS_DAMPING: EffectSpec = EffectSpec {
    id: EffectName::ProcessDamping,
    name: "process-damping",
    class: Class::CuttingForce,
    locations: Locations::Cut,
    parameters: &[
        Parameter::number("process_damping_n_per_m", "N/m", "process damping coefficient, C")
            .linear()
            .main(),
        Parameter::number(
            "friction",
            "",
            "ratio of the tangential to the normal force; 0 without the key",
        ),
    ],
    treatment: Treatment::ChipLaw,
    candidates: &["one coefficient"],
    shares_term_with: &[],
    summary: "the flank rubs on the wave that the edge has just cut",
    equation: "F_n −= (C/V)·b·v_n, V the cutting speed",
    shows: "damping normal to the edge that grows with depth and with 1/speed, at two speeds",
    hidden_by: "recordings at one speed and depth, where it is damping",
    source: "Altintas, Eynian and Onozuka, CIRP Annals 57 (2008)",
    example: "process_damping_n_per_m = 2e5\nfriction = 0.3",
    describing_function: None,
    build: |values| {
        Ok(Arc::new(FlankDamping(ProcessDamping {
            n_per_m: values.main("process_damping_n_per_m")?,
            friction: values.number("friction")?.unwrap_or(0.0),
        })))
    },
};

#[derive(Clone, Copy, Debug)]
struct FlankDamping(ProcessDamping);

impl Effect for FlankDamping {
    fn id(&self) -> EffectName {
        EffectName::ProcessDamping
    }

    fn alter_cutter(&self, cutter: &mut Cutter) -> Result<(), ModelError> {
        if cutter.radius_m.is_none() {
            return Err(EffectError::Cut {
                name: self.name(),
                what: "the cutting speed is not known without the tool's diameter; give diameter_mm in [tool]",
            }
            .into());
        }
        cutter.force.process_damping = Some(self.0);
        Ok(())
    }
}
