//! A channel of motion that also reads the motion along another axis: y = y_t + p·(motion along the other axis), y_t
//! the true value.
//!
//! Shows: the motion along the other axis without delay or phase, also if only that axis is driven. Does not show:
//! anything if the other axis is at rest. Unlike a cross receptance, it is not reciprocal. Fit: linear in p. Source:
//! transverse sensitivity as in McConnell and Varoto, Vibration Testing (2008).

use num_complex::Complex64;

use super::sensor::{channels, readings_at, with_chip_of_true_motion};
use crate::candidates::cause::{Cause, Location, Parameter, Regressors, WRONG_LOCATION};
use crate::records::record::Record;
use crate::records::study::Study;
use quietcut_model::effects::EffectName;

pub(super) struct CrossAxis;

/// Cross-axis fraction p at which the finite difference of the cutting force between measured and true motion is taken.
const SMALL_FRACTION: f64 = 0.05;

impl Cause for CrossAxis {
    fn effect(&self) -> EffectName {
        EffectName::CrossAxis
    }

    fn locations(&self, study: &Study<'_>) -> Vec<Location> {
        if study.baseline.case.extensions.contains_key(self.name()) {
            return Vec::new();
        }
        let axes = study.driven_axes();
        let mut locations = Vec::new();
        for name in channels(study) {
            let Some(pickup) = study.baseline.pickup(&name) else {
                continue;
            };
            for &axis in axes.iter().filter(|axis| pickup.weights[**axis] == 0.0) {
                locations.push(Location::ChannelFrom(name.clone(), axis));
            }
        }
        locations
    }

    fn regressors(&self, _: &Study<'_>, record: &Record, location: &Location, _: &[f64]) -> Regressors {
        let Location::ChannelFrom(_, axis) = location else {
            return Err(WRONG_LOCATION.into());
        };
        let mut weights = [0.0; 3];
        weights[*axis] = 1.0;
        let read = readings_at(record, location, |_| weights, |_| Complex64::ONE);
        let other = record.motion.clone();
        // A channel reads y = x + p·(motion along the other axis), so the true motion is x = y − p·(motion along the
        // other axis).
        Ok(with_chip_of_true_motion(
            record,
            location,
            read,
            SMALL_FRACTION,
            |motion, to| {
                for (to, from) in [
                    (&mut motion.x[to], &other.x[*axis]),
                    (&mut motion.v[to], &other.v[*axis]),
                ] {
                    to.iter_mut()
                        .zip(from)
                        .for_each(|(to, from)| *to -= SMALL_FRACTION * from);
                }
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
        coefficients.first().map(|fraction| vec![("fraction", *fraction)])
    }
}
