//! A channel that reads g times the truth: y = g·y_t, so that y − ŷ = (1 − 1/g)·y.
//!
//! Shows: one factor at all frequencies and amplitudes, of one channel. Does not show: a phase, or anything in other channels. Of the
//! only channel under a measured force it is mass, damping and stiffness by one factor; of all channels of a steady cut without
//! measured force a factor of the cutting force; of one that is let go, where the start is not known, nothing.
//! Fit: linear in 1 − 1/g. Source: the calibration factor of ISO 16063.

use num_complex::Complex64;

use super::sensor::{in_cut, of_meant, one_or_all};
use crate::candidates::cause::{Cause, Location, Parameter, Regressor};
use crate::records::record::Record;
use crate::records::study::Study;
use quietcut_model::effects::EffectName;

pub(super) struct Gain;

/// The share 1 − 1/g beyond which nothing of the truth would be in a reading.
const LARGEST_SHARE: f64 = 0.98;

/// The share for which the chip of a cut is taken.
const SMALL_SHARE: f64 = 0.05;

/// g of the share 1 − 1/g.
pub(super) fn factor(coefficients: &[f64]) -> Option<f64> {
    let share = *coefficients.first()?;
    (share < LARGEST_SHARE).then(|| 1.0 / (1.0 - share))
}

impl Cause for Gain {
    fn effect(&self) -> EffectName {
        EffectName::SensorGain
    }

    fn locations(&self, study: &Study<'_>) -> Vec<Location> {
        one_or_all(study, self.name())
    }

    fn regressors(
        &self,
        _: &Study<'_>,
        record: &Record,
        location: &Location,
        _: &[f64],
    ) -> Option<Vec<Regressor>> {
        let read = of_meant(
            record,
            location,
            |channel| channel.pickup.weights,
            |_| Complex64::ONE,
        );
        // x = (1 − share)·y.
        Some(in_cut(record, location, read, SMALL_SHARE, |motion, axis| {
            let signals = motion.x[axis].iter_mut().chain(&mut motion.v[axis]);
            signals.for_each(|value| *value *= 1.0 - SMALL_SHARE);
        }))
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
