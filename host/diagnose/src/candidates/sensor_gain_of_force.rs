//! Force sensors in a cut that read g times the cutting force: y = g·F, so that the residual of their channels is (g −
//! 1)·F, with the force F that the baseline predicts along the measured motion.
//!
//! Shows: one factor on the measured forces of one sensor or of a whole dynamometer at all tooth-passing harmonics,
//! while the motion agrees with the baseline. Does not show: anything in the motion, whereas other cutting coefficients
//! also change the motion. If a measured force drives the structure, the gain of its sensor is equivalent to one gain
//! of all channels of motion. Fit: linear in g − 1. Source: the calibration factor of ISO 16063; Altintas,
//! Manufacturing Automation (2012), ch. 2, for dynamometers in cuts.

use crate::candidates::cause::{Cause, LocatedEffect, Location, Parameter, Regressor, Regressors};
use crate::criteria::LEAST_FORCE_GAIN;
use crate::records::record::Record;
use crate::records::study::Study;
use quietcut_model::effects::EffectName;
use quietcut_recording::Quantity;

pub(super) struct ForceSensorGainCause;

/// Names of the channels of force at the location of a sensor error; empty if the location is no channel.
fn names(location: &Location) -> &[String] {
    match location {
        Location::Channel(name) => std::slice::from_ref(name),
        Location::Channels(names) => names,
        _ => &[],
    }
}

impl Cause for ForceSensorGainCause {
    fn effect(&self) -> EffectName {
        EffectName::SensorGain
    }

    fn locations(&self, study: &Study<'_>) -> Vec<Location> {
        let all_cuts = study.records.iter().all(|record| record.cut.is_some());
        if !all_cuts || study.baseline.case.extensions.contains_key(self.name()) {
            return Vec::new();
        }
        let mut names: Vec<String> = Vec::new();
        for channel in study.records.iter().flat_map(|record| &record.channels) {
            if channel.pickup.quantity == Quantity::Force && !names.contains(&channel.pickup.name) {
                names.push(channel.pickup.name.clone());
            }
        }
        let together = (names.len() > 1).then(|| Location::Channels(names.clone()));
        names.into_iter().map(Location::Channel).chain(together).collect()
    }

    fn regressors(&self, _: &Study<'_>, record: &Record, location: &Location, _: &[f64]) -> Regressors {
        let of = |index: usize| {
            let channel = &record.channels[index];
            if !names(location).contains(&channel.pickup.name) {
                return Vec::new();
            }
            let mut force = channel.predicted.clone();
            // Samples that are not compared have no residual, so the regressor of the force sensor's gain is zero
            // there.
            for &sample in &record.skipped[index] {
                force[sample] = 0.0;
            }
            force
        };
        let observed = (0..record.channels.len()).map(of).collect();
        Ok(vec![Regressor::of_channels(observed)])
    }

    fn parameters(
        &self,
        _: &Study<'_>,
        _: &Location,
        _: &[f64],
        coefficients: &[f64],
    ) -> Option<Vec<Parameter>> {
        let gain = 1.0 + *coefficients.first()?;
        (gain > LEAST_FORCE_GAIN).then(|| vec![("gain", gain)])
    }

    fn located_effects(&self, location: &Location, parameters: &[Parameter]) -> Vec<LocatedEffect> {
        names(location)
            .iter()
            .map(|name| {
                let location = Location::Channel(name.clone());
                LocatedEffect {
                    name: self.name(),
                    extension: self.extension(&location, parameters),
                    location,
                    parameters: parameters.to_vec(),
                }
            })
            .collect()
    }
}
