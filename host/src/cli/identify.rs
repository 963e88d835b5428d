//! `quietcut identify`: structural and cutting parameters with 90 % intervals from recordings.

mod answer;
mod args;
mod backbone;
mod backbone_answer;
mod checks;
mod comments;
mod cutting;
mod figure;
mod force_and_motion;
mod joints;
mod methods;
mod mode_lines;
mod mode_options;
mod mode_shapes;
mod mode_shapes_answer;
mod modes;
mod modes_comparison;
mod point_options;
mod records;
mod stabilization_diagram;
mod without_force;
mod written;

use std::path::{Path, PathBuf};

use clap::ValueEnum;

use super::Error;
use super::output::{Endings, keep_inputs};
use super::segment::Recorded;
use crate::case::Case;
use crate::criteria::SAME_SPINDLE_SPEED;
use crate::machine::spindle_rpm;
use crate::report::digits::significant;
use answer::IdentifyOutput;
pub use args::Args;
use args::Method;

/// Refuses, before anything is read, a file of `--out` whose format the method does not write.
fn check_endings(args: &Args) -> Result<(), Error> {
    for path in &args.out {
        let Err(right) = Endings(args.method.endings()).checked(&path.to_string_lossy()) else {
            continue;
        };
        let ending = crate::file::ending(path);
        let others: Vec<String> = Method::value_variants()
            .iter()
            .filter(|method| method.endings().contains(&ending.as_str()))
            .map(|method| method.name())
            .collect();
        let what = match ending.as_str() {
            "csv" => "table",
            "svg" => "picture",
            _ => "case",
        };
        return Err(Error::input(format!(
            "--out {}: --method {} writes no {what}; methods that do: {}; {right}",
            path.display(),
            args.method.name(),
            others.join(", ")
        )));
    }
    Ok(())
}

/// Runs the verb.
pub fn run(args: Args) -> Result<(), Error> {
    check_endings(&args)?;
    for out in &args.out {
        keep_inputs(args.recordings.iter().map(PathBuf::as_path), out)?;
    }
    if let Some(other) = args
        .modes
        .compare
        .as_ref()
        .filter(|_| args.method != Method::Modes)
    {
        return Err(Error::input(format!(
            "--compare {}: it compares modes; --method modes is needed",
            other.display()
        )));
    }
    let mut points = args.points.force_at.iter().chain(&args.points.sensor_at);
    if let Some(point) = points.next().filter(|_| args.method != Method::ModeShapes) {
        return Err(Error::input(format!(
            "--force-at and --sensor-at ({point}): they name points of a roving test; --method mode-shapes is needed"
        )));
    }
    if let Some(rpm) = args.rpm.filter(|_| args.method == Method::ForceCoefficients) {
        return Err(Error::input(format!(
            "--rpm {rpm}: it is the speed at which a structure was measured, and --method force-coefficients identifies none; leave it out"
        )));
    }
    let others = match args.method {
        Method::Joints | Method::InverseStability => args.case.as_deref().or(args.start.as_deref()),
        _ => args.case.as_deref(),
    };
    let other = others.map(sections).transpose()?;
    let Recorded {
        recordings,
        mut understood,
    } = match args.method {
        Method::InverseStability | Method::Modes => Recorded::default(),
        _ => args.segment.read(&args.recordings)?,
    };
    let mut answer = match args.method {
        Method::HarmonicBalance => methods::harmonic_balance(&args, &recordings)?,
        Method::Hfrf => methods::hfrf(&args, &recordings)?,
        Method::RestoringForce => records::restoring_force(&args, &recordings)?,
        Method::Ncma => methods::ncma(&args, &recordings)?,
        Method::Backbone => backbone::backbone(&args, &recordings)?,
        Method::ModeShapes => mode_shapes::mode_shapes(&args, &recordings)?,
        Method::Linearity => checks::linearity(&args, &recordings)?,
        Method::OutputOnly => without_force::output_only(&args, &recordings)?,
        Method::InverseStability => without_force::inverse_stability(&args)?,
        Method::Joints => joints::joints(&args, &recordings)?,
        Method::ForceCoefficients => cutting::force_coefficients(&args, &recordings)?,
        Method::Modes => modes::modes(&args, &mut understood)?,
    };
    let recorded_rpm = answer.structure_rpm.or_else(|| spindle_rpm(&recordings));
    answer
        .warnings
        .extend(args.rpm.zip(recorded_rpm).and_then(other_speed));
    answer.structure_rpm = args.rpm.or(recorded_rpm);
    if args.method == Method::ForceCoefficients {
        answer.structure_rpm = None;
    }
    let lines = text(&answer);
    written::write(&args.out, &mut answer, other.as_ref(), &lines)?;
    for warning in &answer.warnings {
        tracing::warn!("{warning}");
    }
    args.output.answer_with(&understood, &answer, text(&answer))
}

/// Warning about a speed of `--rpm`, rev/min, that is not the one of the tachometer in the recordings; `None` if they agree.
fn other_speed((given_rpm, recorded_rpm): (f64, f64)) -> Option<String> {
    let is_same = (given_rpm - recorded_rpm).abs() <= SAME_SPINDLE_SPEED * given_rpm.max(recorded_rpm);
    (!is_same).then(|| {
        let recorded = significant(recorded_rpm, DIGITS);
        format!("--rpm {given_rpm}: the tachometer in the recordings says {recorded} rev/min; leave --rpm out to keep that speed")
    })
}

/// Content of the case file at `path` as a TOML table, after a check that it is a valid case.
fn sections(path: &Path) -> Result<toml::Table, Error> {
    Case::read(path).map_err(Error::input)?;
    let text = crate::file::read_text(path)?;
    text.parse()
        .map_err(|error| Error::input(format!("{}: {error}", path.display())))
}

/// Number of significant digits of the parameters of [`IdentifyOutput::models`] in the text output: a choice.
const DIGITS: usize = 6;

fn text(answer: &IdentifyOutput) -> String {
    let mut lines = Vec::new();
    for model in &answer.models {
        for (key, figure) in &model.parameters {
            let [low, high] = figure.ci90;
            lines.push(format!(
                "{}{key} = {}, 90 % interval {} to {}",
                model.label(),
                significant(figure.value, DIGITS),
                significant(low, DIGITS),
                significant(high, DIGITS)
            ));
        }
    }
    lines.extend(answer.messages.iter().cloned());
    if let Some(error) = answer.fit_error {
        lines.push(format!(
            "fit error {:.3} % (root mean square, relative to the data)",
            100.0 * error
        ));
    }
    match answer.structure_rpm {
        Some(0.0) => {
            lines.push("measured at standstill: the modes of a running spindle may be others".into())
        }
        Some(rpm) => lines.push(format!("measured at {} rev/min", significant(rpm, DIGITS))),
        None => (),
    }
    for path in &answer.out {
        lines.push(format!("written to {}", path.display()));
    }
    lines.join("\n")
}
