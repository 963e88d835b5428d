//! Sensors that do not read the truth; y_t is the truth, along the measured motion.

mod cross_axis;
mod delay;
mod gain;
mod offset;

use num_complex::Complex64;

use crate::diagnose::cause::{Cause, Place, Regressor};
use crate::diagnose::record::{Observed, Record};
use crate::diagnose::scene::{Domain, Scene};
use crate::recording::Quantity;

pub(super) fn all() -> Vec<Box<dyn Cause>> {
    vec![
        Box::new(gain::Gain),
        Box::new(delay::Delay),
        Box::new(cross_axis::CrossAxis),
        Box::new(offset::Offset),
    ]
}

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

/// What the channels that are meant read with the spectrum turned by `change` of ω.
fn of_meant(
    record: &Record,
    place: &Place,
    weights: impl Fn(&Observed) -> [f64; 3],
    change: impl Fn(f64) -> Complex64,
) -> Vec<Regressor> {
    let of = |channel| {
        if meant(place, channel) {
            read(record, channel, weights(channel), &change)
        } else {
            Vec::new()
        }
    };
    vec![Regressor::of_channels(record.channels.iter().map(of).collect())]
}
