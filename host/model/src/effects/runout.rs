//! Runout: the tool axis is offset by e from the spindle axis, so that tooth j is on the radius R + e·cos(ψ + θ_j),
//! with its angle θ_j from the first tooth.

use std::sync::Arc;

use super::{Class, Effect, EffectName, EffectSpec, Locations, Parameter, Treatment};
use crate::milling::Runout;
use crate::{Cutter, ModelError};

/// The specification.
pub(super) const RUNOUT: EffectSpec = EffectSpec {
    id: EffectName::Runout,
    name: "runout",
    class: Class::Geometry,
    locations: Locations::Cut,
    parameters: &[
        Parameter::number("runout_um", "µm", "offset of the tool axis, e")
            .linear()
            .main(),
        Parameter::number(
            "angle_deg",
            "°",
            "angle of the first tooth from the offset, ψ; 0 without the key",
        ),
    ],
    treatment: Treatment::LinearProcess,
    candidates: &["one offset in the plane"],
    shares_term_with: &[],
    summary: "the tool rotates about an axis beside its own",
    equation: "R_j = R + e·cos(ψ + θ_j), with the angle θ_j of tooth j from the first, 2πj/N at equal pitch",
    shows: "lines at the spindle frequency and its multiples between those of the teeth, from the first tooth on",
    hidden_by: "a flip of an even number of teeth once it no longer grows",
    source: "Kline and DeVor, Int. J. Mach. Tool Des. Res. 23 (1983)",
    example: "runout_um = 12.0\nangle_deg = 30.0",
    describing_function: None,
    build: |values| {
        Ok(Arc::new(ToolRunout(Runout {
            offset_um: values.main("runout_um")?,
            angle_deg: values.number("angle_deg")?.unwrap_or(0.0),
        })))
    },
};

#[derive(Clone, Copy, Debug)]
struct ToolRunout(Runout);

impl Effect for ToolRunout {
    fn id(&self) -> EffectName {
        EffectName::Runout
    }

    fn alter_cutter(&self, cutter: &mut Cutter) -> Result<(), ModelError> {
        cutter.set_runout(self.0);
        Ok(())
    }
}
