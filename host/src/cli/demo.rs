//! `quietcut demo`: the whole chain on a virtual robot cell.

use std::path::PathBuf;

use super::{Error, Output};

/// The whole chain on a virtual robot cell, no hardware: lobes, upload, cut, chatter, advice, quiet.
#[derive(Debug, clap::Args)]
#[command(after_help = "Example:\n  quietcut demo --out quietcut-demo")]
pub struct Args {
    /// Folder for the report and its pictures.
    #[arg(long, value_name = "DIR", default_value = "quietcut-demo")]
    out: PathBuf,
    #[command(flatten)]
    output: Output,
}

/// Runs the verb.
pub fn run(args: Args) -> Result<(), Error> {
    let Args { out: _, output: _ } = args;
    Err(Error::not_built("demo"))
}
