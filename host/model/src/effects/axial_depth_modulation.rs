//! The depth of cut follows the axial vibration, b = b₀ − z (thesis eq. 3.5).

use std::sync::Arc;

use super::{Effect, Kind};
use crate::case::AXIAL_DEPTH_MODULATION;
use crate::{Cutter, ModelError};

pub(super) const KIND: Kind = Kind {
    name: AXIAL_DEPTH_MODULATION,
    keys: "none but on = true in a case",
    build: |parameters| {
        let on = parameters.number("", |value| value == 0.0 || value == 1.0, "0 or 1")?;
        Ok(Arc::new(AxialDepthModulation(on == Some(1.0))))
    },
};

#[derive(Clone, Copy, Debug)]
struct AxialDepthModulation(bool);

impl Effect for AxialDepthModulation {
    fn name(&self) -> &'static str {
        KIND.name
    }

    fn alter_cutter(&self, cutter: &mut Cutter) -> Result<(), ModelError> {
        cutter.axial_depth_modulation = self.0;
        Ok(())
    }
}
