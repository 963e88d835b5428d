//! The depth of cut follows the axial vibration, b = b₀ − z: it does, or it does not.
//!
//! Shows: forces in the rhythm of z, with edges that are not at 90°. Does not show: anything where z is stiff or the edge angle is 90°.
//! Fit: no parameter; the coefficient of the change must come out near 1. Source: thesis, eq. 3.5.

use super::process::{changed, everywhere, has_axial};
use crate::candidates::cause::{Cause, Location, Parameter, Regressor};
use crate::records::record::Record;
use crate::records::study::Study;
use quietcut_model::effects::EffectName;

pub(super) struct OfDepth;

/// How far from 1 the coefficient of what is there or not may be.
const ROUNDING: f64 = 0.35;

impl Cause for OfDepth {
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

    fn regressors(&self, _: &Study<'_>, record: &Record, _: &Location, _: &[f64]) -> Option<Vec<Regressor>> {
        Some(vec![changed(
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
        ((coefficients.first()? - 1.0).abs() < ROUNDING).then(Vec::new)
    }

    fn extension(&self, _: &Location, _: &[Parameter]) -> toml::Table {
        toml::Table::from_iter([("on".to_owned(), toml::Value::Boolean(true))])
    }
}
