//! `quietcut replay`: chatter detection in a recording, computed on this computer or on a device.

use std::num::NonZeroU8;
use std::path::{Path, PathBuf};
use std::time::Duration;

use quietcut_core::lobes::LobeTable;
use quietcut_core::monitor::{Monitor, State};
use quietcut_core::protocol::{Reports, Subscription};
use quietcut_core::units::Degrees;

use super::segment::RecordedSegment;
use super::{Endings, Error, StreamedOutput, angle, count, positive, tried};
use crate::device::{self, Client, Event};
use crate::recording::{RecordingError, Sensed, Sidecar, SpindleSettings};
use crate::report::answer::VerdictLog;
use crate::report::words;

/// Runs the signal chain of the device on a recording, on this computer or on a device.
#[derive(Debug, clap::Args)]
#[command(
    after_help = "Example:\n  quietcut simulate tests/cases/kuka-kr90-acetal.toml --rpm 900 --depth-mm 2 --seconds 4 --out cut.csv\n  quietcut replay cut.csv"
)]
pub struct Args {
    /// The recording: CSV or another text table, UFF 58, WAV, MAT, LVM or TDMS.
    #[arg(value_name = "REC")]
    recording: PathBuf,
    /// Lobe table for the advice.
    #[arg(long, value_name = "FILE.qct")]
    table: Option<PathBuf>,
    /// Run the signal chain on the device at this serial port, or `simulated`, instead of on this computer.
    #[arg(long, value_name = "PORT")]
    port: Option<String>,
    /// Spindle speed in rev/min; overrides the speed of the recording, and a recorded tachometer is then ignored.
    #[arg(long, value_name = "N", value_parser = positive, allow_negative_numbers = true)]
    rpm: Option<f64>,
    /// Number of teeth, if the recording does not state it. Another number than that of the sidecar is refused.
    #[arg(long, value_name = "N", value_parser = count, allow_negative_numbers = true)]
    teeth: Option<NonZeroU8>,
    /// Feed direction in degrees from the machine's x towards its y, for lobe tables with layers of several directions.
    #[arg(long, value_name = "D", value_parser = angle, allow_negative_numbers = true)]
    feed_direction_deg: Option<f64>,
    /// Add the outcome of the cut to this table of tried cuts, which lobes --cuts reads; it is made if there is none. The
    /// sidecar must state spindle speed and axial depth.
    #[arg(long, value_name = "FILE.csv", value_parser = Endings(&["csv"]).parser())]
    tried: Option<PathBuf>,
    #[command(flatten)]
    segment: RecordedSegment,
    #[command(flatten)]
    output: StreamedOutput,
}

impl Args {
    fn feed_direction(&self) -> Option<Degrees> {
        self.feed_direction_deg.map(|degrees| Degrees(degrees as f32))
    }
}

/// Runs the verb.
pub fn run(args: Args) -> Result<(), Error> {
    let recorded = args.segment.read(std::slice::from_ref(&args.recording))?;
    let [recording] = recorded.recordings.as_slice() else {
        return Err(Error::input(format!(
            "{}: {} records, and replay uses one; choose it with --record",
            args.recording.display(),
            recorded.recordings.len()
        )));
    };
    let stated = recording.sidecar.cut.and_then(|cut| cut.teeth);
    if let (Some(teeth), Some(stated)) = (args.teeth, stated)
        && u32::from(teeth.get()) != stated
    {
        return Err(Error::input(format!(
            "--teeth {teeth}: {} states cut.teeth = {stated}; leave --teeth out, or correct the sidecar",
            Sidecar::path_of(&args.recording).display()
        )));
    }
    let speed = SpindleSettings {
        rpm: args.rpm,
        teeth: args.teeth.map(NonZeroU8::get),
    };
    let sensed = Sensed::new(recording, speed)?;
    if let Some(rpm) = args.rpm
        && recording.channel("tacho").is_some()
    {
        tracing::warn!(
            "{}: the recorded tachometer is ignored, because --rpm {rpm} sets the speed; omit --rpm to use the tachometer",
            args.recording.display()
        );
    }
    if !sensed.is_calibrated {
        tracing::warn!(
            "{}: the channel has no unit; amplitudes are relative to the largest sample",
            args.recording.display()
        );
    }
    if sensed.settings.wheel.is_none() {
        tracing::warn!(
            "{}: no tachometer; the verdicts come from spectra, which do not show slow growth, nor period doubling of an even number of teeth \
             beside runout",
            args.recording.display()
        );
    }
    let table = args.table.as_deref().map(crate::file::read).transpose()?;
    let mut log = match &args.port {
        Some(port) => on_device(&args, port, &sensed, table.as_deref())?,
        None => on_host(&args, &sensed, table.as_deref())?,
    };
    // Without --table a device uses the table that it holds, if any, and this table may have limits.
    let knows_table = args.port.is_none() || table.is_some();
    if knows_table && !has_speed_limits(&sensed, table.as_deref()) {
        log.assume_every_speed();
    }
    if let Some(table) = &args.tried {
        tried::add(table, &args.recording, &recording.sidecar, &log)?;
    }
    args.output.end(&recorded.understood, &log, &log.summary)
}

/// True if the settings or the lobe table state the speed limits of the spindle, within which advice stays.
fn has_speed_limits(sensed: &Sensed, table: Option<&[u8]>) -> bool {
    let of_table = |bytes| LobeTable::parse(bytes).is_ok_and(|table: LobeTable<'_>| table.limits().is_some());
    sensed.settings.limits.is_some() || table.is_some_and(of_table)
}

/// Runs the signal chain of the device on a recording, on this computer.
fn on_host(args: &Args, sensed: &Sensed, table: Option<&[u8]>) -> Result<VerdictLog, Error> {
    let monitor = Monitor::new(sensed.settings)
        .map_err(|error| Error::input(format!("{}: {error}", args.recording.display())))?;
    let table = match (table, &args.table) {
        (Some(bytes), Some(path)) => Some(parse(path, bytes)?),
        _ => None,
    };
    let table = table.map(|table| match args.feed_direction() {
        Some(direction) => table.towards(direction),
        None => table,
    });
    let mut state = State::default();
    let mut log = VerdictLog::default();
    for (block, edges) in sensed.steps() {
        let report = monitor.step(
            &mut state,
            block,
            edges,
            table.as_ref(),
            sensed.working_point.as_ref(),
        );
        if let Some(change) = log.take(&report) {
            args.output.event(change, words::line(&report))?;
        }
    }
    Ok(log)
}

/// Runs the signal chain of a device on a recording. Afterwards the device gets back its settings, its working point,
/// the feed direction that `--feed-direction-deg` replaced, and its own sensor; an uploaded lobe table stays.
fn on_device(args: &Args, port: &str, sensed: &Sensed, table: Option<&[u8]>) -> Result<VerdictLog, Error> {
    let (mut client, _) = Client::connect(device::open(port, None)?)?;
    if let (Some(bytes), Some(path)) = (table, &args.table) {
        client.upload(&parse(path, bytes)?, |_, _| {})?;
    }
    let (settings, status) = (client.settings()?, client.status()?);
    let direction = args
        .feed_direction_deg
        .is_some()
        .then(|| client.feed_direction())
        .transpose()?;
    let log = feed_recording(args, &mut client, sensed);
    // The settings of the device are restored even if sending the recording to it failed; the error of sending is
    // then the one reported.
    let restored = client
        .subscribe(Subscription::default())
        .and_then(|()| client.set_working_point(status.working_point))
        .and_then(|()| direction.map_or(Ok(()), |direction| client.set_feed_direction(direction)))
        .and_then(|()| client.set_settings(settings))
        .and_then(|()| client.reset());
    let log = log?;
    restored?;
    Ok(log)
}

/// Configures the device for the recording, sends the recorded samples to the device, and logs the reports of the
/// device on them.
fn feed_recording(args: &Args, client: &mut Client, sensed: &Sensed) -> Result<VerdictLog, Error> {
    client.set_settings(sensed.settings)?;
    client.set_working_point(sensed.working_point)?;
    if let Some(direction) = args.feed_direction() {
        client.set_feed_direction(Some(direction))?;
    }
    client.subscribe(Subscription {
        reports: Reports::All,
        ..Subscription::default()
    })?;
    let mut log = VerdictLog::default();
    for (block, edges) in sensed.steps() {
        client.feed(block, edges)?;
        // The last report before the reply to a fed block is the report on this block. Earlier reports belong to the
        // sensor of the device, whose samples the device evaluates until the first block is fed.
        let mut last = None;
        while let Some(event) = client.next_event(Duration::ZERO)? {
            if let Event::Report(report) = event {
                last = Some(report);
            }
        }
        if let Some(report) = last
            && let Some(change) = log.take(&report)
        {
            args.output.event(change, words::line(&report))?;
        }
    }
    Ok(log)
}

/// Parses the lobe table in the bytes of the file at `path`.
fn parse<'a>(path: &Path, bytes: &'a [u8]) -> Result<LobeTable<'a>, Error> {
    LobeTable::parse(bytes).map_err(|error| Error::input(format!("{}: {error}", path.display())))
}

impl From<RecordingError> for Error {
    fn from(error: RecordingError) -> Self {
        match error {
            RecordingError::File(cause) => cause.into(),
            other => Self::input(other),
        }
    }
}
