//! The arguments of `quietcut identify`.

use std::path::PathBuf;

use clap::ValueEnum;

use super::mode_options::ModeOptions;
use crate::cli::segment::RecordedSegment;
use crate::cli::{Error, Output, finite, non_negative, positive};
use crate::identify::law::Extra;

/// A model of the structure from recordings: parameters with 90 % intervals, and what does not fit.
#[derive(Debug, clap::Args)]
#[command(
    after_help = "Example:\n  quietcut simulate tests/cases/kuka-kr90-y17-low.toml --experiment step-sine --frequency-hz 16.6:17.9:14 --force-n 1.8,5.8,9.5 --dwell-s 30 --sample-rate-hz 128 --noise-percent 1 --out measured.csv\n  quietcut identify measured.csv --method harmonic-balance --out found.toml\n  quietcut identify measured.csv --method hfrf\n  quietcut identify measured.csv --method linearity\n  quietcut simulate tests/cases/kuka-kr90-acetal.toml --rpm 900 --depth-mm 1 --seconds 3 --out cut.csv\n  quietcut identify cut.csv --method force-coefficients --out material.toml\n  quietcut simulate tests/cases/six-joint-robot.toml --experiment hammer --direction x --force-n 800 --impacts 3 --spacing-s 6 --noise-percent 1 --out blows-x.csv\n  quietcut simulate tests/cases/six-joint-robot.toml --experiment hammer --direction y --force-n 800 --impacts 3 --spacing-s 6 --noise-percent 1 --out blows-y.csv\n  quietcut identify blows-x.csv blows-y.csv --method joints --start tests/cases/six-joint-robot.toml --band-hz 2,60 --out robot.toml\n  quietcut simulate tests/cases/kuka-kr90-acetal.toml --experiment hammer --direction x --force-n 300 --sample-rate-hz 512 --noise-percent 0.1 --out tap-x.csv\n  quietcut simulate tests/cases/kuka-kr90-acetal.toml --experiment hammer --direction y --force-n 300 --sample-rate-hz 512 --noise-percent 0.1 --out tap-y.csv\n  quietcut frf tap-x.csv tap-y.csv --band-hz 10:30 --out frf.csv\n  quietcut identify frf.csv --method modes --stabilization poles.svg --case tests/cases/kuka-kr90-acetal.toml --out modes.toml"
)]
pub struct Args {
    /// The recordings; for modes also a table of receptances; for inverse-stability a table of cuts, rpm,depth_mm,chatter_hz,verdict with verdict stable, chatter, hopf
    /// or period-doubling, and chatter_hz empty where nothing was heard.
    #[arg(value_name = "REC", required = true)]
    pub(super) recordings: Vec<PathBuf>,
    /// How.
    #[arg(long, value_name = "NAME")]
    pub(super) method: Method,
    /// The case to write.
    #[arg(long, value_name = "CASE.toml")]
    pub(super) out: Option<PathBuf>,
    /// Nonlinear terms of harmonic-balance, and of joints.
    #[arg(
        long,
        value_name = "TERM,…",
        value_delimiter = ',',
        default_value = "cubic-stiffness,cubic-damping"
    )]
    pub(super) terms: Vec<Extra>,
    /// Harmonics of the response that are balanced and fitted.
    #[arg(long, value_name = "N", default_value_t = 5, value_parser = clap::value_parser!(u8).range(1..=40))]
    pub(super) harmonics: u8,
    /// How much of each dwell is transient, in s; without it what the decay of the structure and the noise say.
    #[arg(long, value_name = "T", value_parser = non_negative, allow_negative_numbers = true)]
    pub(super) settle_s: Option<f64>,
    /// The recordings are multisines: harmonic-balance takes the last N samples of each as one whole period.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(16..))]
    pub(super) period_samples: Option<u32>,
    /// Terms of restoring-force.
    #[arg(
        long,
        value_name = "TERM,…",
        value_delimiter = ',',
        default_value = "mass,damping,stiffness,cubic-stiffness,cubic-damping"
    )]
    pub(super) surface: Vec<SurfaceTerm>,
    /// The mass, where restoring-force is to take it as known: needed where no force acts.
    #[arg(long, value_name = "M", value_parser = positive, allow_negative_numbers = true)]
    pub(super) mass_kg: Option<f64>,
    /// The band in Hz, from and to: of restoring-force, without it where the motion stands out of its noise; of joints and modes; and of
    /// output-only, which needs it.
    #[arg(long, value_name = "LOW,HIGH", value_delimiter = ',', num_args = 1, value_parser = non_negative)]
    pub(super) band_hz: Vec<f64>,
    /// Width of the slices of restoring-force, as a share of the largest velocity or displacement.
    #[arg(long, value_name = "SHARE", default_value_t = 0.01, value_parser = positive, allow_negative_numbers = true)]
    pub(super) slice: f64,
    /// Degree in the force of the maps of ncma: 1 has the form of eqs 4.8 and 4.9, 2 holds a cubic mode.
    #[arg(long, value_name = "N", default_value_t = 2, value_parser = clap::value_parser!(u8).range(1..=2))]
    pub(super) degree: u8,
    /// For joints: a case of the robot, with its geometry and the inertia of its links; its stiffness and damping are a guess.
    /// For inverse-stability: a case with tool, material and cut, and a first guess of the structure.
    #[arg(long, value_name = "CASE.toml")]
    pub(super) start: Option<PathBuf>,
    /// For joints: the mass of the last link, tool and payload, is not known either.
    #[arg(long)]
    pub(super) payload: bool,
    /// For inverse-stability: standard deviation of depths, in percent.
    #[arg(long, value_name = "P", default_value_t = 2.0, value_parser = positive, allow_negative_numbers = true)]
    pub(super) depth_error_percent: f64,
    /// For inverse-stability: standard deviation of chatter frequencies, in percent.
    #[arg(long, value_name = "P", default_value_t = 0.3, value_parser = positive, allow_negative_numbers = true)]
    pub(super) chatter_error_percent: f64,
    /// Seed of inverse-stability, which draws structures; the same seed gives the same answer.
    #[arg(long, value_name = "N", default_value_t = 1)]
    pub(super) seed: u64,
    /// Edge angle of the tool in degrees, for force-coefficients; 90 is a square end mill.
    #[arg(long, value_name = "D", default_value_t = 90.0, value_parser = positive, allow_negative_numbers = true)]
    pub(super) edge_angle_deg: f64,
    /// Angle from x to the feed in degrees, for force-coefficients.
    #[arg(long, value_name = "D", default_value_t = 0.0, value_parser = finite, allow_negative_numbers = true)]
    pub(super) feed_direction_deg: f64,
    /// From when to when the tool is in full cut, in s, for force-coefficients; without it where the force says so.
    #[arg(long, value_name = "FROM,TO", value_delimiter = ',', num_args = 1, value_parser = finite)]
    pub(super) cut_s: Vec<f64>,
    /// The case whose tool, material, cut and limits go into the case that is written; without it those of --start.
    #[arg(long, value_name = "CASE", requires = "out")]
    pub(super) case: Option<PathBuf>,
    #[command(flatten)]
    pub(super) modes: ModeOptions,
    #[command(flatten)]
    pub(super) segment: RecordedSegment,
    #[command(flatten)]
    pub(super) output: Output,
}

/// The methods.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(super) enum Method {
    /// Complex modes with left and right shapes (eq. 7.15) from receptances, or from recordings that give them.
    Modes,
    /// Mass, damping, stiffness and nonlinear terms from step-sine tests, without the bias of hfrf.
    HarmonicBalance,
    /// Higher-order FRF as in the thesis (eqs 5.15 to 5.17).
    Hfrf,
    /// The restoring-force surface (eq. 5.4) of any record, and the law that it follows.
    RestoringForce,
    /// Natural frequency and loss factor over force and receptance (eqs 4.5 to 4.9).
    Ncma,
    /// Whether the structure is linear, and if not of what kind it is.
    Linearity,
    /// Stiffness and damping of a robot's joints, from blows or a shaker at several postures; with --terms from step-sine tests at
    /// several forces.
    Joints,
    /// Natural frequencies and damping ratios from motion alone: idle running, or whatever shakes the machine.
    OutputOnly,
    /// Natural frequencies, damping ratios and stiffnesses from a table of cuts that chattered or not.
    InverseStability,
    /// Cutting and edge coefficients, and runout, from cuts with measured forces.
    ForceCoefficients,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(super) enum SurfaceTerm {
    Mass,
    Damping,
    Stiffness,
    QuadraticStiffness,
    CubicStiffness,
    QuinticStiffness,
    CubicDamping,
    CoulombFriction,
    Offset,
}

/// From and to of `--band-hz`, Hz.
pub(super) fn band(args: &Args) -> Result<Option<[f64; 2]>, Error> {
    match args.band_hz[..] {
        [] => Ok(None),
        [low, high] if low < high => Ok(Some([low, high])),
        _ => Err(Error::input(
            "--band-hz: two frequencies are needed, the lower first, as in 5,60",
        )),
    }
}
