//! The command line: one module per verb, with its arguments and a function `run`.
//!
//! Exit status 0: success, or the reader of standard output has closed the pipe. Exit status 2: wrong usage or wrong
//! input, with one message on stderr. Exit status 130: interrupted by Ctrl-C, which ends `monitor` with success. Exit
//! status 1: any other failure. An output file is complete or unchanged.

mod assumed;
pub mod bifurcation;
mod channels;
pub mod completions;
mod counted;
pub mod demo;
pub mod diagnose;
pub mod doctor;
mod error;
mod experiment;
pub mod frf;
pub mod identify;
pub mod info;
pub mod lobes;
mod lobes_cells;
mod lobes_csv;
mod lobes_files;
mod lobes_points;
mod lobes_rescaled;
mod lobes_spindle;
mod lobes_spread;
pub mod look;
mod method;
mod milling_rig;
pub mod monitor;
pub mod next;
mod number;
mod output;
mod output_recordings;
pub mod plan;
mod plausible_structure;
pub mod port;
mod postures;
mod progress;
mod range;
pub mod replay;
mod segment;
pub mod setup;
pub mod simulate;
mod speed_question;
pub mod table;
mod tried;
pub mod upload;
mod varied;
pub mod working_point;

use std::io::IsTerminal;
use std::panic;
use std::process::ExitCode;

use clap::error::{ContextKind, ContextValue, ErrorKind};
use clap::{ArgAction, CommandFactory, Parser, Subcommand};

pub use error::Error;
pub use number::{angle, count, finite, non_negative, positive, spindle_speed};
pub use output::{Endings, Output, StreamedOutput};
pub use range::Range;

/// Detects chatter, names its kind, and finds a stable spindle speed.
#[derive(Debug, Parser)]
#[command(name = "quietcut", version, arg_required_else_help = true)]
struct Cli {
    /// Log more on stderr: once for progress, twice for every detail.
    #[arg(short, long, global = true, action = ArgAction::Count)]
    verbose: u8,
    #[command(subcommand)]
    verb: Verb,
}

#[derive(Debug, Subcommand)]
enum Verb {
    Demo(demo::Args),
    Setup(Box<setup::Args>),
    Next(next::Args),
    Simulate(Box<simulate::Args>),
    Look(look::Args),
    Frf(frf::Args),
    Identify(Box<identify::Args>),
    Diagnose(diagnose::Args),
    Lobes(lobes::Args),
    Bifurcation(Box<bifurcation::Args>),
    Plan(plan::Args),
    Table(table::Args),
    Upload(upload::Args),
    Info(info::Args),
    #[command(visible_alias = "work")]
    WorkingPoint(working_point::Args),
    Monitor(monitor::Args),
    Replay(replay::Args),
    Doctor(doctor::Args),
    Completions(completions::Args),
}

/// Parses the command line of the process, runs its verb, and returns the exit status.
pub fn main() -> ExitCode {
    panic::set_hook(Box::new(|fault| {
        crate::messages::print_fault(&format!(
            "quietcut: a fault in quietcut itself, please report it: {fault}"
        ));
    }));
    // `error.exit()` of clap ends the process: with exit status 2 for wrong usage, 0 for `--help` and `--version`.
    let cli = Cli::try_parse().unwrap_or_else(|error| {
        let given: Vec<String> = std::env::args().collect();
        match unknown_argument(&error).and_then(|unknown| dashed_value(&given, unknown)) {
            Some(tip) => {
                eprintln!("error: {tip}");
                std::process::exit(2);
            }
            None => error.exit(),
        }
    });
    log_to_stderr(cli.verbose);
    if let Err(error) = leave_nothing_half_written(&cli.verb) {
        tracing::warn!("Ctrl-C may leave a half-written file aside: {error}");
    }
    if let Some(doing) = cli.verb.doing() {
        progress::show(doing);
    }
    let outcome = panic::catch_unwind(|| run(cli.verb));
    progress::clear();
    match outcome {
        Ok(Ok(())) | Ok(Err(Error::ReaderGone)) => ExitCode::SUCCESS,
        Ok(Err(error)) => {
            eprintln!("quietcut: {error}");
            ExitCode::from(error.exit_status())
        }
        // The panic hook has already printed the message of the panic.
        Err(_) => ExitCode::from(1),
    }
}

/// Argument that the parser does not know, of which it names only the first letter behind a single dash; `None` for
/// another error.
fn unknown_argument(error: &clap::Error) -> Option<&str> {
    match error.get(ContextKind::InvalidArg) {
        Some(ContextValue::String(unknown)) if error.kind() == ErrorKind::UnknownArgument => Some(unknown),
        _ => None,
    }
}

/// Message for the first option that is followed by a text beginning with a dash and a digit or point, such as `--rpm
/// -900:1200:7`, and with `unknown`, which the parser takes for an option; `None` if there is none.
fn dashed_value(given: &[String], unknown: &str) -> Option<String> {
    let is_value = |text: &str| {
        let mut letters = text.chars();
        text.starts_with(unknown)
            && letters.next() == Some('-')
            && letters
                .next()
                .is_some_and(|next| next.is_ascii_digit() || next == '.')
    };
    let pair = given
        .windows(2)
        .find(|pair| pair[0].starts_with("--") && !pair[0].contains('=') && is_value(&pair[1]))?;
    Some(format!(
        "{option} {value}: a value that begins with a dash is written behind an equals sign: {option}={value}",
        option = pair[0],
        value = pair[1]
    ))
}

/// Exit status of the process after Ctrl-C, by the convention of shells: 128 plus the signal number 2.
const INTERRUPTED: i32 = 130;

/// Makes Ctrl-C remove the unfinished output files and end the process at once, except in the verb `monitor`, which
/// handles Ctrl-C itself.
fn leave_nothing_half_written(verb: &Verb) -> Result<(), ctrlc::Error> {
    if matches!(verb, Verb::Monitor(_)) {
        return Ok(());
    }
    ctrlc::set_handler(|| {
        crate::file::abandon_writing();
        std::process::exit(INTERRUPTED);
    })
}

impl Verb {
    /// Activity that the progress line names while the verb computes; `None` for a verb without this line: for example,
    /// it shows its own progress or finishes at once.
    fn doing(&self) -> Option<&'static str> {
        match self {
            Self::Simulate(_) => Some("simulating"),
            Self::Frf(_) => Some("estimating frequency responses"),
            Self::Identify(_) => Some("identifying"),
            Self::Lobes(_) => Some("computing stability limits"),
            Self::Bifurcation(_) => Some("following orbits"),
            Self::Table(_) => Some("building the lobe table"),
            Self::Replay(_) => Some("reading the recording"),
            _ => None,
        }
    }
}

fn run(verb: Verb) -> Result<(), Error> {
    match verb {
        Verb::Demo(args) => demo::run(args),
        Verb::Setup(args) => setup::run(*args),
        Verb::Next(args) => next::run(args),
        Verb::Simulate(args) => simulate::run(*args),
        Verb::Look(args) => look::run(args),
        Verb::Frf(args) => frf::run(args),
        Verb::Identify(args) => identify::run(*args),
        Verb::Diagnose(args) => diagnose::run(args),
        Verb::Lobes(args) => lobes::run(args),
        Verb::Bifurcation(args) => bifurcation::run(*args),
        Verb::Plan(args) => plan::run(args),
        Verb::Table(args) => table::run(args),
        Verb::Upload(args) => upload::run(args),
        Verb::Info(args) => info::run(args),
        Verb::WorkingPoint(args) => working_point::run(args),
        Verb::Monitor(args) => monitor::run(args),
        Verb::Replay(args) => replay::run(args),
        Verb::Doctor(args) => doctor::run(args),
        Verb::Completions(args) => completions::run(args, &mut Cli::command()),
    }
}

fn log_to_stderr(verbose: u8) {
    let level = match verbose {
        0 => tracing::Level::WARN,
        1 => tracing::Level::INFO,
        _ => tracing::Level::TRACE,
    };
    tracing_subscriber::fmt()
        .with_max_level(level)
        .with_target(false)
        .without_time()
        .with_ansi(std::io::stderr().is_terminal())
        .with_writer(|| {
            progress::clear();
            crate::messages::Messages
        })
        .init();
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_argument_definitions_are_consistent() {
        Cli::command().debug_assert();
    }

    #[test]
    fn every_verb_shows_an_example() {
        for verb in Cli::command().get_subcommands() {
            let help = verb.get_after_help().map(ToString::to_string).unwrap_or_default();
            let line = format!("\n  quietcut {} ", verb.get_name());
            assert!(
                help.starts_with("Example:\n") && help.contains(&line),
                "{}: {help}",
                verb.get_name()
            );
        }
    }

    #[test]
    fn the_option_whose_value_is_taken_for_an_option_is_blamed() {
        let blamed = |line: &str| {
            let given: Vec<String> = line.split_whitespace().map(String::from).collect();
            let error = Cli::try_parse_from(&given).err()?;
            dashed_value(&given, unknown_argument(&error)?)
        };
        let message = blamed("quietcut frf a.csv --from-s -1 --band-hz -5:20").unwrap();
        assert!(message.starts_with("--band-hz -5:20:"), "{message}");
        let other = "quietcut lobes case.toml --no-such-option 3 --rpm -900:1200:7";
        assert_eq!(blamed(other), None);
    }
}
