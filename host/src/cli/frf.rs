//! `quietcut frf`: receptances H = X/F with coherence, estimated from recordings.

mod answer;
mod args;
mod by_level;
mod compare;
mod figure;
mod folding;
mod multisine_answer;
mod related_lines;

use std::path::PathBuf;

use maud::html;

use super::Error;
use super::output::keep_inputs;
use super::segment::Recorded;
use crate::file;
use crate::frf::{FrfError, FrfTable, calibrate, measure};
use crate::recording::UffForm;
use crate::report::frf_chart::frf_chart;
use crate::report::page::{figure, page};
use answer::FrfOutput;
pub use args::Args;
use args::{FileFormat, OutputFile};
pub(super) use by_level::levels_without_peak;
use folding::check_folding;
pub(super) use folding::warn_of_folding;

/// Runs the verb.
pub fn run(args: Args) -> Result<(), Error> {
    if let [before, after] = args.compare.as_slice() {
        return compare::run(&args, before, after);
    }
    if args.by_level {
        return by_level::run(&args);
    }
    for target in &args.out {
        let inputs = args.recordings.iter().chain(&args.housing).chain(&args.tip);
        keep_inputs(inputs.map(PathBuf::as_path), &target.path)?;
    }
    let Recorded {
        recordings,
        understood,
    } = args.segment.read(&args.recordings)?;
    let mut measurement = measure(&recordings, &args.settings())?;
    check_folding(&mut measurement, &recordings, &args.settings().channels)?;
    let (table, calibration) = match (&args.housing, &args.tip) {
        (Some(housing), Some(tip)) => calibrate(
            &measurement.table,
            &FrfTable::read(housing)?,
            &FrfTable::read(tip)?,
        )?,
        _ => (measurement.table.clone(), Vec::new()),
    };
    for warning in &measurement.warnings {
        tracing::warn!("{warning}");
    }
    for target in &args.out {
        write(target, &table, args.uff_binary)?;
    }
    let answer = FrfOutput::new(&args, &measurement, &table, &calibration);
    let text = answer.text();
    args.output.answer_with(&understood, &answer, text)
}

fn write(target: &OutputFile, table: &FrfTable, is_binary: bool) -> Result<(), Error> {
    let title = "Frequency response functions";
    let draw = || frf_chart(title, table).map_err(Error::input);
    match target.format {
        FileFormat::Csv => table.write(&target.path)?,
        FileFormat::Uff => {
            let form = if is_binary { UffForm::Binary } else { UffForm::Text };
            table.write_uff(&target.path, form)?;
        }
        FileFormat::Svg => file::write(&target.path, draw()?.as_bytes())?,
        FileFormat::Html => {
            let body = html! {
                h1 { (title) }
                (figure(&draw()?, "Receptances: displacement (first letter) per force (second letter)."))
            };
            file::write(&target.path, page(title, &body).as_bytes())?;
        }
    }
    Ok(())
}

impl From<FrfError> for Error {
    fn from(error: FrfError) -> Self {
        match error {
            FrfError::File(cause) => cause.into(),
            FrfError::Recording(cause) => cause.into(),
            other => Self::input(other),
        }
    }
}
