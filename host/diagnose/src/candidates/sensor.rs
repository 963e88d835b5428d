//! What causes of sensor errors share: locations of a gain, a delay and an offset of the sensor from the tool tip, and
//! regressors of a gain, a delay and a cross-axis sensitivity. The estimated motion of the tool stands for the true value
//! y_t of a reading.

use num_complex::Complex64;

use crate::candidates::cause::{Location, Regressor};
use crate::records::channel::Observed;
use crate::records::channel::main_axis;
use crate::records::domain::Domain;
use crate::records::record::Record;
use crate::records::study::Study;
use quietcut_recording::Quantity;
use quietcut_simulate::path::SampledMotion;

/// Names of the channels of motion of a study, each once, if all records are compared in the response domain; otherwise
/// empty.
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

/// Locations of a sensor error (gain, delay, offset from the tool tip): each channel of motion and, if there are
/// several and the exciting force of some record is known (measured, or predicted in a cut), all of them with one
/// common value. Empty if the case already has this extension, if not all records are compared in the response domain,
/// or if there is neither a known exciting force nor a second channel of motion.
pub(super) fn one_or_all(study: &Study<'_>, name: &str) -> Vec<Location> {
    if study.baseline.case.extensions.contains_key(name) {
        return Vec::new();
    }
    let names = channels(study);
    // If the exciting force of no record is known, as in free decays, the error of the only channel of motion is not
    // identifiable.
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

pub(super) fn is_at(location: &Location, channel: &Observed) -> bool {
    match location.channel() {
        Some(name) => channel.pickup.name == name,
        None => channel.pickup.quantity != Quantity::Force,
    }
}

/// Reading that a channel with the axis weights `weights` has of the estimated motion, in the unit of the channel, with
/// its spectrum multiplied by `change`(ω).
///
/// The acceleration of a cut jumps when teeth enter and leave, and sampling folds much of it into the band. In a cut,
/// if a channel of the same quantity, delay and filters reads an axis alone, the reading that this channel has of the
/// estimated motion, which contains the aliasing, is used for the axis instead of the estimated displacement.
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
            .filter(|(_, other)| other.pickup.sections == channel.pickup.sections)
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

/// Regressor of a sensor error: the readings that the channels at `location`, with the axis weights `weights`, have of
/// the estimated motion, each with its spectrum multiplied by `change`(ω); empty for all other channels.
pub(super) fn readings_at(
    record: &Record,
    location: &Location,
    weights: impl Fn(&Observed) -> [f64; 3],
    change: impl Fn(f64) -> Complex64,
) -> Vec<Regressor> {
    let of = |channel| {
        if is_at(location, channel) {
            read(record, channel, weights(channel), &change)
        } else {
            Vec::new()
        }
    };
    vec![Regressor::of_channels(record.channels.iter().map(of).collect())]
}

/// Reading that a channel has of the estimated motion in a cut, with its spectrum multiplied by `change`(ω); `None` if
/// the record is not of a cut. The response to the cutting force of the baseline is changed on the upsampled grid, so
/// that its steps stay steps; the rest of the reading is changed at the samples of the record.
pub(super) fn reading_in_cut(
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
    let mut rest: Vec<f64> = readings.map(|(all, known)| all - known).collect();
    // Values of the rest at samples that are not compared are replaced by the value at the sample before, so that the
    // spectrum has no gap.
    for &sample in record.skipped[channel].iter().filter(|sample| **sample > 0) {
        rest[sample] = rest[sample - 1];
    }
    let mut spectrum = grid.continued_spectrum(&rest);
    for (bin, value) in spectrum.iter_mut().enumerate() {
        *value *= change(grid.omega(bin));
    }
    for (changed, rest) in changed.iter_mut().zip(grid.samples(&spectrum)) {
        *changed += rest;
    }
    Some(changed)
}

/// Completes the regressor of a sensor error for a cut, whose chips are computed along the motion that the sensor
/// misreads: adds the change of the cutting force from the measured to the true motion, divided by `over`. `truth`
/// corrects the motion along an axis for a sensor error of `over` units.
///
/// With y = S x the reading of the motion x, F the cutting force along a motion and H the receptance, the residual is y
/// − H F(y) = (y − x) + H (F(x) − F(y)), because x = H F(x). If several channels of motion have one main axis, each is
/// taken to have an equal share in the estimated motion along that axis.
pub(super) fn with_chip_of_true_motion(
    record: &Record,
    location: &Location,
    mut regressors: Vec<Regressor>,
    over: f64,
    truth: impl Fn(&mut SampledMotion, usize),
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
            wrong += usize::from(is_at(location, channel));
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
