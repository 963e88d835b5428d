//! The edge coefficients K_te, K_re, K_ae differ from those of the case: F is linear in them.

use super::{changed, cutter, everywhere, has_axial};
use crate::diagnose::cause::{Cause, Parameter, Place, Regressor};
use crate::diagnose::record::Record;
use crate::diagnose::scene::Scene;
use crate::milling::Material;

pub(super) struct EdgeForce;

const KEYS: [&str; 3] = ["kte_n_per_mm", "kre_n_per_mm", "kae_n_per_mm"];

fn of(material: &mut Material) -> [&mut f64; 3] {
    [
        &mut material.kte_n_per_mm,
        &mut material.kre_n_per_mm,
        &mut material.kae_n_per_mm,
    ]
}

/// The axial coefficient acts where there is an axial direction.
fn count(scene: &Scene<'_>) -> usize {
    if has_axial(scene) { 3 } else { 2 }
}

impl Cause for EdgeForce {
    fn name(&self) -> &'static str {
        "edge-force"
    }

    fn places(&self, scene: &Scene<'_>) -> Vec<Place> {
        everywhere(scene, self.name())
    }

    fn regressors(&self, scene: &Scene<'_>, record: &Record, _: &Place, _: &[f64]) -> Option<Vec<Regressor>> {
        Some(
            (0..count(scene))
                .map(|index| {
                    // Per N/mm, over a step as large as the cutting force of the feed.
                    let largest = cutter(scene).map_or(1.0, |cutter| {
                        (1e3 * cutter.feed_per_tooth_m * cutter.force.material().ktc_mpa)
                            .abs()
                            .max(1e-3)
                    });
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
        Some(
            KEYS.into_iter()
                .zip(believed)
                .zip(coefficients)
                .map(|((key, believed), change)| (key, believed + change))
                .collect(),
        )
    }
}
