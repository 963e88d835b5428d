//! `quietcut info`: identity, lobe table, settings and counters of the device.

use std::fmt::Write;

use quietcut_core::monitor::Settings;
use quietcut_core::protocol::{Info, Status};
use serde::Serialize;

use super::port::{PortArgs, SlotAnswer, TableAnswer, WorkingPointAnswer, feed_direction_text};
use super::{Error, Output};
use crate::report::answer::number;

/// Reads the identity, the lobe table, the settings and the error counters of the device.
#[derive(Debug, clap::Args)]
#[command(after_help = "Example:\n  quietcut info simulated")]
pub struct Args {
    #[command(flatten)]
    port: PortArgs,
    #[command(flatten)]
    output: Output,
}

#[derive(Serialize)]
struct DeviceOutput {
    port: String,
    board: String,
    firmware: String,
    protocol: u8,
    sample_rate_hz: f64,
    teeth: u8,
    wheel_positions: Option<u16>,
    slot_capacity: u32,
    slots: Vec<SlotAnswer>,
    table: Option<TableAnswer>,
    working_point: Option<WorkingPointAnswer>,
    feed_direction_deg: Option<f64>,
    uptime_s: f64,
    blocks: u32,
    clipped: u32,
    lost: u32,
    frames: u32,
    frame_errors: u32,
    dropped: u32,
}

/// Runs the verb.
pub fn run(args: Args) -> Result<(), Error> {
    let (mut client, info) = args.port.connect()?;
    let (settings, status) = (client.settings()?, client.status()?);
    // The feed direction is requested last, because a device with older firmware rejects this request and those after
    // it.
    let direction = client.feed_direction()?;
    let answer = DeviceOutput {
        feed_direction_deg: direction.map(|direction| number(direction.0)),
        ..DeviceOutput::new(args.port.name(), &info, &settings, &status)
    };
    args.output.answer(&answer, answer.text())
}

impl DeviceOutput {
    fn new(port: &str, info: &Info, settings: &Settings, status: &Status) -> Self {
        Self {
            port: port.into(),
            board: info.board.as_str().into(),
            firmware: info.firmware.as_str().into(),
            protocol: info.protocol,
            sample_rate_hz: number(settings.sensor.nominal_rate.0),
            teeth: settings.tool.teeth,
            wheel_positions: settings.wheel.map(|wheel| wheel.positions),
            slot_capacity: info.slot_capacity,
            slots: info.slots.iter().map(SlotAnswer::new).collect(),
            table: info.table.as_ref().map(TableAnswer::new),
            working_point: status.working_point.as_ref().map(WorkingPointAnswer::new),
            feed_direction_deg: None,
            uptime_s: status.uptime.0 as f64 / 1e9,
            blocks: status.blocks,
            clipped: status.clipped,
            lost: status.lost,
            frames: status.frames,
            frame_errors: status.frame_errors.total(),
            dropped: status.dropped,
        }
    }

    fn text(&self) -> String {
        let none = "none: advice uses the tooth-passing rule";
        let table = self.table.as_ref().map_or(none.into(), ToString::to_string);
        let not_set = "not set: advice states the working point that it assumes";
        let working_point = self
            .working_point
            .as_ref()
            .map_or(not_set.into(), ToString::to_string);
        let wheel = match self.wheel_positions {
            None => "none".into(),
            Some(1) => "one pulse per revolution".into(),
            Some(positions) => format!("{positions} positions per revolution"),
        };
        let mut text = format!("device         {} at {}\n", self.board, self.port);
        let mut line = |name: &str, value: String| {
            // Writing to a string cannot fail.
            let _ = writeln!(text, "{name:<15}{value}");
        };
        line(
            "firmware",
            format!("{}, protocol {}", self.firmware, self.protocol),
        );
        line("table", table);
        for (index, slot) in self.slots.iter().enumerate() {
            line(&format!("slot {}", index + 1), slot.to_string());
        }
        line("working point", working_point);
        line("feed direction", feed_direction_text(self.feed_direction_deg));
        line("tool", format!("{} teeth", self.teeth));
        line("sensor", format!("{} samples/s", self.sample_rate_hz));
        line("tachometer", wheel);
        line(
            "samples",
            format!(
                "{} blocks received, {} samples clipped, {} lost",
                self.blocks, self.clipped, self.lost
            ),
        );
        let Self {
            frames,
            frame_errors,
            dropped,
            ..
        } = self;
        line(
            "line",
            format!("{frames} frames, {frame_errors} of them unusable, {dropped} messages not sent"),
        );
        text.trim_end().into()
    }
}
