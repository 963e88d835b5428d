//! A channel of motion that is late by τ: y(t) = y_t(t − τ) with the true value y_t, so that its residual is y(t) −
//! y(t + τ), which is −τ·ẏ for a short delay.
//!
//! Shows: a phase proportional to frequency over a band. Does not show: a change of amplitude; in a narrow band it is
//! equivalent to damping. Without a known force or another channel as reference the delay is not identifiable. Fit: τ
//! is a nonlinear parameter; the regressor is exact for delays of any length. Source: McConnell and Varoto, Vibration
//! Testing (2008).

use num_complex::Complex64;

use super::sensor::{is_at, one_or_all, reading_in_cut, readings_at, with_chip_of_true_motion};
use crate::candidates::cause::{Cause, Location, Parameter, Regressor, Regressors, WRONG_PARAMETERS};
use crate::criteria::ANOTHER_DELAY;
use crate::records::record::Record;
use crate::records::study::Study;
use quietcut_model::effects::EffectName;

pub(super) struct SensorDelayCause;

/// Longest sensor delay that the fit allows, in periods of the highest frequency of the measured motion.
const LONGEST: f64 = 0.4;

impl Cause for SensorDelayCause {
    fn effect(&self) -> EffectName {
        EffectName::SensorDelay
    }

    fn locations(&self, study: &Study<'_>) -> Vec<Location> {
        one_or_all(study, self.name())
    }

    fn nonlinear_grid(&self, study: &Study<'_>, location: &Location) -> Vec<Vec<f64>> {
        let [[_, longest]] = self.bounds(study, location)[..] else {
            return Vec::new();
        };
        [0.01, 0.3, 1.0].map(|share| vec![share * longest]).to_vec()
    }

    fn bounds(&self, study: &Study<'_>, _: &Location) -> Vec<[f64; 2]> {
        let highest = study
            .records
            .iter()
            .map(|record| record.highest_hz)
            .fold(1e-9, f64::max);
        vec![[1e-5 / highest, LONGEST / highest]]
    }

    fn regressors(
        &self,
        _: &Study<'_>,
        record: &Record,
        location: &Location,
        nonlinear_parameters: &[f64],
    ) -> Regressors {
        let delay = *nonlinear_parameters.first().ok_or(WRONG_PARAMETERS)?;
        // The regressor of a sensor delay τ is (1 − e^(iωτ))/τ times the spectrum of the reading, so that its
        // coefficient is the delay in seconds.
        let change = |omega: f64| (Complex64::ONE - Complex64::cis(omega * delay)) / delay;
        let read = if record.cut.is_some() {
            let of = |channel: usize| {
                if is_at(location, &record.channels[channel]) {
                    reading_in_cut(record, channel, change)
                } else {
                    Some(Vec::new())
                }
            };
            vec![Regressor::of_channels(
                (0..record.channels.len())
                    .map(of)
                    .collect::<Option<_>>()
                    .ok_or("no record is of a cut")?,
            )]
        } else {
            readings_at(record, location, |channel| channel.pickup.weights, change)
        };
        // A late channel reads y(t) = x(t − τ), so the true motion is x(t) = y(t + τ).
        Ok(with_chip_of_true_motion(
            record,
            location,
            read,
            delay,
            |motion, axis| {
                motion.advance(axis, delay);
            },
        ))
    }

    /// The fitted sensor delay, s, as new nonlinear parameter, because the regressor is exact at the delay for which it
    /// is computed. `None` if the fitted delay is not positive.
    fn settled(&self, _: &[f64], coefficients: &[f64]) -> Option<Vec<f64>> {
        coefficients
            .first()
            .filter(|delay| **delay > 0.0)
            .map(|delay| vec![*delay])
    }

    /// The fitted sensor delay, s. `None` if it is not positive, or differs by a factor of at least [`ANOTHER_DELAY`]
    /// from the delay for which the regressor is computed.
    fn parameters(
        &self,
        _: &Study<'_>,
        _: &Location,
        nonlinear_parameters: &[f64],
        coefficients: &[f64],
    ) -> Option<Vec<Parameter>> {
        let (delay, made_for) = (*coefficients.first()?, *nonlinear_parameters.first()?);
        (delay > made_for / ANOTHER_DELAY && delay < made_for * ANOTHER_DELAY)
            .then(|| vec![("delay_s", delay)])
    }
}
