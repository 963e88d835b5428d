//! `quietcut upload`: sends a lobe table to the device.

use std::path::PathBuf;

use super::{Error, Output};

/// Sends a lobe table to the device; goes on where an interrupted upload stopped.
#[derive(Debug, clap::Args)]
#[command(
    after_help = "Example:\n  quietcut table tests/cases/kuka-kr90-acetal.toml --out kuka.qct\n  quietcut upload simulated kuka.qct"
)]
pub struct Args {
    /// Serial port of the device, or `simulated`.
    #[arg(value_name = "PORT")]
    port: String,
    /// The lobe table.
    #[arg(value_name = "FILE.qct")]
    table: PathBuf,
    #[command(flatten)]
    output: Output,
}

/// Runs the verb.
pub fn run(args: Args) -> Result<(), Error> {
    let Args {
        port: _,
        table: _,
        output: _,
    } = args;
    Err(Error::not_built("upload"))
}
