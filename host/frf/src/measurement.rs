//! Measurement of receptances from recordings, with coherence and random error.

mod distortion;
mod folding;
#[cfg(test)]
mod folding_tests;
mod measured;
mod periodic;
#[cfg(test)]
mod periodic_tests;
mod recording_group;
mod sensor_mass;
mod steady;
mod stepped;
mod struck;
#[cfg(test)]
mod tests;
mod usable_lines;

use std::path::{Path, PathBuf};

use num_complex::Complex64;

pub use measured::Measurement;
pub use recording_group::RecordingGroup;

use super::criteria::SPARE_AVERAGES;
use super::cross_spectra::CrossSpectra;
use super::error::FrfError;
use super::estimate::{self, ChannelCounts, Estimator, FrfLine};
use super::excitation::Excitation;
use super::exponential_window::without_exponential_window;
use super::force_level::averaged_levels;
use super::measurement_settings::MeasurementSettings;
use super::table::{Frf, FrfTable};
use super::test_channels::TestChannels;
use super::test_plausibility::{self, Origin};
use periodic::{periodic, recognized, too_few_periods};
use quietcut_model::structure::Direction;
use quietcut_recording::Recording;
use recording_group::{MeasuredEntry, MeasuredGroup, receptances};
use sensor_mass::{accelerated, roving, sensor_mass};
use steady::steady;
use stepped::stepped;
use struck::{common_segment_s, struck};
use usable_lines::{independent, keep_excited};

/// Measures receptances, m/N, from recordings.
///
/// Recordings with the same force directions, the same measured responses and the same kind of excitation are averaged;
/// the others add entries to the receptance matrix. Accelerations and velocities are divided by (iω)² and iω. 0 Hz is
/// left out. The damping that an exponential window adds is removed, and the mass of the accelerometer if it is stated.
///
/// # Errors
/// For example: a recording has no force or no response, or is too short for the resolution; two step-sine records
/// would have to be averaged; the forces are dependent at more than half of the frequencies; the recordings have fewer
/// than half of their frequencies in common.
pub fn measure(recordings: &[Recording], settings: &MeasurementSettings) -> Result<Measurement, FrfError> {
    let channels = recordings
        .iter()
        .map(|recording| TestChannels::of(recording, &settings.channels))
        .collect::<Result<Vec<_>, _>>()?;
    let accelerated = if settings.has_drive_points {
        accelerated(&channels)
    } else {
        Vec::new()
    };
    let roving = roving(&channels);
    let groups = grouped(channels, settings)?;
    for (_, members) in &groups {
        one_point(members)?;
    }
    for recording in recordings {
        check_band(recording, settings)?;
    }
    let mut settings = settings.clone();
    if settings.hammer.segment_s.is_none() && settings.resolution_hz.is_none() {
        settings.hammer.segment_s = common_segment_s(&groups)?;
    }
    let settings = &settings;
    let exponential_s = settings.hammer.exponential_s;
    if let (Some(_), Some((other, _))) = (
        exponential_s,
        groups
            .iter()
            .find(|(excitation, _)| *excitation != Excitation::Hammer),
    ) {
        return Err(FrfError::Content {
            path: recordings
                .first()
                .map_or_else(PathBuf::new, |recording| recording.path.clone()),
            what: format!(
                "an exponential window belongs to impacts of a hammer, and one of the recordings is {}; measure them one by one",
                other.name()
            ),
        });
    }
    let has_periodic_force = groups
        .iter()
        .flat_map(|(excitation, members)| members.iter().map(|member| (*excitation, member)))
        .any(|(excitation, channels)| test_plausibility::is_periodic(excitation, channels));
    let doubts: Vec<String> = groups
        .iter()
        .flat_map(|(excitation, members)| members.iter().map(|member| (*excitation, member)))
        .flat_map(|(excitation, channels)| test_plausibility::of_channels(excitation, channels))
        .collect();
    let measured = groups
        .iter()
        .map(|(excitation, members)| measure_group(*excitation, members, settings))
        .collect::<Result<Vec<_>, _>>()?;
    let path = recordings
        .first()
        .map_or(Path::new(""), |recording| &recording.path);
    let mut measurement = merged(path, measured)?;
    // What is wrong with the recording comes before what follows from it.
    measurement.warnings.splice(0..0, doubts);
    let of_table = test_plausibility::of_table(
        &measurement.table,
        Origin::Recordings,
        settings.has_drive_points && !has_periodic_force,
    );
    measurement.warnings.extend(of_table);
    let slowest_hz = recordings
        .iter()
        .map(|recording| 0.5 * recording.sample_rate_hz)
        .fold(f64::INFINITY, f64::min);
    if let Some((_, last_hz)) = settings.band_hz.filter(|(_, last_hz)| *last_hz > slowest_hz) {
        measurement.warnings.push(format!(
            "the band ends at {slowest_hz} Hz, half the sample rate, and not at {last_hz} Hz"
        ));
    }
    if let Some(exponential_s) = exponential_s {
        measurement.table =
            without_exponential_window(&measurement.table, &mut measurement.deviation, exponential_s)?;
    }
    measurement.warnings.extend(roving);
    sensor_mass(&mut measurement, settings.accelerometer_mass_kg, &accelerated)?;
    Ok(measurement)
}

/// Groups recordings with the same force directions, the same measured responses and the same kind of excitation, in
/// the order of the first recording of each group.
///
/// The excitation is that of the settings. If they state none, it is that of [`Excitation::of_recording`], or a
/// multisine where that is random and the force is [`recognized`].
///
/// # Errors
/// The force and a response of a recording with random or hammer excitation seem to be swapped.
fn grouped<'a>(
    channels: Vec<TestChannels<'a>>,
    settings: &MeasurementSettings,
) -> Result<Vec<(Excitation, Vec<TestChannels<'a>>)>, FrfError> {
    let mut groups: Vec<(Excitation, Vec<TestChannels<'a>>)> = Vec::new();
    for mut channels in channels {
        let stated = settings
            .excitation
            .unwrap_or_else(|| Excitation::of_recording(channels.recording));
        if matches!(stated, Excitation::Random | Excitation::Hammer)
            && let Some(what) = test_plausibility::swapped(&channels)
        {
            return Err(FrfError::Content {
                path: channels.recording.path.clone(),
                what,
            });
        }
        let is_open = settings.excitation.is_none() && stated == Excitation::Random;
        let excitation = if is_open && recognized(&channels, settings) {
            Excitation::Multisine
        } else {
            stated
        };
        if is_open && excitation == Excitation::Random {
            channels.warnings.extend(too_few_periods(&channels, settings));
        }
        let same = groups.iter_mut().find(|(other, members)| {
            members[0].force_directions() == channels.force_directions()
                && members[0].response_kinds() == channels.response_kinds()
                && *other == excitation
        });
        match same {
            Some((_, members)) => members.push(channels),
            None => groups.push((excitation, vec![channels])),
        }
    }
    Ok(groups)
}

/// Refuses recordings that would be averaged although a force, or a sensor, of one direction was at different points by
/// the keys `at` of its channels.
fn one_point(members: &[TestChannels<'_>]) -> Result<(), FrfError> {
    let Some(first) = members.first() else {
        return Ok(());
    };
    let count = first.forces.len() + first.responses.len();
    for index in 0..count {
        let mut points: Vec<&str> = members
            .iter()
            .filter_map(|channels| {
                let forces = channels.forces.iter().map(|(_, channel)| *channel);
                let responses = channels.responses.iter().map(|response| response.channel);
                let channel = forces.chain(responses).nth(index)?;
                channels.recording.sidecar.channel(&channel.name)?.at.as_deref()
            })
            .collect();
        points.sort_unstable();
        points.dedup();
        if points.len() > 1 {
            return Err(FrfError::Content {
                path: first.recording.path.clone(),
                what: format!(
                    "it would be averaged with other recordings, but the {} was at {}: receptances of different points are not averaged; identify \
                     --method mode-shapes takes a hammer or a sensor that moves over points",
                    if index < first.forces.len() {
                        "force"
                    } else {
                        "sensor"
                    },
                    points.join(", ")
                ),
            });
        }
    }
    Ok(())
}

/// Refuses a frequency band to evaluate that begins at or above half the sample rate of a recording.
fn check_band(recording: &Recording, settings: &MeasurementSettings) -> Result<(), FrfError> {
    let half_hz = 0.5 * recording.sample_rate_hz;
    match settings.band_hz {
        Some((first_hz, _)) if first_hz >= half_hz => Err(FrfError::Content {
            path: recording.path.clone(),
            what: format!(
                "the band begins at {first_hz} Hz, but {} samples per second show frequencies up to {half_hz} Hz only; take a lower band, or \
                 check the unit of the time",
                recording.sample_rate_hz
            ),
        }),
        _ => Ok(()),
    }
}

/// Combines the receptances of all groups of recordings in one table, at the frequencies that all groups have in
/// common. An error if these are none or fewer than half of those of any group, or if two groups have the same
/// receptance.
fn merged(path: &Path, measured: Vec<MeasuredGroup>) -> Result<Measurement, FrfError> {
    let refused = |what: String| FrfError::Content {
        path: path.into(),
        what,
    };
    let mut common: Vec<f64> = measured
        .first()
        .map_or(Vec::new(), |first| first.frequency_hz.clone());
    let near = |list: &[f64], hertz: f64| {
        let at = list.partition_point(|&f| f < hertz * (1.0 - 1e-9));
        list.get(at)
            .is_some_and(|&f| f <= hertz * (1.0 + 1e-9))
            .then_some(at)
    };
    let most = measured
        .iter()
        .map(|group| group.frequency_hz.len())
        .max()
        .unwrap_or(0);
    for group in &measured {
        common.retain(|&hertz| near(&group.frequency_hz, hertz).is_some());
    }
    if common.len() * 2 < most || common.is_empty() {
        return Err(refused(format!(
            "of {most} frequencies the recordings have {} in common; take the same resolution and rate for all",
            common.len()
        )));
    }
    let mut measurement = Measurement {
        // A table cannot be empty; this placeholder is replaced below.
        table: FrfTable::new(path, vec![0.0], vec![placeholder()])?,
        deviation: Vec::new(),
        has_deviation: Vec::new(),
        freedoms: Vec::new(),
        groups: Vec::new(),
        warnings: Vec::new(),
    };
    let mut entries: Vec<Frf> = Vec::new();
    for group in measured {
        let lines: Vec<usize> = common
            .iter()
            .filter_map(|&hertz| near(&group.frequency_hz, hertz))
            .collect();
        let has_deviation = group.group.has_scatter();
        for MeasuredEntry { frf, deviation } in group.entries {
            if let Some(twice) = entries.iter().find(|other| other.name() == frf.name()) {
                return Err(refused(format!(
                    "h{} comes from two kinds of recordings; measure them one by one",
                    twice.name()
                )));
            }
            let common = |all: &[f64]| -> Vec<f64> { lines.iter().map(|&line| all[line]).collect() };
            entries.push(Frf {
                receptance: lines.iter().map(|&line| frf.receptance[line]).collect(),
                coherence: frf.coherence.as_deref().map(common),
                folding: frf.folding.as_deref().map(common),
                ..frf
            });
            measurement.deviation.push(common(&deviation));
            measurement.has_deviation.push(has_deviation);
            measurement.freedoms.push(group.group.freedoms);
        }
        measurement.groups.push(group.group);
        measurement.warnings.extend(group.warnings);
    }
    measurement.table = FrfTable::new(path, common, entries)?;
    Ok(measurement)
}

/// Receptance h_xx with one line, zero, for a table that must not be empty before the measured entries are known.
fn placeholder() -> Frf {
    Frf {
        response: Direction::X,
        force: Direction::X,
        receptance: vec![Complex64::ZERO],
        coherence: None,
        folding: None,
    }
}

/// Measures the receptances of one group of recordings with the same forces, responses and excitation.
fn measure_group(
    excitation: Excitation,
    members: &[TestChannels<'_>],
    settings: &MeasurementSettings,
) -> Result<MeasuredGroup, FrfError> {
    let first = &members[0];
    let rate = first.recording.sample_rate_hz;
    let refused = |what: String| FrfError::Content {
        path: first.recording.path.clone(),
        what,
    };
    if let Some(other) = members
        .iter()
        .find(|other| other.recording.sample_rate_hz != rate)
    {
        return Err(refused(format!(
            "{rate} Hz, but {} has {} Hz; recordings that are averaged must have one rate",
            other.recording.path.display(),
            other.recording.sample_rate_hz
        )));
    }
    let mut group = RecordingGroup {
        recordings: members.len(),
        forces: first.force_directions(),
        excitation,
        averages: 0.0,
        left_out_hz: Vec::new(),
        least_singular: 1.0,
        impacts: None,
        freedoms: None,
        periodic: None,
    };
    let mut warnings: Vec<String> = members
        .iter()
        .flat_map(|channels| channels.warnings.clone())
        .collect();
    warnings.extend(averaged_levels(excitation, members));
    if excitation == Excitation::StepSine {
        return stepped(group, members, settings, warnings);
    }
    if excitation == Excitation::Multisine {
        return periodic(group, members, settings, warnings);
    }
    let counts = ChannelCounts {
        forces: first.forces.len(),
        responses: first.responses.len(),
    };
    let two_sided = matches!(settings.estimator, Estimator::H2 | Estimator::Mean);
    if two_sided && counts.forces > 1 && counts.forces != counts.responses {
        return Err(refused(format!(
            "H2 of {} forces needs as many responses, but there are {}; take H1",
            counts.forces, counts.responses
        )));
    }
    // The largest power near half the sample rate, by hammer test, then by channel, from which the error by aliasing is
    // estimated; empty for other excitation.
    let mut tops: Vec<Vec<f64>> = Vec::new();
    let spectra = match excitation {
        Excitation::Hammer => {
            let (spectra, found) = struck(&mut group, members, settings, &mut warnings)?
                .into_iter()
                .unzip();
            tops = found;
            spectra
        }
        _ => members
            .iter()
            .map(|channels| steady(excitation, channels, members, settings, &mut warnings))
            .collect::<Result<Vec<_>, _>>()?,
    };
    group.averages = spectra.iter().map(|test| test.averages).sum();
    if group.averages < counts.forces as f64 + SPARE_AVERAGES && excitation != Excitation::Hammer {
        return Err(refused(format!(
            "{:.1} independent averages for {} forces; a longer record or a coarser resolution is needed",
            group.averages, counts.forces
        )));
    }
    let mut lines = estimate::lines(&spectra, counts, settings.estimator);
    warnings.extend(singular_lines(&spectra, &lines));
    add_folding(&mut lines, &spectra, &tops, counts.responses);
    if excitation == Excitation::Sweep {
        keep_excited(&mut lines, &spectra, counts);
    }
    independent(&mut lines, &mut group, counts).map_err(refused)?;
    Ok(receptances(group, &lines, first, warnings))
}

/// Sets the error by aliasing of every FRF line, for each response: the largest over all tests with `tops`, 0 without
/// any.
fn add_folding(lines: &mut [FrfLine], spectra: &[CrossSpectra], tops: &[Vec<f64>], responses: usize) {
    let Some(frequency_hz) = spectra.first().map(|test| &test.frequency_hz) else {
        return;
    };
    for line in lines {
        let at = frequency_hz.partition_point(|&hertz| hertz < line.frequency_hz);
        for response in 0..responses {
            let errors = spectra
                .iter()
                .zip(tops)
                .map(|(test, tops)| folding::relative_error(test, tops, at, response));
            line.folding[response] = errors.fold(0.0, f64::max);
        }
    }
}

/// Warning of the frequencies without an estimate, where a matrix to be inverted is singular; `None` if there are none.
fn singular_lines(spectra: &[CrossSpectra], lines: &[FrfLine]) -> Option<String> {
    let all_hz = spectra.first().map_or(&[][..], |test| &test.frequency_hz);
    let has_line = |hertz: &f64| lines.iter().any(|line| line.frequency_hz == *hertz);
    let missing = all_hz.len().saturating_sub(lines.len());
    let first = (missing > 0).then(|| all_hz.iter().find(|hertz| !has_line(hertz)))??;
    Some(format!(
        "the forces vanish or are dependent at {missing} frequencies, which are left out (the first is {first:.3} Hz)"
    ))
}
