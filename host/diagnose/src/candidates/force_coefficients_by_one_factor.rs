//! All cutting and edge coefficients of the material change by one factor, and the cutting force F with them: F·(1 +
//! change).
//!
//! In the steady state of a stable linear cut without measured force, one gain of all channels of motion is equivalent.

use super::process::{changed, cutter, everywhere};
use crate::candidates::cause::{Cause, LocatedEffect, Location, Parameter, Regressors};
use crate::records::record::Record;
use crate::records::study::Study;
use quietcut_model::effects::EffectName;
use quietcut_model::milling::Material;

/// The cause that one factor changes the cutting coefficients and, if `with_edge` is true, the edge coefficients. With
/// `with_edge` it is a candidate only if the case has an edge coefficient other than zero, without it only if the case
/// has none.
pub(super) struct CommonFactor {
    pub(super) with_edge: bool,
}

const CUTTING: [&str; 3] = ["ktc_mpa", "krc_mpa", "kac_mpa"];
const EDGE: [&str; 3] = ["kte_n_per_mm", "kre_n_per_mm", "kae_n_per_mm"];

fn values(material: &Material) -> [f64; 6] {
    [
        material.ktc_mpa,
        material.krc_mpa,
        material.kac_mpa,
        material.kte_n_per_mm,
        material.kre_n_per_mm,
        material.kae_n_per_mm,
    ]
}

fn scaled(material: Material, factor: f64) -> Material {
    let [
        ktc_mpa,
        krc_mpa,
        kac_mpa,
        kte_n_per_mm,
        kre_n_per_mm,
        kae_n_per_mm,
    ] = values(&material).map(|value| factor * value);
    Material {
        ktc_mpa,
        krc_mpa,
        kac_mpa,
        kte_n_per_mm,
        kre_n_per_mm,
        kae_n_per_mm,
    }
}

impl Cause for CommonFactor {
    fn effect(&self) -> EffectName {
        EffectName::ForceCoefficients
    }

    fn names(&self) -> Vec<&'static str> {
        if self.with_edge {
            vec![EffectName::ForceCoefficients.name(), EffectName::EdgeForce.name()]
        } else {
            vec![EffectName::ForceCoefficients.name()]
        }
    }

    fn locations(&self, study: &Study<'_>) -> Vec<Location> {
        let has_edge = cutter(study).is_some_and(|cutter| values(&cutter.force.material())[3..] != [0.0; 3]);
        let known = self
            .names()
            .iter()
            .any(|name| study.baseline.case.extensions.contains_key(*name));
        if has_edge == self.with_edge && !known {
            everywhere(study, self.name())
        } else {
            Vec::new()
        }
    }

    fn regressors(&self, _: &Study<'_>, record: &Record, _: &Location, _: &[f64]) -> Regressors {
        Ok(vec![changed(
            record,
            |cutter| {
                let force = &mut cutter.force;
                *force = force.with_material(scaled(force.material(), 2.0));
            },
            1.0,
        )])
    }

    fn parameters(
        &self,
        study: &Study<'_>,
        _: &Location,
        _: &[f64],
        coefficients: &[f64],
    ) -> Option<Vec<Parameter>> {
        let factor = 1.0 + coefficients.first()?;
        let found = values(&scaled(cutter(study)?.force.material(), factor));
        let keys = CUTTING.into_iter().chain(EDGE).zip(found);
        (factor > 0.0).then(|| keys.take(if self.with_edge { 6 } else { 3 }).collect())
    }

    fn located_effects(&self, location: &Location, parameters: &[Parameter]) -> Vec<LocatedEffect> {
        self.names()
            .into_iter()
            .zip(parameters.chunks(3))
            .map(|(name, parameters)| LocatedEffect {
                name,
                location: location.clone(),
                parameters: parameters.to_vec(),
                extension: self.extension(location, parameters),
            })
            .collect()
    }
}
