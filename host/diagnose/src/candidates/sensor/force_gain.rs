//! Sensors of the cutting force that read g times the truth: y = g·F, so that y − ŷ = (g − 1)·F along the measured motion.
//!
//! Shows: one factor of measured forces at all orders of the tooth passage, of one sensor or of a dynamometer as a whole, while the
//! motion is what the case makes of it. Does not show: anything in the motion; cutting coefficients that differ move the tool as well.
//! Where a measured force drives the structure, a gain of its sensor is one of all channels of motion.
//! Fit: linear in g − 1. Source: the calibration factor of ISO 16063; Altintas, Manufacturing Automation (2012), ch. 2, for what a
//! dynamometer tells of a cut.

use crate::candidates::cause::{Cause, Parameter, Part, Place, Regressor};
use crate::records::record::Record;
use crate::records::study::Scene;
use quietcut_recording::Quantity;

pub(super) struct ForceGain;

/// The least g: below it nothing of the force would be in a reading.
const LEAST: f64 = 0.02;

/// The channels that a place means.
fn names(place: &Place) -> &[String] {
    match place {
        Place::Channel(name) => std::slice::from_ref(name),
        Place::Channels(names) => names,
        _ => &[],
    }
}

impl Cause for ForceGain {
    fn name(&self) -> &'static str {
        "sensor-gain"
    }

    fn places(&self, scene: &Scene<'_>) -> Vec<Place> {
        let all_cuts = scene.records.iter().all(|record| record.cut.is_some());
        if !all_cuts || scene.baseline.case.extensions.contains_key(self.name()) {
            return Vec::new();
        }
        let mut names: Vec<String> = Vec::new();
        for channel in scene.records.iter().flat_map(|record| &record.channels) {
            if channel.pickup.quantity == Quantity::Force && !names.contains(&channel.pickup.name) {
                names.push(channel.pickup.name.clone());
            }
        }
        let together = (names.len() > 1).then(|| Place::Channels(names.clone()));
        names.into_iter().map(Place::Channel).chain(together).collect()
    }

    fn regressors(&self, _: &Scene<'_>, record: &Record, place: &Place, _: &[f64]) -> Option<Vec<Regressor>> {
        let of = |index: usize| {
            let channel = &record.channels[index];
            if !names(place).contains(&channel.pickup.name) {
                return Vec::new();
            }
            let mut force = channel.predicted.clone();
            // What is not compared is taken as measured there.
            for &sample in &record.skipped[index] {
                force[sample] = 0.0;
            }
            force
        };
        let observed = (0..record.channels.len()).map(of).collect();
        Some(vec![Regressor::of_channels(observed)])
    }

    fn parameters(
        &self,
        _: &Scene<'_>,
        _: &Place,
        _: &[f64],
        coefficients: &[f64],
    ) -> Option<Vec<Parameter>> {
        let gain = 1.0 + *coefficients.first()?;
        (gain > LEAST).then(|| vec![("gain", gain)])
    }

    fn parts(&self, place: &Place, parameters: &[Parameter]) -> Vec<Part> {
        names(place)
            .iter()
            .map(|name| {
                let place = Place::Channel(name.clone());
                Part {
                    name: self.name(),
                    extension: self.extension(&place, parameters),
                    place,
                    parameters: parameters.to_vec(),
                }
            })
            .collect()
    }
}
