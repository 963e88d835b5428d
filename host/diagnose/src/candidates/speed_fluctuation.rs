//! The spindle speed varies periodically: Ω = Ω₀(1 + δ·sin(2πf_m t + ψ)).
//!
//! Shows: a modulation of the tachometer signal, and sidebands at ±f_m of the tooth-passing lines. Does not show:
//! without a tachometer, any difference from drift of the structure. Source: Sexton, Milne and Stone (1977); Insperger
//! and Stépán, J. Vib. Control 10 (2004).
//!
//! Fit: δ, f_m and ψ are fitted to the tachometer edges, with f_m up to 0.45 times the lowest spindle frequency. The
//! regressor is the difference between the cutting force with this modulation and the force at constant speed. Its
//! coefficient is 1 if the records confirm the modulation; the reported amplitude is that of the tachometer.

use super::process::everywhere;
use crate::candidates::cause::{Cause, Location, Parameter, Regressor, Regressors, WRONG_PARAMETERS};
use crate::criteria::SPEED_MODULATION_COEFFICIENT_ERROR;
use crate::motion::spindle_motion::{SpeedModulation, SpindleMotion, speed_modulation};
use crate::records::record::Record;
use crate::records::study::Study;
use quietcut_model::effects::EffectName;
use quietcut_simulate::Fluctuation;

pub(super) struct SpeedFluctuationCause;

/// The speed modulation in the tachometer signals of all cuts of the study; `None` if there is none.
fn of_tachometer(study: &Study<'_>) -> Option<SpeedModulation> {
    let spindle_motions: Vec<&SpindleMotion> = study
        .records
        .iter()
        .filter_map(|record| Some(&record.cut.as_ref()?.cut.spindle_motion))
        .collect();
    speed_modulation(&spindle_motions)
}

impl Cause for SpeedFluctuationCause {
    fn effect(&self) -> EffectName {
        EffectName::SpeedFluctuation
    }

    fn locations(&self, study: &Study<'_>) -> Vec<Location> {
        everywhere(study, self.name())
    }

    fn nonlinear_grid(&self, study: &Study<'_>, _: &Location) -> Vec<Vec<f64>> {
        let nonlinear_parameters = |found: SpeedModulation| {
            let Fluctuation {
                delta,
                frequency_hz,
                phase_rad,
            } = found.fluctuation;
            vec![frequency_hz, delta, phase_rad]
        };
        of_tachometer(study)
            .map(nonlinear_parameters)
            .into_iter()
            .collect()
    }

    fn regressors(
        &self,
        _: &Study<'_>,
        record: &Record,
        _: &Location,
        nonlinear_parameters: &[f64],
    ) -> Regressors {
        let &[frequency_hz, delta, phase_rad] = nonlinear_parameters else {
            return Err(WRONG_PARAMETERS.into());
        };
        let fluctuation = Fluctuation {
            delta,
            frequency_hz,
            phase_rad,
        };
        let Some(cut) = &record.cut else {
            return Ok(vec![Regressor::default()]);
        };
        let spindle_motion = cut.cut.spindle_motion.with(fluctuation);
        let force = cut.force_along(&spindle_motion, &record.motion);
        Ok(vec![Regressor::of_cut(force.difference(&cut.force, 1.0))])
    }

    /// The nonlinear parameters of the speed modulation (frequency, amplitude, phase) come from the tachometer, not
    /// from the fit.
    fn settled(&self, nonlinear_parameters: &[f64], _: &[f64]) -> Option<Vec<f64>> {
        Some(nonlinear_parameters.to_vec())
    }

    fn parameters(
        &self,
        _: &Study<'_>,
        _: &Location,
        nonlinear_parameters: &[f64],
        coefficients: &[f64],
    ) -> Option<Vec<Parameter>> {
        let &[frequency_hz, delta, phase_rad] = nonlinear_parameters else {
            return None;
        };
        let share = *coefficients.first()?;
        ((share - 1.0).abs() < SPEED_MODULATION_COEFFICIENT_ERROR).then(|| {
            vec![
                ("delta", delta),
                ("frequency_hz", frequency_hz),
                ("phase_deg", phase_rad.to_degrees()),
            ]
        })
    }

    fn known_deviations(&self, study: &Study<'_>) -> Vec<Parameter> {
        let Some(SpeedModulation {
            deviation: [delta, frequency_hz, phase_rad],
            ..
        }) = of_tachometer(study)
        else {
            return Vec::new();
        };
        vec![
            ("delta", delta),
            ("frequency_hz", frequency_hz),
            ("phase_deg", phase_rad.to_degrees()),
        ]
    }
}
