//! `quietcut next`: the one next useful command for a machine.

use std::path::PathBuf;

use super::{Error, Output};
use crate::machine::{MachineFolder, next_step};

/// Says the one next useful command for the machine of a folder, and why.
///
/// A machine is a folder with case.toml, taps/ (recordings of taps), frf/ (frequency response functions), cuts/
/// (recordings of cuts), tried.csv (outcomes of cuts), lobes.html (the chart), table.qct (the lobe table of the device)
/// and diagnosis/.
#[derive(Debug, clap::Args)]
#[command(
    after_help = "Example:\n  quietcut setup mill --teeth 2 --diameter-mm 12.7 --ktc-mpa 119 --krc-mpa 20.2 --kac-mpa 39.3 --down-milling-mm 6.35 --feed-per-tooth-mm 0.15 --rpm 600:2400\n  quietcut next mill"
)]
pub struct Args {
    /// The folder of the machine.
    #[arg(value_name = "DIR")]
    folder: PathBuf,
    #[command(flatten)]
    output: Output,
}

/// Runs the verb.
pub fn run(args: Args) -> Result<(), Error> {
    let step = next_step(&MachineFolder::read(&args.folder)?);
    let text = format!(
        "there: {}\nnext:  {}\nwhy:   {}",
        step.state.join("; "),
        step.command,
        step.why
    );
    args.output.answer(&step, text)
}
