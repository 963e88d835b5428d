//! The axial depth b of a cut follows the axial vibration z of the tool, b = b₀ − z. The effect is on or off and has no
//! magnitude.
//!
//! Shows: cutting forces that vary with z. Does not show: anything if the tool does not vibrate along z, as on a
//! structure that is stiff along z. Fit: one coefficient of the regressor, which is 1 if the effect exists; no reported
//! parameter. Source: thesis, eq. 3.5.

use super::process::{changed, everywhere, has_axial};
use crate::candidates::cause::{Cause, Location, Parameter, Regressors};
use crate::criteria::AXIAL_DEPTH_COEFFICIENT_ERROR;
use crate::records::record::Record;
use crate::records::study::Study;
use quietcut_model::effects::EffectName;

pub(super) struct AxialDepthModulationCause;

impl Cause for AxialDepthModulationCause {
    fn effect(&self) -> EffectName {
        EffectName::AxialDepthModulation
    }

    fn locations(&self, study: &Study<'_>) -> Vec<Location> {
        if has_axial(study) {
            everywhere(study, self.name())
        } else {
            Vec::new()
        }
    }

    fn regressors(&self, _: &Study<'_>, record: &Record, _: &Location, _: &[f64]) -> Regressors {
        Ok(vec![changed(
            record,
            |cutter| cutter.axial_depth_modulation = true,
            1.0,
        )])
    }

    fn parameters(
        &self,
        _: &Study<'_>,
        _: &Location,
        _: &[f64],
        coefficients: &[f64],
    ) -> Option<Vec<Parameter>> {
        ((coefficients.first()? - 1.0).abs() < AXIAL_DEPTH_COEFFICIENT_ERROR).then(Vec::new)
    }

    fn extension(&self, _: &Location, _: &[Parameter]) -> toml::Table {
        toml::Table::from_iter([("on".to_owned(), toml::Value::Boolean(true))])
    }
}
