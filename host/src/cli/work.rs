//! `quietcut work`: tells the device its working point.

use super::{Error, Output, finite, positive};

/// Tells the device its working point; without it, advice says what it assumes.
#[derive(Debug, clap::Args)]
#[command(after_help = "Example:\n  quietcut work simulated --depth-mm 2 --start 90 --exit 180 --feed 0.15")]
pub struct Args {
    /// Serial port of the device, or `simulated`.
    #[arg(value_name = "PORT")]
    port: String,
    /// Axial depth of cut in mm.
    #[arg(long, value_name = "A", value_parser = positive, allow_negative_numbers = true)]
    depth_mm: f64,
    /// Immersion angle in degrees where a tooth enters, clockwise from the normal to the feed.
    #[arg(long, value_name = "D", value_parser = finite, allow_negative_numbers = true)]
    start: f64,
    /// Immersion angle in degrees where a tooth leaves.
    #[arg(long, value_name = "D", value_parser = finite, allow_negative_numbers = true)]
    exit: f64,
    /// Feed per tooth in mm.
    #[arg(long, value_name = "F", value_parser = positive, allow_negative_numbers = true)]
    feed: f64,
    /// Posture of the robot: an index that means the same on host and device.
    #[arg(long, value_name = "N", default_value_t = 0)]
    posture: u8,
    #[command(flatten)]
    output: Output,
}

/// Runs the verb.
pub fn run(args: Args) -> Result<(), Error> {
    let Args {
        port: _,
        depth_mm: _,
        start: _,
        exit: _,
        feed: _,
        posture: _,
        output: _,
    } = args;
    Err(Error::not_built("work"))
}
