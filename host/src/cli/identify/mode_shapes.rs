//! `--method mode-shapes`: modes with shapes over named points, from a roving hammer or a roving sensor.

use super::Error;
use super::answer::IdentifyOutput;
use super::args::Args;
use super::mode_shapes_answer::ModeShapes;
use super::written::wants_picture;
use crate::cli::frf::warn_of_folding;
use crate::frf::{MeasurementSettings, TestPoints, measure_points, points_of};
use crate::identify::modes::Options;
use crate::identify::modes::points::identify_points;
use crate::recording::{Quantity, Recording, uff};
use crate::report::shape_chart::shape_chart;

/// Modes with shapes over the points of the recordings.
pub(super) fn mode_shapes(args: &Args, recordings: &[Recording]) -> Result<IdentifyOutput, Error> {
    let points = points(args, recordings)?;
    let settings = MeasurementSettings {
        band_hz: args.band_hz.map(|[low, high]| (low, high)),
        resolution_hz: args.modes.resolution_hz,
        ..MeasurementSettings::default()
    };
    let mut groups = measure_points(recordings, &points, &settings)?;
    for group in &mut groups {
        warn_of_folding(&mut group.measurement, recordings);
    }
    let options = Options {
        highest_order: usize::from(args.modes.order),
        modes: args.modes.modes.map(usize::from),
    };
    let found = identify_points(&groups, args.band_hz, &options)
        .map_err(|error| Error::input(format!("{}: {error}", args.recordings[0].display())))?;
    let mut warnings: Vec<String> = Vec::new();
    for group in &groups {
        for warning in &group.measurement.warnings {
            let words = format!("{}: {warning}", group.points);
            if !warnings.contains(&words) {
                warnings.push(words);
            }
        }
    }
    let shapes = ModeShapes::new(&found, &groups, recordings);
    warnings.extend(found.model.warnings.iter().cloned());
    warnings.extend(
        shapes
            .shifts
            .iter()
            .map(|shift| shift.in_words(&shapes, found.is_of_forces)),
    );
    if !shapes.is_scaled {
        warnings.push(
            "no point is both struck and measured in one direction: the mode shapes are unscaled, relative to their largest entry, and modal masses are \
             not known; add a recording with hammer and sensor at one point"
                .into(),
        );
    }
    let picture = wants_picture(&args.out)
        .then(|| shape_chart(&shapes.drawn()))
        .transpose()
        .map_err(|error| Error::other(error.to_string()))?
        .map(|svg| (svg, CAPTION));
    Ok(IdentifyOutput {
        fit_error: Some(found.model.fit_error),
        misfit: found.model.misfit,
        messages: shapes.lines(),
        mode_shapes: Some(shapes),
        warnings,
        picture,
        ..IdentifyOutput::of("mode-shapes", Vec::new(), Vec::new())
    })
}

const CAPTION: &str =
    "Real part of the mode shapes over the points, with 90 % intervals, each divided by its largest entry.";

/// Points of each recording: from the options, else what the channels or the nodes of a UFF file state.
fn points(args: &Args, recordings: &[Recording]) -> Result<Vec<TestPoints>, Error> {
    let chosen = |names: &[String], option: &str, at: usize| -> Result<Option<String>, Error> {
        match names {
            [] => Ok(None),
            [one] => Ok(Some(one.clone())),
            several if several.len() == recordings.len() => Ok(Some(several[at].clone())),
            several => Err(Error::input(format!(
                "{option} {}: {} points for {} recordings; one for each recording, or one for all, is needed",
                several.join(","),
                several.len(),
                recordings.len()
            ))),
        }
    };
    recordings
        .iter()
        .enumerate()
        .map(|(at, recording)| {
            let [force, sensor] = points_of(recording, &[])?;
            let [force_node, sensor_node] = nodes(recording)?;
            let missing = |what: &str, option: &str| {
                Error::input(format!(
                    "{}: the point of its {what} is not known; {option} names the points in the order of the recordings, or `at` of its channel in the \
                     sidecar does",
                    recording.path.display()
                ))
            };
            Ok(TestPoints {
                force: chosen(&args.points.force_at, "--force-at", at)?
                    .or(force)
                    .or(force_node)
                    .ok_or_else(|| missing("force", "--force-at"))?,
                sensor: chosen(&args.points.sensor_at, "--sensor-at", at)?
                    .or(sensor)
                    .or(sensor_node)
                    .ok_or_else(|| missing("sensor", "--sensor-at"))?,
            })
        })
        .collect()
}

/// Node numbers of the force and of the first response in a recording from a UFF file; `None` in other formats and for node 0, which states none.
fn nodes(recording: &Recording) -> Result<[Option<String>; 2], Error> {
    if !matches!(
        crate::file::ending(&recording.path).as_str(),
        "uff" | "unv" | "bunv"
    ) {
        return Ok([None, None]);
    }
    let known = uff::nodes(&recording.path).map_err(|error| Error::input(error.to_string()))?;
    let of = |is_force: bool| {
        let mut channels = recording
            .channels
            .iter()
            .filter(|channel| match channel.quantity {
                Quantity::Force => is_force,
                Quantity::Displacement | Quantity::Velocity | Quantity::Acceleration => !is_force,
                _ => false,
            });
        let name = &channels.next()?.name;
        let (_, node) = known.iter().find(|(other, node)| other == name && *node > 0)?;
        Some(node.to_string())
    };
    Ok([of(true), of(false)])
}
