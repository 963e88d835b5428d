//! The edge wears: all cutting forces grow with the time t since the start of the recording by the factor 1 + r·t.
//!
//! Shows: all tooth-passing lines grow by the same factor along the record. Does not show: changes of frequency. A
//! drift of the gain of all channels is equivalent. Fit: linear in r. Source: Altintas, Manufacturing Automation
//! (2012), ch. 2 (forces over flank wear).

use super::process::{changed, everywhere};
use crate::candidates::cause::{Cause, Location, Parameter, Regressors};
use crate::records::record::Record;
use crate::records::study::Study;
use quietcut_model::effects::EffectName;

pub(super) struct WearCause;

impl Cause for WearCause {
    fn effect(&self) -> EffectName {
        EffectName::Wear
    }

    fn locations(&self, study: &Study<'_>) -> Vec<Location> {
        everywhere(study, self.name())
    }

    fn regressors(&self, _: &Study<'_>, record: &Record, _: &Location, _: &[f64]) -> Regressors {
        Ok(vec![changed(
            record,
            |cutter| cutter.force.wear_per_s += 1.0,
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
        coefficients
            .first()
            .map(|rate| vec![("relative_rate_per_s", *rate)])
    }
}
