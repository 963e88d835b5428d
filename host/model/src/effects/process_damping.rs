//! The flank rubs on the wave that the edge has just cut: a force −(C/V)·b·v_n on the edge along the chip thickness, with
//! the cutting speed V and the velocity v_n of the edge along it, and friction times that tangentially.

use std::sync::Arc;

use super::{Effect, EffectError, Kind};
use crate::{Cutter, ModelError, ProcessDamping};

pub(super) const KIND: Kind = Kind {
    name: "process-damping",
    keys: "process_damping_n_per_m and friction",
    build: |parameters| {
        Ok(Arc::new(OfFlank(ProcessDamping {
            n_per_m: parameters.main("process_damping_n_per_m")?,
            friction: parameters.finite("friction")?.unwrap_or(0.0),
        })))
    },
};

#[derive(Clone, Copy, Debug)]
struct OfFlank(ProcessDamping);

impl Effect for OfFlank {
    fn name(&self) -> &'static str {
        KIND.name
    }

    fn alter_cutter(&self, cutter: &mut Cutter) -> Result<(), ModelError> {
        if cutter.radius_m.is_none() {
            return Err(EffectError::Cut {
                name: KIND.name,
                what: "the cutting speed is not known without the tool's diameter; give diameter_mm in [tool]",
            }
            .into());
        }
        cutter.force.process_damping = Some(self.0);
        Ok(())
    }
}
