//! A channel of motion that reads g times the true value: y = g·y_t, so that its residual is y − y_t = (1 − 1/g)·y.
//!
//! Shows: one factor at all frequencies and amplitudes, in one channel. Does not show: a phase shift, or anything in
//! other channels. Equivalent are: to a gain of the only channel of motion under a measured force, mass, damping and
//! stiffness changed by one factor; to one gain of all channels of a steady cut without measured force, a factor on the
//! cutting force. The gain of the only channel of a free decay has no effect, because the initial state is unknown.
//! Fit: linear in 1 − 1/g. Source: the calibration factor of ISO 16063.

use num_complex::Complex64;

use super::sensor::{one_or_all, readings_at, with_chip_of_true_motion};
use crate::candidates::cause::{Cause, Location, Parameter, Regressors};
use crate::criteria::LARGEST_GAIN_SHARE;
use crate::records::record::Record;
use crate::records::study::Study;
use quietcut_model::effects::EffectName;

pub(super) struct SensorGainCause;

/// Share 1 − 1/g of a sensor gain g at which the finite difference of the cutting force between measured and true
/// motion is taken.
const SMALL_SHARE: f64 = 0.05;

/// The sensor gain g from the fitted share 1 − 1/g; `None` if the share is not below [`LARGEST_GAIN_SHARE`].
pub(super) fn factor(coefficients: &[f64]) -> Option<f64> {
    let share = *coefficients.first()?;
    (share < LARGEST_GAIN_SHARE).then(|| 1.0 / (1.0 - share))
}

impl Cause for SensorGainCause {
    fn effect(&self) -> EffectName {
        EffectName::SensorGain
    }

    fn locations(&self, study: &Study<'_>) -> Vec<Location> {
        one_or_all(study, self.name())
    }

    fn regressors(&self, _: &Study<'_>, record: &Record, location: &Location, _: &[f64]) -> Regressors {
        let read = readings_at(
            record,
            location,
            |channel| channel.pickup.weights,
            |_| Complex64::ONE,
        );
        // A channel with the gain g reads y = g·x, so the true motion is x = (1 − share)·y with share = 1 − 1/g.
        Ok(with_chip_of_true_motion(
            record,
            location,
            read,
            SMALL_SHARE,
            |motion, axis| {
                let signals = motion.x[axis].iter_mut().chain(&mut motion.v[axis]);
                signals.for_each(|value| *value *= 1.0 - SMALL_SHARE);
            },
        ))
    }

    fn parameters(
        &self,
        _: &Study<'_>,
        _: &Location,
        _: &[f64],
        coefficients: &[f64],
    ) -> Option<Vec<Parameter>> {
        Some(vec![("gain", factor(coefficients)?)])
    }
}
