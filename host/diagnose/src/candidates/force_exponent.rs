//! The cutting force is not proportional to the chip thickness h: F = K·b·h₀·(h/h₀)^p with the axial depth b.
//!
//! Shows: at two feeds, or over the chip thicknesses of one tooth passing, a force that grows less (p < 1) or more
//! (p > 1) than in proportion to the chip thickness. Does not show: at one chip thickness, any difference from other
//! cutting coefficients. Source: Kienzle, VDI-Z 94 (1952).
//!
//! Fit: with a reference chip thickness h*, h₀·(h/h₀)^p = e^q·h*·(h/h*)^p with q = (1 − p)·ln(h₀/h*). The coefficients
//! are p − 1 and q. The regressors are finite differences, exact if p and q are the values at which they are computed.

use super::process::{added, changed, cutter, everywhere, step};
use crate::candidates::cause::{Cause, Location, Parameter, Regressors, WRONG_PARAMETERS};
use crate::criteria::CHIP_EXPONENT_CHANGE;
use crate::records::record::Record;
use crate::records::study::Study;
use quietcut_model::effects::EffectName;
use quietcut_simulate::ChipLaw;

pub(super) struct ForceExponent;

/// Smallest step, in magnitude, of the finite differences of the cutting force with respect to the parameters p − 1 and
/// q of the force law F = K·b·e^q·h*·(h/h*)^p.
const LEAST: f64 = 1e-3;

/// Reference chip thickness h*, m: half the feed per tooth of the first cut of the study; 1e-4 m without a cut.
fn reference_m(study: &Study<'_>) -> f64 {
    cutter(study).map_or(1e-4, |cutter| 0.5 * cutter.feed_per_tooth_m)
}

impl Cause for ForceExponent {
    fn effect(&self) -> EffectName {
        EffectName::ForceExponent
    }

    fn locations(&self, study: &Study<'_>) -> Vec<Location> {
        everywhere(study, self.name())
    }

    fn nonlinear_grid(&self, _: &Study<'_>, _: &Location) -> Vec<Vec<f64>> {
        [0.6, 0.8, 1.0, 1.2].map(|exponent| vec![exponent, 0.0]).to_vec()
    }

    fn regressors(
        &self,
        study: &Study<'_>,
        record: &Record,
        _: &Location,
        nonlinear_parameters: &[f64],
    ) -> Regressors {
        let &[exponent, q] = nonlinear_parameters else {
            return Err(WRONG_PARAMETERS.into());
        };
        let less = step(exponent - 1.0, LEAST);
        let h = reference_m(study);
        let law = move |q: f64| ChipLaw {
            exponent: 1.0 + less,
            reference_m: h * (-q / less).exp(),
        };
        let q_step = step(q, LEAST);
        Ok(vec![
            changed(record, |cutter| cutter.force.chip = Some(law(0.0)), less),
            added(
                record,
                |cutter| cutter.force.chip = Some(law(0.0)),
                |cutter| cutter.force.chip = Some(law(q_step)),
                q_step,
            ),
        ])
    }

    fn settled(&self, _: &[f64], coefficients: &[f64]) -> Option<Vec<f64>> {
        let (less, q) = (*coefficients.first()?, *coefficients.get(1)?);
        Some(vec![
            1.0 + less.clamp(CHIP_EXPONENT_CHANGE[0], CHIP_EXPONENT_CHANGE[1]),
            q.clamp(-1.0, 1.0),
        ])
    }

    fn parameters(
        &self,
        study: &Study<'_>,
        _: &Location,
        _: &[f64],
        coefficients: &[f64],
    ) -> Option<Vec<Parameter>> {
        let &[less, q] = coefficients else { return None };
        let reference_mm = 1e3 * reference_m(study) * (-q / less).exp();
        let [least, largest] = CHIP_EXPONENT_CHANGE;
        let physical = less > least && less < largest && reference_mm.is_finite() && reference_mm > 0.0;
        physical.then(|| vec![("exponent", 1.0 + less), ("reference_chip_mm", reference_mm)])
    }
}
