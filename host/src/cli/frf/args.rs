//! Arguments of `quietcut frf`.

use std::path::PathBuf;

use crate::cli::range::non_negative_ends;
use crate::cli::segment::RecordedSegment;
use crate::cli::{Endings, Output, finite, non_negative, positive};
use crate::file;
use crate::frf::{Estimator, Excitation, HammerWindows, MeasurementSettings, Window};

/// Estimates receptances and their coherence from recordings of a shaker, a hammer or a cut.
#[derive(Debug, clap::Args)]
#[command(
    after_help = "Example:\n  quietcut simulate tests/cases/kuka-kr90-acetal.toml --experiment hammer --direction y --force-n 300 --sample-rate-hz 512 --noise-percent 0.1 --out hammer.csv\n  quietcut frf hammer.csv --band-hz 10:30 --out frf.csv --out frf.svg\n\n\
                  Recordings with the same forces are averaged; recordings with other forces add columns to the matrix of receptances.\n\
                  The sidecar key `kind` sets how a recording is divided into segments; --excitation overrides it.\n\
                  Forces that are not selected count as noise."
)]
pub struct Args {
    /// The recordings: CSV or another text table, UFF 58, WAV, MAT, LVM or TDMS.
    #[arg(value_name = "REC", required_unless_present = "compare")]
    pub(super) recordings: Vec<PathBuf>,
    /// Instead of recordings, compare the peaks of two tables of receptances, such as before and after a change of the tool:
    /// frequency, damping and size with 90 % intervals. --out draws both.
    #[arg(long, value_names = ["BEFORE", "AFTER"], num_args = 2, conflicts_with = "recordings")]
    pub(super) compare: Vec<PathBuf>,
    /// Table or chart to write; the ending sets the format: csv, uff, svg or html. May be repeated.
    #[arg(long, value_name = "FILE", value_parser = OutputFile::parse)]
    pub(super) out: Vec<OutputFile>,
    /// Estimator: h1 is unbiased by noise of the responses, h2 by noise of the forces, mean is (h1 + h2)/2.
    /// pseudo-inverse combines several cuts, in each of which the forces are linearly dependent.
    #[arg(long, value_enum, default_value_t)]
    pub(super) method: Method,
    /// Kind of excitation in the recordings; overrides the key kind of the sidecar file.
    #[arg(long, value_enum)]
    pub(super) excitation: Option<ExcitationKind>,
    /// First and last frequency of the estimated receptances, in Hz.
    #[arg(long, value_name = "FIRST:LAST", value_parser = non_negative_ends)]
    pub(super) band_hz: Option<[f64; 2]>,
    /// Distance between the frequency lines of the receptances, in Hz. Default: for each force, that of eight segments
    /// of a record of random excitation, or of eight averaged lines of a sweep.
    #[arg(long, value_name = "D", value_parser = positive, allow_negative_numbers = true)]
    pub(super) resolution_hz: Option<f64>,
    /// Window function on each segment of a record of random excitation.
    #[arg(long, value_enum, default_value_t)]
    pub(super) window: WindowName,
    /// Overlap of neighbouring segments of a record of random excitation, as a fraction of the segment length.
    #[arg(long, value_name = "FRACTION", value_parser = overlap, default_value = "0.5", allow_negative_numbers = true)]
    pub(super) overlap: f64,
    /// Channel to use where a recording has several forces, or several sensors of one direction; may be repeated.
    #[arg(long, value_name = "NAME")]
    pub(super) channel: Vec<String>,
    /// Time constant τ in s of the exponential window on hammer impacts. The window adds 1/τ to the decay rate of every
    /// mode; the written receptances have that damping taken off again.
    #[arg(long, value_name = "TAU", value_parser = positive, allow_negative_numbers = true)]
    pub(super) exponential_window_s: Option<f64>,
    /// Period in s of a multisine or of another signal that repeats. Default: found from the force of a shaker.
    #[arg(long, value_name = "T", value_parser = positive, allow_negative_numbers = true)]
    pub(super) period_s: Option<f64>,
    /// Mass in g of the accelerometer at the drive point; its effect is removed from the receptances. 0 for a sensor without contact.
    #[arg(long, value_name = "M", value_parser = non_negative, allow_negative_numbers = true)]
    pub(super) accelerometer_mass_g: Option<f64>,
    /// Force level in N to use where a step-sine test has several levels.
    #[arg(long, value_name = "F", value_parser = positive, allow_negative_numbers = true)]
    pub(super) force_n: Option<f64>,
    /// Frequency, damping and size of the peaks at each force level: of a stepped sine at several levels, or of recordings at several. A
    /// nonlinear structure has another linear model at each.
    #[arg(long, conflicts_with_all = ["compare", "force_n", "housing"])]
    pub(super) by_level: bool,
    /// Tool-tip calibration: FRF from the tool tip to the sensor on the housing.
    #[arg(long, value_name = "FILE", requires = "tip")]
    pub(super) housing: Option<PathBuf>,
    /// Tool-tip calibration: FRF from the tool tip to itself.
    #[arg(long, value_name = "FILE", requires = "housing")]
    pub(super) tip: Option<PathBuf>,
    /// Write uff files as binary (58b).
    #[arg(long)]
    pub(super) uff_binary: bool,
    #[command(flatten)]
    pub(super) segment: RecordedSegment,
    #[command(flatten)]
    pub(super) output: Output,
}

#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, clap::ValueEnum)]
pub(super) enum Method {
    #[default]
    H1,
    H2,
    Mean,
    PseudoInverse,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
pub(super) enum ExcitationKind {
    Random,
    Sweep,
    Hammer,
    StepSine,
    Multisine,
}

#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, clap::ValueEnum)]
pub(super) enum WindowName {
    #[default]
    Hann,
    Hamming,
    Rectangular,
}

/// Output file with its format.
#[derive(Clone, Debug)]
pub(super) struct OutputFile {
    pub(super) path: PathBuf,
    pub(super) format: FileFormat,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum FileFormat {
    Csv,
    Uff,
    Svg,
    Html,
}

impl OutputFile {
    fn parse(text: &str) -> Result<Self, String> {
        let path = Endings(&["csv", "uff", "unv", "svg", "html"]).checked(text)?;
        let format = match file::ending(&path).as_str() {
            "uff" | "unv" => FileFormat::Uff,
            "svg" => FileFormat::Svg,
            "html" => FileFormat::Html,
            _ => FileFormat::Csv,
        };
        Ok(Self { path, format })
    }
}

fn overlap(text: &str) -> Result<f64, String> {
    let value = finite(text)?;
    if (0.0..=0.95).contains(&value) {
        Ok(value)
    } else {
        Err(format!("{value} is not possible: it must be from 0 to 0.95"))
    }
}

impl Args {
    pub(super) fn settings(&self) -> MeasurementSettings {
        MeasurementSettings {
            excitation: self.excitation.map(|kind| match kind {
                ExcitationKind::Random => Excitation::Random,
                ExcitationKind::Sweep => Excitation::Sweep,
                ExcitationKind::Hammer => Excitation::Hammer,
                ExcitationKind::StepSine => Excitation::StepSine,
                ExcitationKind::Multisine => Excitation::Multisine,
            }),
            estimator: match self.method {
                Method::H1 => Estimator::H1,
                Method::H2 => Estimator::H2,
                Method::Mean => Estimator::Mean,
                Method::PseudoInverse => Estimator::PseudoInverse,
            },
            resolution_hz: self.resolution_hz,
            overlap: self.overlap,
            window: match self.window {
                WindowName::Hann => Window::Hann,
                WindowName::Hamming => Window::Hamming,
                WindowName::Rectangular => Window::Rectangular,
            },
            band_hz: self.band_hz.map(|[first, last]| (first, last)),
            channels: self.channel.clone(),
            hammer: HammerWindows {
                segment_s: None,
                exponential_s: self.exponential_window_s,
            },
            accelerometer_mass_kg: self.accelerometer_mass_g.map(|grams| 1e-3 * grams),
            period_s: self.period_s,
            has_drive_points: true,
            force_n: self.force_n,
        }
    }
}
