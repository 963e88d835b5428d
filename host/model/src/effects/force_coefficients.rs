//! The cutting coefficients K_tc, K_rc, K_ac differ from those of the case.

use std::sync::Arc;

use super::{Effect, Kind};
use crate::{Cutter, ModelError};

pub(super) const KIND: Kind = Kind {
    name: "force-coefficients",
    keys: "a value (relative change of all three) or ktc_mpa, krc_mpa and kac_mpa",
    build: |parameters| {
        let relative_change = parameters.finite("")?;
        let mut mpa = [None; 3];
        for (mpa, key) in mpa.iter_mut().zip(["ktc_mpa", "krc_mpa", "kac_mpa"]) {
            *mpa = parameters.finite(key)?;
        }
        if relative_change.is_none() && mpa == [None; 3] {
            parameters.needed("ktc_mpa")?;
        }
        Ok(Arc::new(ForceCoefficients {
            factor: 1.0 + relative_change.unwrap_or(0.0),
            mpa,
        }))
    },
};

#[derive(Clone, Copy, Debug)]
struct ForceCoefficients {
    /// For those that are not given.
    factor: f64,
    mpa: [Option<f64>; 3],
}

impl Effect for ForceCoefficients {
    fn name(&self) -> &'static str {
        KIND.name
    }

    fn alter_cutter(&self, cutter: &mut Cutter) -> Result<(), ModelError> {
        let mut material = cutter.force.material();
        for (mpa, given) in [
            &mut material.ktc_mpa,
            &mut material.krc_mpa,
            &mut material.kac_mpa,
        ]
        .into_iter()
        .zip(self.mpa)
        {
            *mpa = given.unwrap_or(*mpa * self.factor);
        }
        cutter.force = cutter.force.with_material(material);
        Ok(())
    }
}
