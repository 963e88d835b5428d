//! Sensors that do not read the truth. With y_t the truth, along the measured motion:
//!
//! - gain: y = g·y_t, so that y − ŷ = (1 − 1/g)·y;
//! - delay: y(t) = y_t(t − τ), so that y − ŷ = y(t) − y(t + τ), which is −τ·ẏ while the delay is short;
//! - cross-axis: y = y_t + p·(the other direction).

use num_complex::Complex64;

use crate::diagnose::cause::{Cause, Parameter, Place, Regressor};
use crate::diagnose::record::{Observed, Record};
use crate::diagnose::scene::{Domain, Scene};
use crate::recording::Quantity;

pub(super) fn all() -> Vec<Box<dyn Cause>> {
    vec![
        Box::new(Gain),
        Box::new(Delay),
        Box::new(CrossAxis),
        Box::new(Offset),
    ]
}

struct Gain;
struct Delay;
struct CrossAxis;
struct Offset;

/// Names of the channels of motion, where all records are predicted from their force.
fn channels(scene: &Scene<'_>) -> Vec<String> {
    if !scene.all_in(Domain::Response) {
        return Vec::new();
    }
    let mut names: Vec<String> = Vec::new();
    for channel in scene.records.iter().flat_map(|record| &record.channels) {
        if channel.pickup.quantity != Quantity::Force && !names.contains(&channel.pickup.name) {
            names.push(channel.pickup.name.clone());
        }
    }
    names
}

/// A place for each channel, and where there are several, one for all of them together.
fn one_or_all(scene: &Scene<'_>, name: &str) -> Vec<Place> {
    if scene.baseline.case.extensions.contains_key(name) {
        return Vec::new();
    }
    let names = channels(scene);
    // Without a motion that a force drives, nothing says how large it should be.
    let free = scene
        .records
        .iter()
        .all(|record| record.force_n.iter().all(Vec::is_empty));
    if free {
        return Vec::new();
    }
    let several = names.len() > 1;
    let mut places: Vec<Place> = names.into_iter().map(Place::Channel).collect();
    if several {
        places.push(Place::Everywhere);
    }
    places
}

fn meant(place: &Place, channel: &Observed) -> bool {
    match place.channel() {
        Some(name) => channel.pickup.name == name,
        None => channel.pickup.quantity != Quantity::Force,
    }
}

/// What the channel reads of the motion as it is known, with the spectrum turned by `change` of ω.
fn read(
    record: &Record,
    channel: &Observed,
    weights: [f64; 3],
    change: impl Fn(f64) -> Complex64,
) -> Vec<f64> {
    let spectrum: Vec<Complex64> = (0..record.grid.bins())
        .map(|bin| {
            let sum: Complex64 = record
                .displacement
                .iter()
                .zip(weights)
                .filter(|(displacement, _)| !displacement.is_empty())
                .map(|(displacement, weight)| displacement[bin] * weight)
                .sum();
            sum * record.factor(channel, bin) * change(record.grid.omega(bin))
        })
        .collect();
    record.grid.samples(&spectrum)
}

fn by_channel(record: &Record, of: impl Fn(&Observed) -> Vec<f64>) -> Option<Vec<Regressor>> {
    Some(vec![Regressor::of_channels(
        record.channels.iter().map(of).collect(),
    )])
}

impl Cause for Gain {
    fn name(&self) -> &'static str {
        "sensor-gain"
    }

    fn places(&self, scene: &Scene<'_>) -> Vec<Place> {
        one_or_all(scene, self.name())
    }

    fn regressors(&self, _: &Scene<'_>, record: &Record, place: &Place, _: &[f64]) -> Option<Vec<Regressor>> {
        by_channel(record, |channel| {
            if meant(place, channel) {
                read(record, channel, channel.pickup.weights, |_| Complex64::ONE)
            } else {
                Vec::new()
            }
        })
    }

    fn parameters(
        &self,
        _: &Scene<'_>,
        _: &Place,
        _: &[f64],
        coefficients: &[f64],
    ) -> Option<Vec<Parameter>> {
        let share = *coefficients.first()?;
        (share < 0.98).then(|| vec![("gain", 1.0 / (1.0 - share))])
    }
}

/// Delays up to this share of the period of the highest frequency are looked for.
const LONGEST: f64 = 0.4;

impl Cause for Delay {
    fn name(&self) -> &'static str {
        "sensor-delay"
    }

    fn places(&self, scene: &Scene<'_>) -> Vec<Place> {
        one_or_all(scene, self.name())
    }

    fn shapes(&self, scene: &Scene<'_>, place: &Place) -> Vec<Vec<f64>> {
        let [[_, longest]] = self.bounds(scene, place)[..] else {
            return Vec::new();
        };
        [0.01, 0.3, 1.0].map(|share| vec![share * longest]).to_vec()
    }

    fn bounds(&self, scene: &Scene<'_>, _: &Place) -> Vec<[f64; 2]> {
        let highest = scene
            .records
            .iter()
            .map(|record| record.highest_hz)
            .fold(1e-9, f64::max);
        vec![[1e-5 / highest, LONGEST / highest]]
    }

    fn regressors(
        &self,
        _: &Scene<'_>,
        record: &Record,
        place: &Place,
        shape: &[f64],
    ) -> Option<Vec<Regressor>> {
        let delay = *shape.first()?;
        by_channel(record, |channel| {
            if meant(place, channel) {
                // Per second of delay, so that the coefficient is the delay.
                read(record, channel, channel.pickup.weights, |omega| {
                    (Complex64::ONE - Complex64::cis(omega * delay)) / delay
                })
            } else {
                Vec::new()
            }
        })
    }

    /// The regressor is exact at the delay that it was made for.
    fn settled(&self, _: &[f64], coefficients: &[f64]) -> Option<Vec<f64>> {
        coefficients
            .first()
            .filter(|delay| **delay > 0.0)
            .map(|delay| vec![*delay])
    }

    fn parameters(
        &self,
        _: &Scene<'_>,
        _: &Place,
        _: &[f64],
        coefficients: &[f64],
    ) -> Option<Vec<Parameter>> {
        let delay = *coefficients.first()?;
        (delay > 0.0).then(|| vec![("delay_s", delay)])
    }
}

impl Cause for CrossAxis {
    fn name(&self) -> &'static str {
        "cross-axis"
    }

    fn places(&self, scene: &Scene<'_>) -> Vec<Place> {
        if scene.baseline.case.extensions.contains_key(self.name()) {
            return Vec::new();
        }
        let axes = scene.driven_axes();
        let mut places = Vec::new();
        for name in channels(scene) {
            let Some(pickup) = scene.baseline.pickup(&name) else {
                continue;
            };
            for &axis in axes.iter().filter(|axis| pickup.weights[**axis] == 0.0) {
                places.push(Place::ChannelFrom(name.clone(), axis));
            }
        }
        places
    }

    fn regressors(&self, _: &Scene<'_>, record: &Record, place: &Place, _: &[f64]) -> Option<Vec<Regressor>> {
        let Place::ChannelFrom(_, axis) = place else {
            return None;
        };
        let mut weights = [0.0; 3];
        weights[*axis] = 1.0;
        by_channel(record, |channel| {
            if meant(place, channel) {
                read(record, channel, weights, |_| Complex64::ONE)
            } else {
                Vec::new()
            }
        })
    }

    fn parameters(
        &self,
        _: &Scene<'_>,
        _: &Place,
        _: &[f64],
        coefficients: &[f64],
    ) -> Option<Vec<Parameter>> {
        coefficients.first().map(|fraction| vec![("fraction", *fraction)])
    }
}

/// The same in a sensor's reading as a gain of its channel; where the sidecar says that the sensor sits elsewhere, it is
/// what a gain means there.
impl Cause for Offset {
    fn name(&self) -> &'static str {
        "sensor-offset-from-tool-tip"
    }

    fn places(&self, scene: &Scene<'_>) -> Vec<Place> {
        one_or_all(scene, self.name())
            .into_iter()
            .filter(|place| scene.sits_elsewhere(place.channel()))
            .collect()
    }

    fn regressors(
        &self,
        scene: &Scene<'_>,
        record: &Record,
        place: &Place,
        shape: &[f64],
    ) -> Option<Vec<Regressor>> {
        Gain.regressors(scene, record, place, shape)
    }

    fn parameters(
        &self,
        _: &Scene<'_>,
        _: &Place,
        _: &[f64],
        coefficients: &[f64],
    ) -> Option<Vec<Parameter>> {
        let share = *coefficients.first()?;
        (share < 0.98).then(|| vec![("ratio", 1.0 / (1.0 - share))])
    }
}
