//! The edge wears: all forces of the cut grow with time, × (1 + r·t).

use std::sync::Arc;

use super::{Effect, Kind};
use crate::{Cutter, ModelError};

pub(super) const KIND: Kind = Kind {
    name: "wear",
    keys: "a value (growth over the record) or relative_rate_per_s",
    build: |parameters| {
        Ok(Arc::new(Wear {
            relative_rate_per_s: parameters.rate("relative_rate_per_s")?,
        }))
    },
};

#[derive(Clone, Copy, Debug)]
struct Wear {
    relative_rate_per_s: f64,
}

impl Effect for Wear {
    fn name(&self) -> &'static str {
        KIND.name
    }

    fn alter_cutter(&self, cutter: &mut Cutter) -> Result<(), ModelError> {
        cutter.force.wear_per_s = self.relative_rate_per_s;
        Ok(())
    }
}
