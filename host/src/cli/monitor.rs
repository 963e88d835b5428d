//! `quietcut monitor`: live verdicts and advice of the device.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use quietcut_core::protocol::{Reports, Subscription};

use super::port::PortArgs;
use super::{Error, StreamedOutput, positive};
use crate::device::{Client, Event};
use crate::report::answer::VerdictLog;
use crate::report::words;

/// Shows live reports of the device: spindle speed, verdict, chatter frequency, advice.
#[derive(Debug, clap::Args)]
#[command(after_help = "Example:\n  quietcut monitor simulated --seconds 2")]
pub struct Args {
    #[command(flatten)]
    port: PortArgs,
    /// Stop after this time in s. Default: run until Ctrl-C.
    #[arg(long, value_name = "T", value_parser = positive, allow_negative_numbers = true)]
    seconds: Option<f64>,
    #[command(flatten)]
    output: StreamedOutput,
}

/// Least time between two printed lines while verdict and advice of the device do not change: a choice, short enough to
/// show that the device still answers.
const UNCHANGED_LINE_PERIOD: Duration = Duration::from_secs(2);

/// Longest wait for an event of the device before Ctrl-C and `--seconds` are checked: a choice.
const EVENT_TIMEOUT: Duration = Duration::from_millis(100);

/// Runs the verb.
pub fn run(args: Args) -> Result<(), Error> {
    let stop = Arc::new(AtomicBool::new(false));
    let on_interrupt = stop.clone();
    ctrlc::set_handler(move || on_interrupt.store(true, Ordering::Relaxed)).map_err(Error::other)?;

    let (mut client, _) = args.port.connect()?;
    client.subscribe(Subscription {
        reports: Reports::All,
        ..Subscription::default()
    })?;
    // With a `--seconds` beyond the range of the clock, `monitor` runs until Ctrl-C.
    let end = args
        .seconds
        .and_then(|seconds| Instant::now().checked_add(Duration::try_from_secs_f64(seconds).ok()?));
    let log = listen(&mut client, args.output, || {
        stop.load(Ordering::Relaxed) || end.is_some_and(|end| Instant::now() >= end)
    })?;
    client.subscribe(Subscription::default())?;
    if client.lost_frames() > 0 {
        tracing::warn!(
            "{} messages of the device were lost on the serial line",
            client.lost_frames()
        );
    }
    args.output.end(&[], &log, &log.summary)
}

/// Until `is_over` returns true, prints each report of the device that [`VerdictLog::take`] finds changed, and the
/// state of an unchanged report if [`UNCHANGED_LINE_PERIOD`] has passed since the last line.
fn listen(
    client: &mut Client,
    output: StreamedOutput,
    is_over: impl Fn() -> bool,
) -> Result<VerdictLog, Error> {
    let mut log = VerdictLog::default();
    let mut printed = Instant::now();
    while !is_over() {
        let Some(Event::Report(report)) = client.next_event(EVENT_TIMEOUT)? else {
            continue;
        };
        if let Some(change) = log.take(&report) {
            output.event(change, words::line(&report))?;
            printed = Instant::now();
        } else if printed.elapsed() >= UNCHANGED_LINE_PERIOD {
            output.line(words::state(&report))?;
            printed = Instant::now();
        }
    }
    Ok(log)
}
