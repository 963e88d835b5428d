//! `quietcut monitor`: what the device hears, live.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use quietcut_core::protocol::{Reports, Subscription};

use super::port::PortArgs;
use super::{Error, Output, positive};
use crate::device::{Client, Event};
use crate::report::answer::VerdictLog;
use crate::report::words;

/// What the device hears, live: speed, verdict, chatter frequency, advice.
#[derive(Debug, clap::Args)]
#[command(after_help = "Example:\n  quietcut monitor simulated --seconds 2")]
pub struct Args {
    #[command(flatten)]
    port: PortArgs,
    /// Stop after this many seconds; without it Ctrl-C ends.
    #[arg(long, value_name = "T", value_parser = positive, allow_negative_numbers = true)]
    seconds: Option<f64>,
    #[command(flatten)]
    output: Output,
}

/// A line without news comes this often, so that one sees that the device lives.
const QUIET_LINES: Duration = Duration::from_secs(2);

/// Ctrl-C is noticed within this time.
const GLANCE: Duration = Duration::from_millis(100);

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
    // A time too far to count is no end.
    let end = args
        .seconds
        .and_then(|seconds| Instant::now().checked_add(Duration::try_from_secs_f64(seconds).ok()?));
    let log = listen(&mut client, args.output, || {
        stop.load(Ordering::Relaxed) || end.is_some_and(|end| Instant::now() >= end)
    })?;
    client.subscribe(Subscription::default())?;
    if client.lost_frames() > 0 {
        tracing::warn!(
            "{} messages of the device were lost on the line",
            client.lost_frames()
        );
    }
    args.output.answer(&log, &log.summary)
}

/// Prints news, and now and then a sign of life, until `is_over`.
fn listen(client: &mut Client, output: Output, is_over: impl Fn() -> bool) -> Result<VerdictLog, Error> {
    let mut log = VerdictLog::default();
    let mut said = Instant::now();
    while !is_over() {
        let Some(Event::Report(report)) = client.next_event(GLANCE)? else {
            continue;
        };
        let is_news = log.take(&report).is_some();
        if is_news || said.elapsed() >= QUIET_LINES {
            output.line(if is_news {
                words::line(&report)
            } else {
                words::state(&report)
            })?;
            said = Instant::now();
        }
    }
    Ok(log)
}
