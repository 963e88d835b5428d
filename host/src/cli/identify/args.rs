//! Arguments of `quietcut identify`.

use std::path::PathBuf;

use clap::ValueEnum;

use super::mode_options::ModeOptions;
use super::point_options::PointOptions;
use crate::cli::range::{ends, non_negative_ends};
use crate::cli::segment::RecordedSegment;
use crate::cli::{Endings, Output, finite, non_negative, positive, spindle_speed};
use crate::identify::law::NonlinearTerm;

/// Identifies structural or cutting parameters with 90 % intervals from recordings, and reports the misfit.
#[derive(Debug, clap::Args)]
#[command(
    after_help = "Example:\n  quietcut simulate tests/cases/kuka-kr90-y17-low.toml --experiment step-sine --frequency-hz 16.6:17.9:14 --force-n 1.8,5.8,9.5 --dwell-s 30 --sample-rate-hz 128 --noise-percent 1 --out measured.csv\n  quietcut identify measured.csv --method harmonic-balance --out found.toml\n  quietcut identify measured.csv --method hfrf\n  quietcut identify measured.csv --method linearity\n  quietcut identify measured.csv --method backbone --out backbone.svg\n  quietcut simulate tests/cases/kuka-kr90-acetal.toml --rpm 900 --depth-mm 1 --seconds 3 --out cut.csv\n  quietcut identify cut.csv --method force-coefficients --out material.toml\n  quietcut simulate tests/cases/six-joint-robot.toml --experiment hammer --direction x --force-n 800 --impacts 3 --spacing-s 6 --noise-percent 1 --out blows-x.csv\n  quietcut simulate tests/cases/six-joint-robot.toml --experiment hammer --direction y --force-n 800 --impacts 3 --spacing-s 6 --noise-percent 1 --out blows-y.csv\n  quietcut identify blows-x.csv blows-y.csv --method joints --start tests/cases/six-joint-robot.toml --band-hz 2:60 --out robot.toml\n  quietcut simulate tests/cases/kuka-kr90-acetal.toml --experiment hammer --direction x --force-n 300 --sample-rate-hz 512 --noise-percent 0.1 --out tap-x.csv\n  quietcut simulate tests/cases/kuka-kr90-acetal.toml --experiment hammer --direction y --force-n 300 --sample-rate-hz 512 --noise-percent 0.1 --out tap-y.csv\n  quietcut frf tap-x.csv tap-y.csv --band-hz 10:30 --out frf.csv\n  quietcut identify frf.csv --method modes --stabilization poles.svg --case tests/cases/kuka-kr90-acetal.toml --out modes.toml"
)]
pub struct Args {
    /// Recordings; for modes also a table of receptances; for inverse-stability a table of cuts with the columns
    /// rpm,depth_mm,chatter_hz,verdict: the verdict is stable, chatter, hopf, period-doubling or marginal, and
    /// chatter_hz is empty for a stable cut. The table that lobes --cuts reads is accepted too.
    #[arg(value_name = "REC", required = true)]
    pub(super) recordings: Vec<PathBuf>,
    /// Identification method.
    #[arg(long, value_name = "NAME")]
    pub(super) method: Method,
    /// Case, report or picture to write, or the table of backbone and mode-shapes; the ending sets the format: toml, html, svg or csv. May be
    /// repeated.
    #[arg(long, value_name = "FILE", value_parser = Endings(&["toml", "html", "svg", "csv"]).parser())]
    pub(super) out: Vec<PathBuf>,
    /// Nonlinear terms of the restoring force that harmonic-balance and joints identify.
    #[arg(
        long,
        value_name = "TERM,…",
        value_delimiter = ',',
        default_value = "cubic-stiffness,cubic-damping"
    )]
    pub(super) terms: Vec<NonlinearTerm>,
    /// Number of harmonics of the response to a sine that are taken from the record and used in the fit.
    #[arg(long, value_name = "N", default_value_t = 5, value_parser = clap::value_parser!(u8).range(1..=40))]
    pub(super) harmonics: u8,
    /// Time at the start of each dwell that is left out because the transient has not yet decayed, in s. Default:
    /// estimated from the decay rate of the structure and the noise.
    #[arg(long, value_name = "T", value_parser = non_negative, allow_negative_numbers = true)]
    pub(super) settle_s: Option<f64>,
    /// Period of a multisine in samples: harmonic-balance uses the last N samples of each recording as one period.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(16..))]
    pub(super) period_samples: Option<u32>,
    /// Terms of the restoring force that restoring-force fits.
    #[arg(
        long,
        value_name = "TERM,…",
        value_delimiter = ',',
        default_value = "mass,damping,stiffness,cubic-stiffness,cubic-damping"
    )]
    pub(super) surface: Vec<SurfaceTerm>,
    /// Mass that restoring-force uses instead of estimating it; required for a free decay, where no force acts.
    #[arg(long, value_name = "M", value_parser = positive, allow_negative_numbers = true)]
    pub(super) mass_kg: Option<f64>,
    /// Frequency band in Hz of restoring-force, joints, modes, mode-shapes, backbone and output-only. output-only requires it; the default of
    /// restoring-force is the band where the motion exceeds its noise, and for a free decay a third to five thirds of its frequency;
    /// that of backbone is the largest peak.
    #[arg(long, value_name = "FIRST:LAST", value_parser = non_negative_ends)]
    pub(super) band_hz: Option<[f64; 2]>,
    /// Width of the slices of the restoring-force surface, as a fraction of the largest velocity or displacement.
    #[arg(long, value_name = "SHARE", default_value_t = 0.01, value_parser = positive, allow_negative_numbers = true)]
    pub(super) slice: f64,
    /// Degree in the force F of the coefficients of the maps that ncma fits: 1 for a linear dependence, 2 for a mode
    /// with cubic stiffness.
    #[arg(long, value_name = "N", default_value_t = 2, value_parser = clap::value_parser!(u8).range(1..=2))]
    pub(super) degree: u8,
    /// Case with the initial values. For joints: geometry and inertia of the links, and initial stiffness and damping.
    /// For inverse-stability: tool, material and cut, and an initial structure.
    #[arg(long, value_name = "CASE.toml")]
    pub(super) start: Option<PathBuf>,
    /// For joints: also estimate the mass of the last link, which includes tool and payload.
    #[arg(long)]
    pub(super) payload: bool,
    /// For inverse-stability: standard deviation of the axial depth of each cut, in percent of the depth.
    #[arg(long, value_name = "P", default_value_t = 2.0, value_parser = positive, allow_negative_numbers = true)]
    pub(super) depth_error_percent: f64,
    /// For inverse-stability: standard deviation of each measured chatter frequency, in percent of the frequency.
    #[arg(long, value_name = "P", default_value_t = 0.3, value_parser = positive, allow_negative_numbers = true)]
    pub(super) chatter_error_percent: f64,
    /// For inverse-stability: seed of the random structures among which it searches; the same seed gives the same
    /// result.
    #[arg(long, value_name = "N", default_value_t = 1)]
    pub(super) seed: u64,
    /// For force-coefficients: edge angle κ of the tool in degrees; 90 is a square end mill.
    #[arg(long, value_name = "D", default_value_t = 90.0, value_parser = positive, allow_negative_numbers = true)]
    pub(super) edge_angle_deg: f64,
    /// For force-coefficients: angle in degrees from x to the feed direction.
    #[arg(long, value_name = "D", default_value_t = 0.0, value_parser = finite, allow_negative_numbers = true)]
    pub(super) feed_direction_deg: f64,
    /// For force-coefficients: start and end of full engagement, in s. Default: detected in the measured force.
    #[arg(long, value_name = "FIRST:LAST", value_parser = ends)]
    pub(super) cut_s: Option<[f64; 2]>,
    /// Case whose tool, material, cut and limits are copied into the written case; for force-coefficients: case that gets the
    /// identified coefficients and runout, and keeps all else. Default: the case of --start.
    #[arg(long, value_name = "CASE", requires = "out")]
    pub(super) case: Option<PathBuf>,
    /// Spindle speed in rev/min at which the structure was measured, 0 for taps at standstill; the written case states it, and charts from it
    /// say so. Default: what the recordings state (the tachometer); tables of receptances state none.
    #[arg(long, value_name = "N", value_parser = spindle_speed, allow_negative_numbers = true)]
    pub(super) rpm: Option<f64>,
    #[command(flatten)]
    pub(super) modes: ModeOptions,
    #[command(flatten)]
    pub(super) points: PointOptions,
    #[command(flatten)]
    pub(super) segment: RecordedSegment,
    #[command(flatten)]
    pub(super) output: Output,
}

/// Identification methods.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(super) enum Method {
    /// Complex modes with left and right mode shapes, from receptances or from recordings of force and response.
    Modes,
    /// Modes with mode shapes over named points, from a roving hammer (force at several points) or a roving sensor.
    ModeShapes,
    /// Mass, damping, stiffness and nonlinear terms from step-sine tests by harmonic balance, without the bias of hfrf.
    HarmonicBalance,
    /// Higher-order frequency response functions: the receptance as a polynomial of the force; exact for vanishing
    /// force.
    Hfrf,
    /// Restoring-force surface (force minus mass times acceleration, over displacement and velocity) of any record, and
    /// the force law fitted to it.
    RestoringForce,
    /// Nonlinear complex mode: natural frequency and loss factor as functions of force and receptance.
    Ncma,
    /// Natural frequency and damping ratio over the amplitude, with intervals: from free decays, and from force tests at
    /// several levels.
    Backbone,
    /// Tests whether the structure is linear, and names the kind of nonlinearity if it is not.
    Linearity,
    /// Stiffness and damping of robot joints from hammer or shaker tests at several postures; with --terms from
    /// step-sine tests at several forces.
    Joints,
    /// Operational modal analysis: natural frequencies and damping ratios from motion under unmeasured excitation.
    OutputOnly,
    /// Natural frequencies, damping ratios and stiffnesses from a table of stable cuts and cuts with chatter.
    InverseStability,
    /// Cutting coefficients, edge coefficients and runout from cuts with measured forces.
    ForceCoefficients,
}

impl Method {
    /// Endings of the files that this method writes by `--out`, the most usual first: a case, a table, a picture, a report.
    pub(super) fn endings(self) -> &'static [&'static str] {
        match self {
            Self::Modes => &["toml", "html", "svg"],
            Self::ModeShapes | Self::Backbone => &["csv", "html", "svg"],
            Self::HarmonicBalance
            | Self::Hfrf
            | Self::RestoringForce
            | Self::Joints
            | Self::InverseStability
            | Self::ForceCoefficients => &["toml", "html"],
            Self::Ncma | Self::Linearity | Self::OutputOnly => &["html"],
        }
    }

    /// Name of the method on the command line.
    pub(super) fn name(self) -> String {
        self.to_possible_value()
            .map_or_else(String::new, |value| value.get_name().to_owned())
    }
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
