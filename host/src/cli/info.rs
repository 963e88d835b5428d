//! `quietcut info`: asks the device who it is and what it has.

use super::{Error, Output};

/// Asks the device who it is, what table it has and how it is set.
#[derive(Debug, clap::Args)]
#[command(after_help = "Example:\n  quietcut info simulated")]
pub struct Args {
    /// Serial port of the device, or `simulated`.
    #[arg(value_name = "PORT")]
    port: String,
    #[command(flatten)]
    output: Output,
}

/// Runs the verb.
pub fn run(args: Args) -> Result<(), Error> {
    let Args { port: _, output: _ } = args;
    Err(Error::not_built("info"))
}
