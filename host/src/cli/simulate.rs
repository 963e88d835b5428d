//! `quietcut simulate`: a virtual cut.

use std::path::PathBuf;

use super::{Error, Output, positive};

/// A virtual cut: exact switching of the teeth, loss of contact, runout, and the sensor that hears it.
#[derive(Debug, clap::Args)]
#[command(
    after_help = "Example:\n  quietcut simulate tests/cases/kuka-kr90-acetal.toml --rpm 900 --depth-mm 2 --seconds 4 --out cut.csv"
)]
pub struct Args {
    /// The case file: structure, tool, material, cut.
    #[arg(value_name = "CASE")]
    case: PathBuf,
    /// Spindle speed in rev/min.
    #[arg(long, value_name = "N", value_parser = positive, allow_negative_numbers = true)]
    rpm: f64,
    /// Axial depth of cut in mm.
    #[arg(long, value_name = "A", value_parser = positive, allow_negative_numbers = true)]
    depth_mm: f64,
    /// Duration in s.
    #[arg(long, value_name = "T", value_parser = positive, allow_negative_numbers = true)]
    seconds: f64,
    /// Seed of the sensor's noise; the same seed gives the same file.
    #[arg(long, value_name = "N", default_value_t = 1)]
    seed: u64,
    /// The recording to write.
    #[arg(long, value_name = "REC.csv")]
    out: PathBuf,
    #[command(flatten)]
    output: Output,
}

/// Runs the verb.
pub fn run(args: Args) -> Result<(), Error> {
    let Args {
        case: _,
        rpm: _,
        depth_mm: _,
        seconds: _,
        seed: _,
        out: _,
        output: _,
    } = args;
    Err(Error::not_built("simulate"))
}
