//! Sensors that do not read the truth; y_t is the truth, along the measured motion.

use num_complex::Complex64;

use crate::candidates::cause::{Location, Regressor};
use crate::records::channel::Observed;
use crate::records::channel::main_axis;
use crate::records::domain::Domain;
use crate::records::record::Record;
use crate::records::study::Study;
use quietcut_recording::Quantity;
use quietcut_simulate::path::Motion;

/// Names of the channels of motion, where all records are predicted from their force.
pub(super) fn channels(study: &Study<'_>) -> Vec<String> {
    if !study.all_in(Domain::Response) {
        return Vec::new();
    }
    let mut names: Vec<String> = Vec::new();
    for channel in study.records.iter().flat_map(|record| &record.channels) {
        if channel.pickup.quantity != Quantity::Force && !names.contains(&channel.pickup.name) {
            names.push(channel.pickup.name.clone());
        }
    }
    names
}

/// A place for each channel, and where there are several, one for all of them together.
pub(super) fn one_or_all(study: &Study<'_>, name: &str) -> Vec<Location> {
    if study.baseline.case.extensions.contains_key(name) {
        return Vec::new();
    }
    let names = channels(study);
    // Without a motion that a force drives, nothing says how large or late it should be but another channel.
    let free = study
        .records
        .iter()
        .all(|record| record.force_n.iter().all(Vec::is_empty));
    let several = names.len() > 1;
    if free && !several {
        return Vec::new();
    }
    let mut locations: Vec<Location> = names.into_iter().map(Location::Channel).collect();
    if several && !free {
        locations.push(Location::Everywhere);
    }
    locations
}

pub(super) fn meant(location: &Location, channel: &Observed) -> bool {
    match location.channel() {
        Some(name) => channel.pickup.name == name,
        None => channel.pickup.quantity != Quantity::Force,
    }
}

/// What the channel reads of the motion as it is known, with the spectrum turned by `change` of ω.
///
/// The acceleration of a cut jumps where teeth enter and leave, so that much of a reading is folded into the band by sampling:
/// where a channel of the same kind reads an axis of a cut, its reading is taken and not the motion between the samples.
pub(super) fn read(
    record: &Record,
    channel: &Observed,
    weights: [f64; 3],
    change: impl Fn(f64) -> Complex64,
) -> Vec<f64> {
    let grid = &record.grid;
    let mut sum = vec![Complex64::ZERO; grid.bins()];
    for (axis, weight) in weights.into_iter().enumerate() {
        if weight == 0.0 || record.displacement[axis].is_empty() {
            continue;
        }
        let alike = record
            .readings
            .iter()
            .zip(&record.channels)
            .filter(|(_, other)| other.pickup.quantity == channel.pickup.quantity)
            .filter(|(_, other)| other.pickup.delay_s == channel.pickup.delay_s)
            .find_map(|(reading, other)| {
                let only = (0..3).all(|from| (from == axis) == (other.pickup.weights[from] != 0.0));
                only.then(|| (reading, weight / other.pickup.weights[axis]))
            });
        match alike {
            Some((reading, weight)) => {
                for (sum, bin) in sum.iter_mut().zip(grid.continued_spectrum(reading)) {
                    *sum += bin * weight;
                }
            }
            None => {
                for (bin, (sum, displacement)) in sum.iter_mut().zip(&record.displacement[axis]).enumerate() {
                    *sum += displacement * weight * record.factor(channel, bin);
                }
            }
        }
    }
    for (bin, value) in sum.iter_mut().enumerate() {
        *value *= change(grid.omega(bin));
    }
    grid.samples(&sum)
}

/// What the channels that are meant read with the spectrum turned by `change` of ω.
pub(super) fn of_meant(
    record: &Record,
    location: &Location,
    weights: impl Fn(&Observed) -> [f64; 3],
    change: impl Fn(f64) -> Complex64,
) -> Vec<Regressor> {
    let of = |channel| {
        if meant(location, channel) {
            read(record, channel, weights(channel), &change)
        } else {
            Vec::new()
        }
    };
    vec![Regressor::of_channels(record.channels.iter().map(of).collect())]
}

/// The change of what a channel reads of a cut, ω turned by `change`: of the response to its force over the finer samples, so that
/// steps stay steps, and of what the motion has besides.
pub(super) fn in_steps(
    record: &Record,
    channel: usize,
    change: impl Fn(f64) -> Complex64,
) -> Option<Vec<f64>> {
    let cutting = record.cut.as_ref()?;
    let grid = &record.grid;
    let mut force = record.cut_spectra(&cutting.force);
    let known = record.read_response(&force, channel);
    for force in force.iter_mut().flatten() {
        for (bin, value) in force.iter_mut().enumerate() {
            *value *= change(grid.omega(bin));
        }
    }
    let mut changed = record.read_response(&force, channel);
    let readings = record.readings[channel].iter().zip(&known);
    let mut besides: Vec<f64> = readings.map(|(all, known)| all - known).collect();
    // Where a sample is not compared nothing is known of it: it is as the one before.
    for &sample in record.skipped[channel].iter().filter(|sample| **sample > 0) {
        besides[sample] = besides[sample - 1];
    }
    let mut spectrum = grid.continued_spectrum(&besides);
    for (bin, value) in spectrum.iter_mut().enumerate() {
        *value *= change(grid.omega(bin));
    }
    for (changed, besides) in changed.iter_mut().zip(grid.samples(&spectrum)) {
        *changed += besides;
    }
    Some(changed)
}

/// The same regressor in a cut, where the chip was taken along a motion that the sensor tells wrongly: what the force is less
/// along the motion that `truth` makes of it, which is `over` units away.
///
/// With y = S x the reading of the motion x and F the force along a motion, y − H F(y) = (y − x) − H (F(y) − F(x)). Several sensors
/// of one axis are taken to have an even share in what is known of its motion.
pub(super) fn in_cut(
    record: &Record,
    location: &Location,
    mut regressors: Vec<Regressor>,
    over: f64,
    truth: impl Fn(&mut Motion, usize),
) -> Vec<Regressor> {
    let (Some(cut), Some(regressor)) = (&record.cut, regressors.first_mut()) else {
        return regressors;
    };
    let of_motion = |channel: &&Observed| channel.pickup.quantity != Quantity::Force;
    let mut moved = record.motion.clone();
    for axis in 0..3 {
        let readers = record
            .channels
            .iter()
            .filter(of_motion)
            .filter(|channel| main_axis(channel) == Some(axis));
        let (mut all, mut wrong) = (0, 0);
        for channel in readers {
            all += 1;
            wrong += usize::from(meant(location, channel));
        }
        if wrong == 0 || record.motion.x[axis].is_empty() {
            continue;
        }
        truth(&mut moved, axis);
        let share = wrong as f64 / all as f64;
        for (moved, known) in [
            (&mut moved.x[axis], &record.motion.x[axis]),
            (&mut moved.v[axis], &record.motion.v[axis]),
        ] {
            for (moved, known) in moved.iter_mut().zip(known) {
                *moved = known + share * (*moved - known);
            }
        }
    }
    let force = cut.force_along(&cut.cut.spindle_motion, &moved);
    regressor.cut = Some(force.difference(&cut.force, over));
    regressors
}
