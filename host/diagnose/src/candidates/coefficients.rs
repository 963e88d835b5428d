//! Cutting or edge coefficients of the material that differ from those of the case. The cutting force F is linear in
//! each.

use super::process::{changed, cutter, everywhere, has_axial};
use crate::candidates::cause::{Cause, Location, Parameter, Regressors};
use crate::records::record::Record;
use crate::records::study::Study;
use quietcut_model::effects::EffectName;
use quietcut_model::milling::Material;
use quietcut_simulate::Cutter;

/// The cause that the tangential, radial and axial coefficients of the material, all cutting or all edge coefficients,
/// differ from the case.
pub(super) struct Coefficients {
    pub(super) effect: EffectName,
    pub(super) keys: [&'static str; 3],
    /// Returns the tangential, radial and axial coefficient (all cutting or all edge coefficients) of a material.
    pub(super) of: fn(&mut Material) -> [&mut f64; 3],
    /// Step of the finite difference of the cutting force with respect to one coefficient, in the unit of the
    /// coefficient.
    pub(super) step: fn(&Cutter) -> f64,
    /// True if a tangential coefficient of the given value is physically possible.
    pub(super) can_be: fn(f64) -> bool,
}

impl Cause for Coefficients {
    fn effect(&self) -> EffectName {
        self.effect
    }

    fn locations(&self, study: &Study<'_>) -> Vec<Location> {
        everywhere(study, self.name())
    }

    fn regressors(&self, study: &Study<'_>, record: &Record, _: &Location, _: &[f64]) -> Regressors {
        let step = (self.step)(cutter(study).ok_or("no record is of a cut")?);
        // The axial coefficient is fitted only if the structure has an axial direction.
        let count = if has_axial(study) { 3 } else { 2 };
        let with_more = |index: usize| {
            changed(
                record,
                |cutter| {
                    let mut material = cutter.force.material();
                    *(self.of)(&mut material)[index] += step;
                    cutter.force = cutter.force.with_material(material);
                },
                step,
            )
        };
        Ok((0..count).map(with_more).collect())
    }

    fn parameters(
        &self,
        study: &Study<'_>,
        _: &Location,
        _: &[f64],
        coefficients: &[f64],
    ) -> Option<Vec<Parameter>> {
        let mut material = cutter(study)?.force.material();
        let baseline = (self.of)(&mut material).map(|value| *value);
        let found: Vec<Parameter> = self
            .keys
            .into_iter()
            .zip(baseline)
            .zip(coefficients)
            .map(|((key, baseline), change)| (key, baseline + change))
            .collect();
        (self.can_be)(found.first()?.1).then_some(found)
    }
}
