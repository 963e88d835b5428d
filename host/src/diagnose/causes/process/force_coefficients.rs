//! The cutting coefficients K_tc, K_rc, K_ac differ from those of the case: F is linear in them.

use super::{changed, cutter, everywhere, has_axial};
use crate::diagnose::cause::{Cause, Parameter, Place, Regressor};
use crate::diagnose::record::Record;
use crate::diagnose::scene::Scene;
use crate::milling::Material;

pub(super) struct ForceCoefficients;

const KEYS: [&str; 3] = ["ktc_mpa", "krc_mpa", "kac_mpa"];

fn of(material: &mut Material) -> [&mut f64; 3] {
    [
        &mut material.ktc_mpa,
        &mut material.krc_mpa,
        &mut material.kac_mpa,
    ]
}

/// The axial coefficient acts where there is an axial direction.
fn count(scene: &Scene<'_>) -> usize {
    if has_axial(scene) { 3 } else { 2 }
}

impl Cause for ForceCoefficients {
    fn name(&self) -> &'static str {
        "force-coefficients"
    }

    fn places(&self, scene: &Scene<'_>) -> Vec<Place> {
        everywhere(scene, self.name())
    }

    fn regressors(&self, scene: &Scene<'_>, record: &Record, _: &Place, _: &[f64]) -> Option<Vec<Regressor>> {
        Some(
            (0..count(scene))
                .map(|index| {
                    // Per MPa, over a step as large as the coefficients are.
                    let largest =
                        cutter(scene).map_or(1.0, |cutter| cutter.force.material().ktc_mpa.abs().max(1.0));
                    changed(
                        record,
                        |variation| {
                            let mut material = variation.cutter.force.material();
                            *of(&mut material)[index] += largest;
                            variation.cutter.force = variation.cutter.force.with_material(material);
                        },
                        largest,
                    )
                })
                .collect(),
        )
    }

    fn parameters(
        &self,
        scene: &Scene<'_>,
        _: &Place,
        _: &[f64],
        coefficients: &[f64],
    ) -> Option<Vec<Parameter>> {
        let mut material = cutter(scene)?.force.material();
        let believed = of(&mut material).map(|value| *value);
        let found: Vec<Parameter> = KEYS
            .into_iter()
            .zip(believed)
            .zip(coefficients)
            .map(|((key, believed), change)| (key, believed + change))
            .collect();
        // A chip pushes against the turning.
        (found.first()?.1 > 0.0).then_some(found)
    }
}
