//! Options of `--method modes`.

use std::path::PathBuf;

use super::super::{Endings, positive};

/// Options of `--method modes`: model order, number of modes, stabilization diagram.
#[derive(Debug, clap::Args)]
#[command(next_help_heading = "Modes")]
pub(super) struct ModeOptions {
    /// Number of modes to select; of directions that no receptance couples, in each. Default: all stable poles of the stabilization diagram.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..))]
    pub(super) modes: Option<u16>,
    /// Highest model order of the stabilization diagram.
    #[arg(long, value_name = "N", default_value_t = 24, value_parser = clap::value_parser!(u16).range(5..=80))]
    pub(super) order: u16,
    /// Compare the modes with those of an earlier case, table of receptances or recording: pairs by shape (MAC) and frequency, changes of frequency and
    /// damping with 90 % intervals. With --compare the recording may be a case too.
    #[arg(long, value_name = "BEFORE")]
    pub(super) compare: Option<PathBuf>,
    /// Stabilization diagram to write; the ending sets the format: svg or html.
    #[arg(long, value_name = "FILE", value_parser = Endings(&["svg", "html"]).parser())]
    pub(super) stabilization: Option<PathBuf>,
    /// Frequency resolution in Hz of the receptances that are estimated from recordings, like the option of frf.
    #[arg(long, value_name = "D", value_parser = positive, allow_negative_numbers = true)]
    pub(super) resolution_hz: Option<f64>,
    /// Use the pseudo-inverse estimator of frf: the recordings are several cuts, in each of which the forces are
    /// linearly dependent.
    #[arg(long)]
    pub(super) pseudo_inverse: bool,
    /// Standard deviation of the gain of every sensor in percent, from its calibration: it widens the intervals of the mode shapes, and those of
    /// the limits. Default: the gains are taken as exact, and the case says so.
    #[arg(long, value_name = "P", value_parser = positive, allow_negative_numbers = true)]
    pub(super) calibration_percent: Option<f64>,
}
