//! The edge coefficients K_te, K_re, K_ae differ from those of the case.

use std::sync::Arc;

use super::{Effect, Kind};
use crate::{Cutter, ModelError};

pub(super) const KIND: Kind = Kind {
    name: "edge-force",
    keys: "kte_n_per_mm (or a value), kre_n_per_mm and kae_n_per_mm",
    build: |parameters| {
        let mut n_per_mm = [None; 3];
        for (n_per_mm, key) in n_per_mm
            .iter_mut()
            .zip(["kte_n_per_mm", "kre_n_per_mm", "kae_n_per_mm"])
        {
            *n_per_mm = parameters.finite(key)?;
        }
        if n_per_mm == [None; 3] {
            n_per_mm[0] = Some(parameters.main("kte_n_per_mm")?);
        } else if let Some(value) = parameters.finite("")? {
            n_per_mm[0] = Some(value);
        }
        Ok(Arc::new(EdgeForce { n_per_mm }))
    },
};

#[derive(Clone, Copy, Debug)]
struct EdgeForce {
    /// Tangential, radial, axial; those that are not given stay as they are.
    n_per_mm: [Option<f64>; 3],
}

impl Effect for EdgeForce {
    fn name(&self) -> &'static str {
        KIND.name
    }

    fn alter_cutter(&self, cutter: &mut Cutter) -> Result<(), ModelError> {
        let mut material = cutter.force.material();
        for (n_per_mm, given) in [
            &mut material.kte_n_per_mm,
            &mut material.kre_n_per_mm,
            &mut material.kae_n_per_mm,
        ]
        .into_iter()
        .zip(self.n_per_mm)
        {
            *n_per_mm = given.unwrap_or(*n_per_mm);
        }
        cutter.force = cutter.force.with_material(material);
        Ok(())
    }
}
