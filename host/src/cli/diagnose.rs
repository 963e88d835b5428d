//! `quietcut diagnose`: what the simulation gets wrong, and why.

use std::path::{Path, PathBuf};

use super::{Error, Output};
use crate::case::Case;
use crate::diagnose::answer::Outcome;
use crate::diagnose::{DiagnoseError, Diagnosis, Options, diagnose};
use crate::recording::Recording;
use crate::report::diagnosis::diagnosis_page;

/// What the simulation gets wrong about recordings, why, what to add, and how much better that is.
#[derive(Debug, clap::Args)]
#[command(
    after_help = "Example:\n  quietcut simulate tests/cases/kuka-kr90-full.toml --experiment sweep --direction x --frequency-hz 10:25:2 --force-n 20 --effect cubic-stiffness=-5e12 --effect cubic-stiffness.direction=x --noise-percent 1 --out measured.csv\n  quietcut diagnose tests/cases/kuka-kr90-full.toml measured.csv --out diagnosis"
)]
pub struct Args {
    /// What is believed.
    #[arg(value_name = "CASE.toml")]
    case: PathBuf,
    /// What was measured.
    #[arg(value_name = "REC", required = true)]
    recordings: Vec<PathBuf>,
    /// Folder for what is written: extended.toml, diagnosis.json and report.html.
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Seed of whatever is drawn.
    #[arg(long, value_name = "N", default_value_t = 1)]
    seed: u64,
    #[command(flatten)]
    output: Output,
}

/// Runs the verb.
pub fn run(args: Args) -> Result<(), Error> {
    let case = Case::read(&args.case)?;
    let recordings = args
        .recordings
        .iter()
        .map(Recording::read)
        .collect::<Result<Vec<_>, _>>()?;
    let diagnosis = diagnose(&case, &recordings, &Options { seed: args.seed })?;
    for warning in &diagnosis.warnings {
        tracing::warn!("{warning}");
    }
    if let Some(folder) = &args.out {
        write(folder, &args.case, &case.name, &diagnosis)?;
    }
    args.output.answer(&diagnosis, text(&diagnosis))
}

fn write(folder: &Path, case: &Path, name: &str, diagnosis: &Diagnosis) -> Result<(), Error> {
    std::fs::create_dir_all(folder)
        .map_err(|error| Error::input(format!("--out {}: {error}", folder.display())))?;
    let believed = crate::file::read_text(case)?;
    let extended = diagnosis.extended_case(&believed);
    if let Some(extended) = &extended {
        crate::file::write(&folder.join("extended.toml"), extended.as_bytes())?;
    }
    let json = serde_json::to_string_pretty(diagnosis).map_err(Error::other)?;
    crate::file::write(&folder.join("diagnosis.json"), json.as_bytes())?;
    let page = diagnosis_page(name, diagnosis, extended.as_deref()).map_err(Error::other)?;
    Ok(crate::file::write(&folder.join("report.html"), page.as_bytes())?)
}

fn text(diagnosis: &Diagnosis) -> String {
    let mut lines = vec![format!(
        "the case misses {:.3} % of what it was not fitted to",
        100.0 * diagnosis.baseline.nrmse_heldout
    )];
    lines.push(
        match diagnosis.outcome {
            Outcome::Cause => "cause found:",
            Outcome::None => "nothing is wrong beyond the noise",
            Outcome::Confounded => "these explain it equally well:",
            Outcome::Unexplained => "something is wrong that no known cause explains",
        }
        .into(),
    );
    for cause in &diagnosis.causes {
        let place = cause
            .channel
            .as_deref()
            .or(cause.direction)
            .map_or_else(String::new, |place| format!(" ({place})"));
        lines.push(format!(
            "  {}{place}, confidence {:.2}",
            cause.name, cause.confidence
        ));
        for (key, figure) in &cause.parameters {
            let [low, high] = figure.ci90;
            lines.push(format!(
                "    {key} = {:.5e}, 90 % interval {low:.5e} to {high:.5e}",
                figure.value
            ));
        }
    }
    if let (Some(extended), Some(gain)) = (diagnosis.extended, diagnosis.gain) {
        lines.push(format!(
            "with it {:.3} % is missed: {:.2} % of the residual's energy is gone",
            100.0 * extended.nrmse_heldout,
            100.0 * gain.residual_energy_removed
        ));
    }
    lines.join("\n")
}

impl From<DiagnoseError> for Error {
    fn from(error: DiagnoseError) -> Self {
        match error {
            DiagnoseError::Case(error) => error.into(),
            other => Self::input(other),
        }
    }
}
