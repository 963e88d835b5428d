//! One or more of the cutting coefficients K_tc, K_rc, K_ac differ from those of the case.

use std::sync::Arc;

use super::{Class, Effect, EffectName, EffectSpec, Locations, Parameter, Treatment};
use crate::{Cutter, ModelError};

/// The specification.
pub(super) const FORCE_COEFFICIENTS: EffectSpec = EffectSpec {
    id: EffectName::ForceCoefficients,
    name: "force-coefficients",
    class: Class::CuttingForce,
    locations: Locations::Cut,
    parameters: &[
        Parameter::number("", "", "relative change of all three coefficients").main(),
        Parameter::number("ktc_mpa", "MPa", "tangential cutting coefficient").linear(),
        Parameter::number("krc_mpa", "MPa", "radial cutting coefficient").linear(),
        Parameter::number("kac_mpa", "MPa", "axial cutting coefficient").linear(),
    ],
    treatment: Treatment::LinearProcess,
    candidates: &[
        "all coefficients by one factor, those of the edge included where the case has an edge force",
        "each cutting coefficient by itself",
    ],
    shares_term_with: &[],
    summary: "the cutting coefficients differ from the case",
    equation: "F = b·(K_e + K_c·h) with other K_tc, K_rc, K_ac",
    shows: "forces in proportion to the chip thickness, and with them the chatter limits",
    hidden_by: "a vanishing chip; without measured force all coefficients by one factor are a gain of all channels",
    source: "Altintas, Manufacturing Automation (2012), ch. 2",
    example: "ktc_mpa = 700.0\nkrc_mpa = 210.0",
    describing_function: None,
    build: |values| {
        let relative_change = values.number("")?;
        let mut mpa = [None; 3];
        for (mpa, key) in mpa.iter_mut().zip(["ktc_mpa", "krc_mpa", "kac_mpa"]) {
            *mpa = values.number(key)?;
        }
        if relative_change.is_none() && mpa == [None; 3] {
            values.needed("ktc_mpa")?;
        }
        Ok(Arc::new(ForceCoefficients {
            factor: 1.0 + relative_change.unwrap_or(0.0),
            mpa,
        }))
    },
};

#[derive(Clone, Copy, Debug)]
struct ForceCoefficients {
    /// Factor on those cutting coefficients of the case that `mpa` does not replace.
    factor: f64,
    /// Tangential, radial and axial cutting coefficient, MPa; `None` means the coefficient of the case times `factor`.
    mpa: [Option<f64>; 3],
}

impl Effect for ForceCoefficients {
    fn id(&self) -> EffectName {
        EffectName::ForceCoefficients
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
