//! The options of `--method modes`.

use std::path::PathBuf;

use super::super::positive;

/// The options of `--method modes`.
#[derive(Debug, clap::Args)]
#[command(next_help_heading = "Modes")]
pub(super) struct ModeOptions {
    /// The number of modes; without it all poles that are stable.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..))]
    pub(super) modes: Option<u16>,
    /// The highest order of the models whose poles are compared.
    #[arg(long, value_name = "N", default_value_t = 24, value_parser = clap::value_parser!(u16).range(5..=80))]
    pub(super) order: u16,
    /// The stabilization diagram to draw, svg or html by its ending.
    #[arg(long, value_name = "FILE")]
    pub(super) stabilization: Option<PathBuf>,
    /// Distance of the frequencies in Hz where recordings are given; as that of frf.
    #[arg(long, value_name = "D", value_parser = positive, allow_negative_numbers = true)]
    pub(super) resolution_hz: Option<f64>,
    /// The recordings are several cuts whose forces are dependent each by itself: pseudo-inverse, as that of frf.
    #[arg(long)]
    pub(super) pseudo_inverse: bool,
}
