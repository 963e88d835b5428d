//! `quietcut monitor`: live verdicts and advice of the device, as a picture on a terminal and as lines elsewhere.

use std::io::IsTerminal;
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use quietcut_core::protocol::{Reports, Subscription};
use serde::Serialize;

use super::port::PortArgs;
use super::{Error, StreamedOutput, positive};
use crate::device::{Client, Event};
use crate::monitor::live::{Live, LiveError};
use crate::monitor::received::Received;
use crate::monitor::screen::{self, ScreenError};
use crate::monitor::web::{self, Server, WebAddress};
use crate::report::answer::VerdictLog;
use crate::report::words;

/// Shows live reports of the device: spindle speed, verdict, chatter frequency, advice.
///
/// On a terminal it draws verdict and speed in large letters, the spectrum, the stroboscopic map, the lobes of --table
/// and a history, and waits for a pulled cable to be plugged in again. It prints lines instead if standard input or
/// output is no terminal, with --lines, --seconds, --json or --json-lines, and on a terminal that cannot place text
/// (TERM=dumb). It draws without colours if NO_COLOR is set.
///
/// With --web it shows the same as a page in a browser, whose address it prints, and prints lines besides. The page is
/// for this computer only, unless another address is stated. Then all who have the printed address with its token see
/// the page. It is not encrypted: use it in a network that you trust.
#[derive(Debug, clap::Args)]
#[command(
    after_help = "Example:\n  quietcut monitor simulated --seconds 2\n  quietcut monitor simulated --web --seconds 2"
)]
pub struct Args {
    #[command(flatten)]
    port: PortArgs,
    /// Stop after this time in s. Default: run until Ctrl-C.
    #[arg(long, value_name = "T", value_parser = positive, allow_negative_numbers = true)]
    seconds: Option<f64>,
    /// Lobe table for the lobe chart and the margin on a terminal.
    #[arg(long, value_name = "FILE.qct")]
    table: Option<PathBuf>,
    /// Show a page in a browser. ADDRESS is a port, an address of this computer, or both, such as 0.0.0.0:8080.
    /// Default: 127.0.0.1 at a free port.
    #[arg(long, value_name = "ADDRESS", num_args = 0..=1, default_missing_value = "127.0.0.1:0")]
    web: Option<WebAddress>,
    /// Print lines on a terminal too.
    #[arg(long)]
    lines: bool,
    #[command(flatten)]
    output: StreamedOutput,
}

impl Args {
    /// True if the state of the device is drawn; false if it is printed as lines.
    fn draws(&self) -> bool {
        let is_asked_for_lines = self.lines || self.seconds.is_some() || self.output.is_json();
        let can_place_text = std::env::var_os("TERM").is_some_and(|name| name != "dumb" && !name.is_empty());
        let (input, output) = (std::io::stdin(), std::io::stdout());
        !is_asked_for_lines && can_place_text && input.is_terminal() && output.is_terminal()
    }
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
    // The signal with which a system or a service manager ends a program: the terminal is left as it was.
    signal_hook::flag::register(signal_hook::consts::SIGTERM, stop.clone()).map_err(Error::other)?;

    // With a `--seconds` beyond the range of the clock, `monitor` runs until Ctrl-C.
    let end = args
        .seconds
        .and_then(|seconds| Instant::now().checked_add(Duration::try_from_secs_f64(seconds).ok()?));
    let is_over = || stop.load(Ordering::Relaxed) || end.is_some_and(|end| Instant::now() >= end);
    if let Some(address) = args.web {
        return serve(&args, address, &stop, is_over);
    }
    if args.draws() {
        return draw(&args, &stop);
    }
    let (mut client, _) = args.port.connect()?;
    client.subscribe(Subscription {
        reports: Reports::All,
        ..Subscription::default()
    })?;
    let log = listen(&mut client, args.output, is_over)?;
    client.subscribe(Subscription::default())?;
    warn_of_lost(client.lost_frames());
    args.output.end(&[], &log, &log.summary)
}

/// Draws the state of the device until the user quits, then prints the summary.
fn draw(args: &Args, stop: &Arc<AtomicBool>) -> Result<(), Error> {
    let connect = args.port.connector()?;
    let table = args.table.as_deref().map(crate::file::read).transpose()?;
    let outcome = screen::show(args.port.name(), connect, table, stop).map_err(|error| match error {
        ScreenError::Live(cause) => args.live_error(cause),
        other => Error::other(other),
    })?;
    warn_of_lost(outcome.lost_frames);
    args.output.end(&[], &outcome.log, &outcome.log.summary)
}

/// Address of the page, as the first line of `--json-lines`.
#[derive(Serialize)]
struct PageLine<'a> {
    url: &'a str,
}

/// Changes of verdict, summary and address of the page.
#[derive(Serialize)]
struct PageOutput<'a> {
    #[serde(flatten)]
    log: &'a VerdictLog,
    url: &'a str,
}

/// Shows the state of the device on a page until `is_over`, and prints its changes.
fn serve(
    args: &Args,
    address: WebAddress,
    stop: &Arc<AtomicBool>,
    is_over: impl Fn() -> bool,
) -> Result<(), Error> {
    let connect = args.port.connector()?;
    let table = args.table.as_deref().map(crate::file::read).transpose()?;
    let server = Server::start(address)?;
    let live =
        Live::start(args.port.name(), connect, table, stop).map_err(|error| args.live_error(error.into()))?;
    let mut printed = Printed::default();
    let shown = web::show(live, &server, is_over, |received| {
        printed.print(args.output, received, server.url())
    });
    let outcome = shown.map_err(|error| match error {
        PageError::Live(cause) => args.live_error(cause),
        PageError::Output(cause) => cause,
    })?;
    warn_of_lost(outcome.lost_frames);
    let answer = PageOutput {
        log: &outcome.log,
        url: server.url(),
    };
    args.output.end(&[], &answer, &outcome.log.summary)
}

/// Reason why the page ends.
enum PageError {
    Live(LiveError),
    Output(Error),
}

impl From<LiveError> for PageError {
    fn from(error: LiveError) -> Self {
        Self::Live(error)
    }
}

/// The part of the state that is printed already.
#[derive(Default)]
struct Printed {
    has_url: bool,
    lines: usize,
    verdicts: usize,
}

impl Printed {
    /// Prints the address of the page once the device answers, and then each change of the state.
    fn print(&mut self, output: StreamedOutput, received: &Received, url: &str) -> Result<(), PageError> {
        self.print_changes(output, received, url)
            .map_err(PageError::Output)
    }

    fn print_changes(&mut self, output: StreamedOutput, received: &Received, url: &str) -> Result<(), Error> {
        if !self.has_url {
            self.has_url = true;
            output.event(&PageLine { url }, format!("page: {url}  (Ctrl-C ends it)"))?;
            output.apart(format!("page: {url}"));
        }
        let verdicts = &received.log.verdicts;
        for verdict in verdicts.get(self.verdicts..).unwrap_or_default() {
            output.object(verdict)?;
        }
        self.verdicts = verdicts.len();
        let new = received.line_count - self.lines;
        for line in received.lines.iter().rev().take(new).rev() {
            output.line(line)?;
        }
        self.lines = received.line_count;
        Ok(())
    }
}

impl Args {
    /// Converts the reason why the state of the device cannot be shown; a table is named by its file.
    fn live_error(&self, error: LiveError) -> Error {
        match error {
            LiveError::Device(cause) => cause.into(),
            LiveError::Table(cause) => {
                let file = self.table.as_deref().unwrap_or("--table".as_ref());
                Error::input(format!("{}: {cause}", file.display()))
            }
            silent @ LiveError::Silent => Error::other(silent),
        }
    }
}

fn warn_of_lost(frames: u32) {
    if frames > 0 {
        tracing::warn!("{frames} messages of the device were lost on the serial line");
    }
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
