//! Runout: tooth j on the radius R + e·cos(ψ + 2πj/N).

use std::sync::Arc;

use super::{Effect, Kind};
use crate::milling::Runout;
use crate::{Cutter, ModelError};

pub(super) const KIND: Kind = Kind {
    name: "runout",
    keys: "runout_um and angle_deg",
    build: |parameters| {
        Ok(Arc::new(OfTool(Runout {
            offset_um: parameters.main("runout_um")?,
            angle_deg: parameters.finite("angle_deg")?.unwrap_or(0.0),
        })))
    },
};

#[derive(Clone, Copy, Debug)]
struct OfTool(Runout);

impl Effect for OfTool {
    fn name(&self) -> &'static str {
        KIND.name
    }

    fn alter_cutter(&self, cutter: &mut Cutter) -> Result<(), ModelError> {
        cutter.set_runout(self.0);
        Ok(())
    }
}
