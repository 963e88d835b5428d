//! `quietcut monitor`: what the device hears, live.

use super::{Error, Output, positive};

/// What the device hears, live: speed, verdict, chatter frequency, advice.
#[derive(Debug, clap::Args)]
#[command(after_help = "Example:\n  quietcut monitor simulated --seconds 2")]
pub struct Args {
    /// Serial port of the device, or `simulated`.
    #[arg(value_name = "PORT")]
    port: String,
    /// Stop after this many seconds; without it Ctrl-C ends.
    #[arg(long, value_name = "T", value_parser = positive, allow_negative_numbers = true)]
    seconds: Option<f64>,
    #[command(flatten)]
    output: Output,
}

/// Runs the verb.
pub fn run(args: Args) -> Result<(), Error> {
    let Args {
        port: _,
        seconds: _,
        output: _,
    } = args;
    Err(Error::not_built("monitor"))
}
