//! `quietcut working-point`: sets the working point of the cut on the device.

use std::path::PathBuf;

use quietcut_core::units::{Degrees, Millimeters};
use quietcut_core::working_point::WorkingPoint;
use serde::Serialize;

use super::port::{PortArgs, WorkingPointAnswer, feed_direction_text};
use super::{Error, Output, angle, positive, postures};
use crate::report::answer::number;

/// Sets the working point of the cut on the device; without it, advice states the working point that it assumes.
#[derive(Debug, clap::Args)]
#[command(
    after_help = "Example:\n  quietcut working-point simulated --depth-mm 2 --start 90 --exit 180 --feed 0.15"
)]
pub struct Args {
    #[command(flatten)]
    port: PortArgs,
    /// Axial depth of cut in mm.
    #[arg(long, value_name = "A", value_parser = positive, allow_negative_numbers = true)]
    depth_mm: f64,
    /// Immersion angle in degrees where a tooth enters, clockwise from the normal to the feed.
    #[arg(long, value_name = "D", value_parser = angle, allow_negative_numbers = true)]
    start: f64,
    /// Immersion angle in degrees where a tooth leaves the workpiece.
    #[arg(long, value_name = "D", value_parser = angle, allow_negative_numbers = true)]
    exit: f64,
    /// Feed per tooth in mm.
    #[arg(long, value_name = "F", value_parser = positive, allow_negative_numbers = true)]
    feed: f64,
    /// Feed direction in degrees from the machine's x towards its y, for lobe tables with layers of several directions.
    #[arg(long, value_name = "D", value_parser = angle, allow_negative_numbers = true)]
    feed_direction_deg: Option<f64>,
    /// Posture of the robot: index of the posture in the lobe table.
    #[arg(long, value_name = "N", default_value_t = 0)]
    posture: u8,
    /// The lobe table on the device: the posture must be one of its postures. Default: the table in the file of
    /// --state. A device does not send its table back.
    #[arg(long, value_name = "FILE.qct")]
    table: Option<PathBuf>,
    #[command(flatten)]
    output: Output,
}

#[derive(Serialize)]
struct WorkingPointOutput<'a> {
    port: &'a str,
    working_point: WorkingPointAnswer,
    /// Feed direction that the device uses, in degrees from the machine's x towards its y; `null` if none is set, or if
    /// older firmware has none.
    feed_direction_deg: Option<f64>,
}

/// Runs the verb.
pub fn run(args: Args) -> Result<(), Error> {
    if args.exit <= args.start {
        return Err(Error::input(format!(
            "--start {} --exit {}: a tooth must leave after it enters; angles grow clockwise from the normal to the feed",
            args.start, args.exit
        )));
    }
    let point = WorkingPoint {
        axial_depth: Millimeters(args.depth_mm as f32),
        start: Degrees(args.start as f32),
        exit: Degrees(args.exit as f32),
        feed_per_tooth: Millimeters(args.feed as f32),
        posture: args.posture,
    };
    let table = args.table.as_deref().map(crate::file::read).transpose()?;
    let known = match (&table, &args.table) {
        (Some(bytes), Some(path)) => Some(postures::of_table(path, bytes)?),
        _ => args.port.state().and_then(postures::of_state),
    };
    postures::check(args.posture, known.as_deref())?;
    let (mut client, info) = args.port.connect()?;
    if known.is_none() && args.posture > 0 {
        match &info.table {
            Some(table) => tracing::warn!(
                "--posture {}: whether the lobe table on the device ({} layers) has this posture cannot be asked; give --table FILE.qct to check it",
                args.posture,
                table.layers
            ),
            None => tracing::warn!("--posture {}: there is no lobe table on the device", args.posture),
        }
    }
    client.set_working_point(Some(point))?;
    // The working point is read back from the device, so that the output states the one that the device uses.
    let point = client.status()?.working_point;
    let point = point.ok_or_else(|| {
        Error::other(format!(
            "{}: the device did not keep the working point",
            args.port.name()
        ))
    })?;
    // The requests for the feed direction come last, because older firmware rejects them. The earlier feed direction of
    // the device is replaced by that of the option, or removed without the option.
    let direction = args.feed_direction_deg.map(|degrees| Degrees(degrees as f32));
    if direction.is_some() || client.feed_direction()?.is_some() {
        client.set_feed_direction(direction)?;
    }
    let answer = WorkingPointOutput {
        port: args.port.name(),
        working_point: WorkingPointAnswer::new(&point),
        feed_direction_deg: client.feed_direction()?.map(|direction| number(direction.0)),
    };
    let text = format!(
        "{}: {}, feed direction {}",
        answer.port,
        answer.working_point,
        feed_direction_text(answer.feed_direction_deg)
    );
    args.output.answer(&answer, text)
}
