//! `quietcut table`: builds the lobe table that goes to the device, or shows one.

use std::path::PathBuf;

use super::{Error, Output};

/// Builds a lobe table for the device from cases, or shows one.
#[derive(Debug, clap::Args)]
#[command(
    after_help = "Example:\n  quietcut table tests/cases/kuka-kr90-acetal.toml --out kuka.qct\n  quietcut table --show kuka.qct"
)]
pub struct Args {
    /// The case files, one layer each.
    #[arg(value_name = "CASE", required_unless_present = "show", requires = "out")]
    cases: Vec<PathBuf>,
    /// The table to write.
    #[arg(long, value_name = "FILE.qct", requires = "cases")]
    out: Option<PathBuf>,
    /// A table to read back.
    #[arg(long, value_name = "FILE.qct", conflicts_with_all = ["cases", "out"])]
    show: Option<PathBuf>,
    #[command(flatten)]
    output: Output,
}

/// Runs the verb.
pub fn run(args: Args) -> Result<(), Error> {
    let Args {
        cases: _,
        out: _,
        show: _,
        output: _,
    } = args;
    Err(Error::not_built("table"))
}
