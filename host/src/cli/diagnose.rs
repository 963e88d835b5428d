//! `quietcut diagnose`: what the simulation gets wrong, and why.

use std::io::IsTerminal;
use std::path::{Path, PathBuf};

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};

use super::segment::RecordedSegment;
use super::{Error, Output};
use crate::case::Case;
use crate::diagnose::answer::Outcome;
use crate::diagnose::lobes::{believed, lobes};
use crate::diagnose::{DiagnoseError, Diagnosis, Options, Stage, diagnose_watched, recorded_cuts};
use crate::recording::Recording;
use crate::report::diagnosis::diagnosis_page;
use crate::report::lobes_change::{called, sentences};
use crate::trial_cuts::{self, TestCut};

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
    /// Cuts that were tried, a CSV file with the columns rpm [rev/min], depth [mm] and outcome (stable, chatter, marginal): how the case
    /// and the extended case call them.
    #[arg(long, value_name = "FILE")]
    cuts: Option<PathBuf>,
    /// Seed of whatever is drawn; nothing is at present, and the answer does not depend on it.
    #[arg(long, value_name = "N", default_value_t = 1)]
    seed: u64,
    #[command(flatten)]
    segment: RecordedSegment,
    #[command(flatten)]
    output: Output,
}

/// Runs the verb.
pub fn run(args: Args) -> Result<(), Error> {
    let case = Case::read(&args.case)?;
    let cuts = match &args.cuts {
        Some(path) => trial_cuts::read(path)?,
        None => Vec::new(),
    };
    let recordings = args.segment.read(&args.recordings)?;
    let bar = progress_bar();
    let options = Options { seed: args.seed };
    let mut diagnosis = diagnose_watched(&case, &recordings, &options, &|stage| {
        bar.set_message(words(stage));
        bar.inc(1);
    })?;
    let extended = diagnosis.extended_case(&crate::file::read_text(&args.case)?);
    bar.set_message("limits before and after");
    bar.inc(1);
    add_limits(&case, &recordings, &cuts, &mut diagnosis);
    bar.finish_and_clear();
    for warning in &diagnosis.warnings {
        tracing::warn!("{warning}");
    }
    if let Some(folder) = &args.out {
        write(folder, &case.name, &diagnosis, extended.as_deref())?;
    }
    args.output.answer(&diagnosis, text(&diagnosis))
}

/// Adds what the extension changes of the limits, or without one the lobes with the cuts that are known; says why where that is not known.
fn add_limits(case: &Case, recordings: &[Recording], cuts: &[TestCut], diagnosis: &mut Diagnosis) {
    let has_cuts = || !cuts.is_empty() || !recorded_cuts(case, recordings).is_empty();
    let found = match diagnosis.extended(case) {
        Some(extended) => lobes(case, &extended, &diagnosis.moved(case), recordings, cuts)
            .map(|found| diagnosis.lobes = Some(found)),
        None if has_cuts() => believed(case, recordings, cuts).map(|found| diagnosis.believed = Some(found)),
        None => Ok(()),
    };
    if let Err(error) = found {
        diagnosis.warnings.push(format!("limits are not known: {error}"));
    }
}

/// Stages of a diagnosis, with that of the limits; those of records are seen a second time where a part of them was searched first.
const STAGES: u64 = 9;

fn progress_bar() -> ProgressBar {
    let target = if std::io::stderr().is_terminal() {
        ProgressDrawTarget::stderr()
    } else {
        ProgressDrawTarget::hidden()
    };
    let bar = ProgressBar::with_draw_target(Some(STAGES), target);
    match ProgressStyle::with_template("{bar:24} {msg} {elapsed}") {
        Ok(style) => bar.with_style(style),
        Err(_) => bar,
    }
}

fn words(stage: Stage) -> &'static str {
    match stage {
        Stage::Records => "recordings beside the case",
        Stage::Library => "what each cause would look like",
        Stage::Causes(1) => "one cause",
        Stage::Causes(2) => "two causes",
        Stage::Causes(_) => "three causes",
        Stage::Answer => "what it means",
    }
}

fn write(folder: &Path, name: &str, diagnosis: &Diagnosis, extended: Option<&str>) -> Result<(), Error> {
    std::fs::create_dir_all(folder)
        .map_err(|error| Error::input(format!("--out {}: {error}", folder.display())))?;
    if let Some(extended) = extended {
        crate::file::write(&folder.join("extended.toml"), extended.as_bytes())?;
    }
    let json = serde_json::to_string_pretty(diagnosis).map_err(Error::other)?;
    crate::file::write(&folder.join("diagnosis.json"), json.as_bytes())?;
    let page = diagnosis_page(name, diagnosis, extended).map_err(Error::other)?;
    Ok(crate::file::write(&folder.join("report.html"), page.as_bytes())?)
}

fn text(diagnosis: &Diagnosis) -> String {
    let mut lines = vec![format!(
        "the case misses {:.3} % of the parts of the records that are held out, {:.3} % of the whole",
        100.0 * diagnosis.baseline.nrmse_heldout,
        100.0 * diagnosis.baseline.nrmse_whole
    )];
    lines.push(match diagnosis.outcome {
        Outcome::Cause => "cause found:".into(),
        Outcome::None => "nothing is wrong beyond the noise".into(),
        Outcome::Confounded => {
            format!("these explain it equally well: {}", diagnosis.alternatives())
        }
        Outcome::Unexplained => "something is wrong that no known cause explains".into(),
    });
    for cause in &diagnosis.causes {
        let place = match cause.location() {
            place if place.is_empty() => place,
            place => format!(" ({place})"),
        };
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
            "with it {:.3} % is missed: {:.2} % of the residual's energy beyond the noise is gone, 90 % interval {:.2} to {:.2} %",
            100.0 * extended.nrmse_heldout,
            100.0 * gain.residual_energy_removed,
            100.0 * gain.ci90[0],
            100.0 * gain.ci90[1]
        ));
    }
    if diagnosis.unexplained.fraction > 0.0 {
        lines.push(format!(
            "{:.2} % of what the case misses is not explained: {}",
            100.0 * diagnosis.unexplained.fraction,
            diagnosis.unexplained.location
        ));
    }
    lines.extend(diagnosis.unexplained.guess.clone());
    lines.extend(diagnosis.lobes.iter().flat_map(sentences));
    lines.extend(diagnosis.believed.iter().map(called));
    if let Some(test) = &diagnosis.next_test {
        lines.push(format!("next test: {}: it {}", test.what(), test.why));
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
