//! `quietcut diagnose`: compares recordings with the simulation of a case and finds the causes of the prediction error.

use std::path::{Path, PathBuf};

use super::segment::{Recorded, RecordedSegment};
use super::{Error, Output, progress, speed_question};
use crate::case::Case;
use crate::diagnose::answer::Outcome;
use crate::diagnose::lobes::{baseline_lobes, lobes};
use crate::diagnose::{DiagnoseError, Diagnosis, Options, Stage, diagnose_watched, recorded_cuts};
use crate::recording::Recording;
use crate::report::diagnosis::diagnosis_page;
use crate::report::digits::significant;
use crate::report::lobes_change::{sentences, trial_cut_counts};
use crate::trial_cuts::{self, TrialCut};

/// Number of places of an unexplained residual that the text lists.
const PLACES_SAID: usize = 5;

/// Finds why the simulation of a case differs from recordings, extends the case, and states the gain in prediction
/// error.
#[derive(Debug, clap::Args)]
#[command(
    after_help = "Example:\n  quietcut simulate tests/cases/kuka-kr90-full.toml --experiment sweep --direction x --frequency-hz 10:25:2 --force-n 20 --effect cubic-stiffness=-5e12 --effect cubic-stiffness.direction=x --noise-percent 1 --out measured.csv\n  quietcut diagnose tests/cases/kuka-kr90-full.toml measured.csv --out diagnosis"
)]
pub struct Args {
    /// The baseline model (case file).
    #[arg(value_name = "CASE.toml")]
    case: PathBuf,
    /// Recordings of tests or cuts.
    #[arg(value_name = "REC", required = true)]
    recordings: Vec<PathBuf>,
    /// Folder to write: extended.toml (the extended case), diagnosis.json and report.html.
    #[arg(long, value_name = "DIR", value_parser = folder)]
    out: Option<PathBuf>,
    /// Trial cuts, a CSV file with the columns rpm [rev/min], depth [mm] and outcome (stable, chatter, marginal):
    /// compared with the stability that the case and the extended case predict.
    #[arg(long, value_name = "FILE")]
    cuts: Option<PathBuf>,
    /// Seed of random numbers. Reserved: the diagnosis draws none, and its result does not depend on the seed.
    #[arg(long, value_name = "N", default_value_t = 1)]
    seed: u64,
    #[command(flatten)]
    segment: RecordedSegment,
    #[command(flatten)]
    output: Output,
}

/// Runs the verb.
pub fn run(args: Args) -> Result<(), Error> {
    let mut case = Case::read(&args.case)?;
    if case.speed_dependence.is_some() {
        return Err(Error::input(format!(
            "{}: structure.at_speed: a diagnosis needs the one structure of the speed of the records; leave [[structure.at_speed]] out and give that one",
            args.case.display()
        )));
    }
    speed_question::ask(&mut case, args.output)?;
    let cuts = match &args.cuts {
        Some(path) => trial_cuts::read(path)?,
        None => Vec::new(),
    };
    let Recorded {
        recordings,
        understood,
    } = args.segment.read(&args.recordings)?;
    let bar = progress::bar(Some(STAGES), "{spinner} {bar:24} {msg} {elapsed}");
    let options = Options { seed: args.seed };
    let mut diagnosis = diagnose_watched(&case, &recordings, &options, &|stage| {
        bar.set_message(stage_message(stage));
        bar.inc(1);
    })?;
    let extended = diagnosis.extended_case(&crate::file::read_text(&args.case)?);
    bar.set_message("stability limits before and after");
    bar.inc(1);
    add_limits(&case, &recordings, &cuts, &mut diagnosis);
    bar.finish_and_clear();
    for warning in &diagnosis.warnings {
        tracing::warn!("{warning}");
    }
    if let Some(folder) = &args.out {
        write(folder, &case.name, &diagnosis, extended.as_deref())?;
    }
    args.output.answer_with(&understood, &diagnosis, text(&diagnosis))
}

/// Parses the name of the folder to write; the ending of an output file, such as `.html`, is refused unless a folder
/// has that name.
fn folder(text: &str) -> Result<PathBuf, String> {
    let path = PathBuf::from(text);
    match crate::file::ending(&path).as_str() {
        "html" | "json" | "toml" | "csv" | "svg" if !path.is_dir() => Err(format!(
            "a folder is needed, which gets report.html, diagnosis.json and, if a cause is found, extended.toml; such as {}",
            path.with_extension("").display()
        )),
        _ => Ok(path),
    }
}

/// Adds stability limits to the diagnosis: those of the case and of the extended case, or only those of the case if the
/// diagnosis extends nothing and there are trial cuts or recorded cuts. A failed computation of limits becomes a
/// warning.
fn add_limits(case: &Case, recordings: &[Recording], cuts: &[TrialCut], diagnosis: &mut Diagnosis) {
    let has_cuts = || !cuts.is_empty() || !recorded_cuts(case, recordings).0.is_empty();
    let found = match diagnosis.extended(case) {
        Some(extended) => lobes(case, &extended, &diagnosis.moved(case), recordings, cuts).map(|found| {
            diagnosis.warnings.extend(found.warnings.iter().cloned());
            diagnosis.lobes = Some(found);
        }),
        None if has_cuts() => baseline_lobes(case, recordings, cuts).map(|found| {
            diagnosis.warnings.extend(found.warnings.iter().cloned());
            diagnosis.baseline_lobes = Some(found);
        }),
        None => Ok(()),
    };
    if let Err(error) = found {
        diagnosis
            .warnings
            .push(format!("the stability limits could not be computed: {error}"));
    }
}

/// Length of the progress bar of `quietcut diagnose`. A diagnosis that searches causes once has at most eight stages,
/// the stability limits included. A second search, in the whole of long recordings, has more.
const STAGES: u64 = 9;

fn stage_message(stage: Stage) -> &'static str {
    match stage {
        Stage::Records => "comparing the recordings with the baseline model",
        Stage::Library => "computing the response to each cause",
        Stage::Causes(1) => "candidate models with one cause",
        Stage::Causes(2) => "candidate models with two causes",
        Stage::Causes(_) => "candidate models with three causes",
        Stage::Answer => "intervals and conclusion",
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
        "prediction error (NRMSE): {:.3} % on held-out segments, {:.3} % overall",
        100.0 * diagnosis.baseline.nrmse_heldout,
        100.0 * diagnosis.baseline.nrmse_whole
    )];
    lines.push(match diagnosis.outcome {
        Outcome::Cause => "cause found:".into(),
        Outcome::None => "the case agrees with the recordings within the noise".into(),
        Outcome::Confounded => {
            format!(
                "these candidate models fit equally well: {}",
                diagnosis.alternatives()
            )
        }
        Outcome::Update => {
            "the case agrees with the recordings within the noise, with other values within its uncertainty"
                .into()
        }
        Outcome::Unexplained => "the case is wrong, and no known cause explains the residual".into(),
    });
    for cause in &diagnosis.causes {
        let location = match cause.location() {
            location if location.is_empty() => location,
            location => format!(" ({location})"),
        };
        lines.push(format!(
            "  {}{location}, confidence {:.2}",
            cause.name, cause.confidence
        ));
        for (key, figure) in &cause.parameters {
            let [low, high] = figure.ci90;
            lines.push(format!(
                "    {key} = {}, 90 % interval {} to {}",
                significant(figure.value, 6),
                significant(low, 6),
                significant(high, 6)
            ));
        }
    }
    if !diagnosis.updates.is_empty() {
        lines.push("what the recordings say of uncertain parameters:".into());
        lines.extend(
            diagnosis
                .updates
                .iter()
                .map(|update| format!("  {}", update.sentence())),
        );
    }
    if let (Some(extended), Some(gain)) = (diagnosis.extended, diagnosis.gain) {
        lines.push(format!(
            "with this extension the NRMSE on held-out segments is {:.3} %; it explains {:.2} % of the residual energy above the noise (90 % interval {:.2} to {:.2} %)",
            100.0 * extended.nrmse_heldout,
            100.0 * gain.residual_energy_removed,
            100.0 * gain.ci90[0],
            100.0 * gain.ci90[1]
        ));
    }
    if diagnosis.unexplained.fraction > 0.0 {
        lines.push(format!(
            "{:.2} % of the residual energy of the case is not explained: {}",
            100.0 * diagnosis.unexplained.fraction,
            diagnosis.unexplained.location
        ));
        lines.extend(
            diagnosis
                .unexplained
                .places
                .iter()
                .take(PLACES_SAID)
                .map(|place| format!("  {place}")),
        );
    }
    lines.extend(diagnosis.unexplained.guess.clone());
    lines.extend(diagnosis.lobes.iter().flat_map(sentences));
    lines.extend(diagnosis.baseline_lobes.iter().map(trial_cut_counts));
    if let Some(test) = &diagnosis.next_test {
        lines.push(format!("next test: {}; it {}", test.what(), test.why));
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
