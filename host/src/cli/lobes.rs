//! `quietcut lobes`: where a case is stable.

use std::path::PathBuf;

use super::{Error, Output, Range};

/// Stability limits over speed, or the dominant multiplier at points.
#[derive(Debug, clap::Args)]
#[command(
    after_help = "Example:\n  quietcut lobes tests/cases/kuka-kr90-acetal.toml --rpm 900:1200:7 --depth-mm 0.1:4:40 --out lobes.svg\n  quietcut lobes tests/cases/kuka-kr90-acetal.toml --at 1045,2 --at 900,2"
)]
pub struct Args {
    /// The case file: structure, tool, material, cut.
    #[arg(value_name = "CASE")]
    case: PathBuf,
    /// Spindle speeds in rev/min, first:last:count.
    #[arg(long, value_name = "R", value_parser = Range::positive, requires = "depth_mm", required_unless_present = "at")]
    rpm: Option<Range>,
    /// Axial depths in mm, first:last:count.
    #[arg(long, value_name = "R", value_parser = Range::positive, requires = "rpm")]
    depth_mm: Option<Range>,
    /// Chart or table to write: svg, html, csv or json by its ending.
    #[arg(long, value_name = "FILE", requires = "rpm")]
    out: Option<PathBuf>,
    /// A point, RPM,MM; may be given again.
    #[arg(long, value_name = "RPM,MM", conflicts_with = "rpm")]
    at: Vec<String>,
    #[command(flatten)]
    output: Output,
}

/// Runs the verb.
pub fn run(args: Args) -> Result<(), Error> {
    let Args {
        case: _,
        rpm: _,
        depth_mm: _,
        out: _,
        at: _,
        output: _,
    } = args;
    Err(Error::not_built("lobes"))
}
