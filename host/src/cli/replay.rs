//! `quietcut replay`: a recording through the same pipeline, here or on a device.

use std::num::NonZeroU8;
use std::path::PathBuf;

use super::{Error, Output, count, positive};

/// A recording through the same pipeline as on the spindle, here or on a device.
#[derive(Debug, clap::Args)]
#[command(
    after_help = "Example:\n  quietcut simulate tests/cases/kuka-kr90-acetal.toml --rpm 900 --depth-mm 2 --seconds 4 --out cut.csv\n  quietcut replay cut.csv"
)]
pub struct Args {
    /// The recording: CSV, UFF 58, WAV or MAT.
    #[arg(value_name = "REC")]
    recording: PathBuf,
    /// Lobe table for the advice.
    #[arg(long, value_name = "FILE.qct")]
    table: Option<PathBuf>,
    /// Run it on the device at this serial port, or `simulated`, instead of here.
    #[arg(long, value_name = "PORT")]
    port: Option<String>,
    /// Spindle speed in rev/min where the recording has no tachometer.
    #[arg(long, value_name = "N", value_parser = positive, allow_negative_numbers = true)]
    rpm: Option<f64>,
    /// Number of teeth where the recording does not say.
    #[arg(long, value_name = "N", value_parser = count, allow_negative_numbers = true)]
    teeth: Option<NonZeroU8>,
    #[command(flatten)]
    output: Output,
}

/// Runs the verb.
pub fn run(args: Args) -> Result<(), Error> {
    let Args {
        recording: _,
        table: _,
        port: _,
        rpm: _,
        teeth: _,
        output: _,
    } = args;
    Err(Error::not_built("replay"))
}
