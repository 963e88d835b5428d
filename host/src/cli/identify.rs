//! `quietcut identify`: a model of the structure from recordings.

mod answer;
mod checks;
mod methods;
mod records;

use std::path::PathBuf;

use clap::ValueEnum;

use super::{Error, Output, non_negative, positive};
use crate::identify::law::Extra;
use crate::recording::Recording;
use answer::Answer;

/// A model of the structure from recordings: parameters with 90 % intervals, and what does not fit.
#[derive(Debug, clap::Args)]
#[command(
    after_help = "Example:\n  quietcut simulate tests/cases/kuka-kr90-y17-low.toml --experiment step-sine --frequency-hz 16.6:17.9:14 --force-n 1.8,5.8,9.5 --dwell-s 30 --sample-rate-hz 128 --noise-percent 1 --out measured.csv\n  quietcut identify measured.csv --method harmonic-balance --out found.toml\n  quietcut identify measured.csv --method hfrf\n  quietcut identify measured.csv --method linearity"
)]
pub struct Args {
    /// The recordings.
    #[arg(value_name = "REC", required = true)]
    recordings: Vec<PathBuf>,
    /// How.
    #[arg(long, value_name = "NAME")]
    method: Method,
    /// The case to write.
    #[arg(long, value_name = "CASE.toml")]
    out: Option<PathBuf>,
    /// Nonlinear terms of harmonic-balance.
    #[arg(
        long,
        value_name = "TERM,…",
        value_delimiter = ',',
        default_value = "cubic-stiffness,cubic-damping"
    )]
    terms: Vec<Extra>,
    /// Harmonics of the response that are balanced and fitted.
    #[arg(long, value_name = "N", default_value_t = 5, value_parser = clap::value_parser!(u8).range(1..=40))]
    harmonics: u8,
    /// How much of each dwell is transient, in s; without it what the decay of the structure and the noise say.
    #[arg(long, value_name = "T", value_parser = non_negative, allow_negative_numbers = true)]
    settle_s: Option<f64>,
    /// The recordings are multisines: harmonic-balance takes the last N samples of each as one whole period.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(16..))]
    period_samples: Option<u32>,
    /// Terms of restoring-force.
    #[arg(
        long,
        value_name = "TERM,…",
        value_delimiter = ',',
        default_value = "mass,damping,stiffness,cubic-stiffness,cubic-damping"
    )]
    surface: Vec<SurfaceTerm>,
    /// The mass, where restoring-force is to take it as known: needed where no force acts.
    #[arg(long, value_name = "M", value_parser = positive, allow_negative_numbers = true)]
    mass_kg: Option<f64>,
    /// The band of restoring-force in Hz, from and to; without it where the motion stands out of its noise.
    #[arg(long, value_name = "LOW,HIGH", value_delimiter = ',', num_args = 1, value_parser = non_negative)]
    band_hz: Vec<f64>,
    /// Width of the slices of restoring-force, as a share of the largest velocity or displacement.
    #[arg(long, value_name = "SHARE", default_value_t = 0.01, value_parser = positive, allow_negative_numbers = true)]
    slice: f64,
    /// Degree in the force of the maps of ncma: 1 has the form of eqs 4.8 and 4.9, 2 holds a cubic mode.
    #[arg(long, value_name = "N", default_value_t = 2, value_parser = clap::value_parser!(u8).range(1..=2))]
    degree: u8,
    #[command(flatten)]
    output: Output,
}

/// The methods.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum Method {
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
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum SurfaceTerm {
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

/// Runs the verb.
pub fn run(args: Args) -> Result<(), Error> {
    let recordings = args
        .recordings
        .iter()
        .map(Recording::read)
        .collect::<Result<Vec<_>, _>>()?;
    let mut answer = match args.method {
        Method::HarmonicBalance => methods::harmonic_balance(&args, &recordings)?,
        Method::Hfrf => methods::hfrf(&args, &recordings)?,
        Method::RestoringForce => records::restoring_force(&args, &recordings)?,
        Method::Ncma => methods::ncma(&args, &recordings)?,
        Method::Linearity => checks::linearity(&args, &recordings)?,
    };
    if let Some(path) = &args.out {
        let text = answer.case(path)?;
        crate::file::write(path, text.as_bytes())?;
        answer.case = Some(path.clone());
    }
    for warning in &answer.warnings {
        tracing::warn!("{warning}");
    }
    args.output.answer(&answer, text(&answer))
}

fn text(answer: &Answer) -> String {
    let mut lines = Vec::new();
    for model in &answer.models {
        for (key, figure) in &model.parameters {
            let [low, high] = figure.ci90;
            lines.push(format!(
                "{} {key} = {:.5e}, 90 % interval {low:.5e} to {high:.5e}",
                model.place(),
                figure.value
            ));
        }
    }
    lines.extend(answer.said.iter().cloned());
    if let Some(error) = answer.fit_error {
        lines.push(format!("fit error {:.3} % of the data", 100.0 * error));
    }
    if let Some(path) = &answer.case {
        lines.push(format!("written to {}", path.display()));
    }
    lines.join("\n")
}
