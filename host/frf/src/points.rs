//! Receptances between named points of a structure: tests with a roving hammer (force at several points) or a roving
//! sensor.
//!
//! Each recording has one point of the force and one of the sensor. Recordings with the same two points are measured
//! together, as [`measure`] does for the tool tip; all groups get the same frequency lines.

use std::fmt;

use quietcut_recording::Recording;

use super::error::FrfError;
use super::measurement::{Measurement, measure};
use super::measurement_settings::MeasurementSettings;
use super::test_channels::TestChannels;

/// Points of a recording: where the force acts, and where the sensor is.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct TestPoints {
    /// Name of the point of the force.
    pub force: String,
    /// Name of the point of the sensor.
    pub sensor: String,
}

impl fmt::Display for TestPoints {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "force at {}, sensor at {}", self.force, self.sensor)
    }
}

/// Receptances of the recordings with one point of the force and one of the sensor.
#[derive(Clone, Debug)]
pub struct PointGroup {
    /// The two points.
    pub points: TestPoints,
    /// Indices of the recordings among those that were measured.
    pub recordings: Vec<usize>,
    /// The receptances; the directions are those at the two points.
    pub measurement: Measurement,
}

/// Point of the force and of the sensor of a recording, as the keys `at` of its channels state them; `None` for one that
/// no channel states.
///
/// # Errors
/// The recording has no force or no response, or its forces, or its responses, are at several points.
pub fn points_of(recording: &Recording, channels: &[String]) -> Result<[Option<String>; 2], FrfError> {
    stated_points(&TestChannels::of(recording, channels)?)
}

/// Points of the forces and of the responses by the keys `at`, as [`points_of`].
fn stated_points(test: &TestChannels<'_>) -> Result<[Option<String>; 2], FrfError> {
    let recording = test.recording;
    let at = |name: &str| {
        recording
            .sidecar
            .channel(name)
            .and_then(|channel| channel.at.clone())
    };
    let one = |names: Vec<&str>, what: &str| {
        let mut points: Vec<String> = names.into_iter().filter_map(at).collect();
        points.sort();
        points.dedup();
        match points.as_slice() {
            [] => Ok(None),
            [one] => Ok(Some(one.clone())),
            several => Err(FrfError::Content {
                path: recording.path.clone(),
                what: format!(
                    "its {what} are at {}: a recording has one point of the force and one of the sensor; take channels of one point",
                    several.join(", ")
                ),
            }),
        }
    };
    let forces = test
        .forces
        .iter()
        .map(|(_, channel)| channel.name.as_str())
        .collect();
    let responses = test
        .responses
        .iter()
        .map(|response| response.channel.name.as_str())
        .collect();
    Ok([one(forces, "forces")?, one(responses, "sensors")?])
}

/// Measures the receptances of each pair of points, in the order of the first recording of each; `points` has one entry
/// for each recording.
///
/// # Errors
/// As [`measure`]; the numbers of recordings and points differ; or groups have different frequency lines even with one
/// resolution, as with different sample rates.
pub fn measure_points(
    recordings: &[Recording],
    points: &[TestPoints],
    settings: &MeasurementSettings,
) -> Result<Vec<PointGroup>, FrfError> {
    let mut groups: Vec<(&TestPoints, Vec<usize>)> = Vec::new();
    for (at, of) in points.iter().enumerate().take(recordings.len()) {
        match groups.iter_mut().find(|(other, _)| *other == of) {
            Some((_, members)) => members.push(at),
            None => groups.push((of, vec![at])),
        }
    }
    let measured = |points: &TestPoints, members: &[usize], settings: &MeasurementSettings| {
        let chosen: Vec<Recording> = members.iter().map(|at| recordings[*at].clone()).collect();
        let settings = MeasurementSettings {
            has_drive_points: points.force == points.sensor,
            ..settings.clone()
        };
        measure(&chosen, &settings)
    };
    let mut found = groups
        .iter()
        .map(|(points, members)| measured(points, members, settings))
        .collect::<Result<Vec<_>, _>>()?;
    let spacing = |measurement: &Measurement| {
        let lines = measurement.table.frequency_hz();
        match lines {
            [first, .., last] => (last - first) / (lines.len() - 1) as f64,
            _ => 0.0,
        }
    };
    let widest = found.iter().map(spacing).fold(0.0, f64::max);
    // Groups with a finer resolution, as from longer pauses between the impacts, are measured again with that of the
    // others.
    for (measurement, (points, members)) in found.iter_mut().zip(&groups) {
        if spacing(measurement) < widest * (1.0 - SAME_SPACING) {
            let coarser = MeasurementSettings {
                resolution_hz: Some(widest),
                ..settings.clone()
            };
            *measurement = measured(points, members, &coarser)?;
        }
    }
    Ok(groups
        .into_iter()
        .zip(found)
        .map(|((points, recordings), measurement)| PointGroup {
            points: points.clone(),
            recordings,
            measurement,
        })
        .collect())
}

/// Relative difference of two line spacings that count as equal: above rounding, far below one line in a record.
const SAME_SPACING: f64 = 1e-6;
