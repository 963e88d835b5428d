//! `quietcut monitor`: what the device hears, live.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use quietcut_core::monitor::Report;
use quietcut_core::protocol::{Reports, Subscription};

use super::port::PortArgs;
use super::{Error, Output, positive};
use crate::device::{Client, Event};
use crate::report::answer::{VerdictLog, seconds};
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
    let end = args
        .seconds
        .map(|seconds| Instant::now() + Duration::from_secs_f64(seconds));
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
    let summary = &log.summary;
    let verdict = summary.verdict.unwrap_or("no verdict");
    let text = format!(
        "{} blocks, {} samples clipped, {} gaps; last: {verdict}",
        summary.blocks, summary.clipped, summary.gaps
    );
    args.output.answer(&log, text)
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
            output.line(line(&report))?;
            said = Instant::now();
        }
    }
    Ok(log)
}

/// `   12.3 s   900 rev/min  CHATTER at 17.4 Hz …: go to 1480 rev/min (…)`.
fn line(report: &Report) -> String {
    let speed = report
        .speed
        .map_or("     no speed".into(), |speed| format!("{:5.0} rev/min", speed.0));
    let verdict = words::verdict(&report.judgement);
    let advice = match &report.advice {
        Some(advice) if report.judgement.verdict.is_chatter() => {
            let why = words::why(advice, &report.judgement, report.speed);
            format!(": {} ({why})", words::action(advice))
        }
        _ => String::new(),
    };
    format!("{:7.1} s  {speed}  {verdict}{advice}", seconds(report))
}
