//! `quietcut lobes`: where a case is stable.

use std::fmt::Write;
use std::path::{Path, PathBuf};

use serde::Serialize;

use super::{Error, Output, Range};
use crate::case::Case;
use crate::continuation::{self, ForcedProblem};
use crate::file;
use crate::report::lobe_chart::{Column, lobe_chart};
use crate::report::page::{figure, page};
use crate::stability::{Chart, CubicTerms, Point, Problem, SpeedLine, StabilityError, chart, point};

/// Stability limits over speed, or the dominant multiplier at points.
#[derive(Debug, clap::Args)]
#[command(
    after_help = "Example:\n  quietcut lobes tests/cases/kuka-kr90-acetal.toml --rpm 900:1200:7 --depth-mm 0.1:4:40 --out lobes.svg\n  quietcut lobes tests/cases/kuka-kr90-acetal.toml --at 1045,2 --at 900,2"
)]
pub struct Args {
    /// The case file: structure, tool, material, cut.
    #[arg(value_name = "CASE")]
    case: PathBuf,
    /// Spindle speeds in rev/min, first:last:count.
    #[arg(long, value_name = "R", value_parser = Range::positive, requires = "depth_mm", required_unless_present = "at")]
    rpm: Option<Range>,
    /// Axial depths in mm, first:last:count. Limits are searched from depth 0 to the last, in steps no wider than these.
    #[arg(long, value_name = "R", value_parser = Range::positive, requires = "rpm")]
    depth_mm: Option<Range>,
    /// How to compute: collocation of the one-period map.
    #[arg(long, value_enum, default_value_t)]
    method: Method,
    /// Leave out the cubic terms of a structure: the limits for vanishing feed.
    #[arg(long)]
    linear: bool,
    /// Chart or table to write: svg, html, csv or json by its ending.
    #[arg(long, value_name = "FILE", requires = "rpm")]
    out: Option<PathBuf>,
    /// A point, RPM,MM; may be given again.
    #[arg(long, value_name = "RPM,MM", conflicts_with = "rpm", value_parser = working_point)]
    at: Vec<(f64, f64)>,
    #[command(flatten)]
    output: Output,
}

/// The methods that can be asked for.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, clap::ValueEnum)]
enum Method {
    /// Collocation of the one-period map.
    #[default]
    Collocation,
}

#[derive(Serialize)]
struct Points {
    points: Vec<Point>,
}

/// Runs the verb.
pub fn run(args: Args) -> Result<(), Error> {
    let Method::Collocation = args.method;
    let case = Case::read(&args.case).map_err(Error::input)?;
    let is_nonlinear = case.structure().map_err(Error::input)?.is_nonlinear();
    let model = if is_nonlinear && !args.linear {
        Model::Nonlinear(ForcedProblem::new(&case)?)
    } else {
        Model::Linear(Problem::new(&case, CubicTerms::LeaveOut)?)
    };
    match (args.rpm, args.depth_mm) {
        (Some(rpm), Some(depth_mm)) => run_chart(&case, &model, rpm, depth_mm, args.out, args.output),
        _ => run_points(&model, &args.at, args.output),
    }
}

/// What multipliers are computed about.
enum Model {
    /// Rest: the limits do not depend on the forced motion.
    Linear(Problem),
    /// The forced orbit at the feed of the case.
    Nonlinear(ForcedProblem),
}

impl Model {
    fn point(&self, rpm: f64, depth_mm: f64) -> Result<Point, StabilityError> {
        match self {
            Self::Linear(problem) => point(problem, rpm, depth_mm),
            Self::Nonlinear(problem) => continuation::point(problem, rpm, depth_mm),
        }
    }

    fn chart(&self, speeds_rpm: &[f64], depth_mm: f64, samples: usize) -> Result<Chart, StabilityError> {
        match self {
            Self::Linear(problem) => chart(problem, speeds_rpm, depth_mm, samples),
            Self::Nonlinear(problem) => continuation::chart(problem, speeds_rpm, depth_mm),
        }
    }
}

fn run_points(model: &Model, at: &[(f64, f64)], output: Output) -> Result<(), Error> {
    let points = at
        .iter()
        .map(|&(rpm, depth_mm)| model.point(rpm, depth_mm))
        .collect::<Result<Vec<_>, _>>()?;
    let mut text = String::new();
    for point in &points {
        let chatter = point
            .chatter_hz
            .map_or_else(String::new, |hz| format!(", {hz:.2} Hz"));
        let separator = if text.is_empty() { "" } else { "\n" };
        // Writing to a String cannot fail.
        let _ = write!(
            text,
            "{separator}{} rev/min, {} mm: {}, |multiplier| = {:.6} ± {:.0e} ({}{chatter})",
            point.rpm,
            point.depth_mm,
            point.verdict.name(),
            point.multiplier_abs,
            point.error,
            point.kind.name(),
        );
    }
    output.answer(&Points { points }, text)
}

fn run_chart(
    case: &Case,
    model: &Model,
    rpm: Range,
    depth_mm: Range,
    out: Option<PathBuf>,
    output: Output,
) -> Result<(), Error> {
    let deepest_mm = depth_mm.first().max(depth_mm.last());
    let widest_step_mm = (depth_mm.last() - depth_mm.first()).abs() / depth_mm.count().max(2) as f64;
    let samples = if widest_step_mm > 0.0 {
        (deepest_mm / widest_step_mm).ceil() as usize
    } else {
        depth_mm.count()
    };
    let chart = model.chart(&rpm.values(), deepest_mm, samples)?;
    if let Some(path) = &out {
        write_chart(case, &chart, deepest_mm, path)?;
    }
    let mut text = limits_as_text(&chart);
    if let Some(path) = &out {
        let _ = write!(text, "\n{}", path.display());
    }
    output.answer(&chart, text)
}

fn limits_as_text(chart: &Chart) -> String {
    let mut text = String::from("  rev/min  first limit [mm]  kind   chatter [Hz]  stable [mm]");
    for line in &chart.speeds {
        let stable: Vec<String> = line
            .stable_mm
            .iter()
            .map(|[from, to]| format!("{from:.3}–{to:.3}"))
            .collect();
        let (depth, kind, chatter) = match line.first_limit {
            Some(limit) => (
                format!("{:.4}", limit.depth_mm),
                limit.kind.name(),
                limit.chatter_hz.map_or_else(String::new, |hz| format!("{hz:.2}")),
            ),
            None => ("none".into(), "", String::new()),
        };
        let _ = write!(
            text,
            "\n{:>9.1}  {depth:>16}  {kind:<5}  {chatter:>12}  {}",
            line.rpm,
            stable.join(", ")
        );
    }
    text
}

fn write_chart(case: &Case, chart: &Chart, depth_mm: f64, path: &Path) -> Result<(), Error> {
    let ending = path
        .extension()
        .map(|ending| ending.to_string_lossy().to_lowercase());
    let text = match ending.as_deref() {
        Some("json") => serde_json::to_string(chart).map_err(Error::other)?,
        Some("csv") => as_csv(chart)?,
        Some("svg") => picture(case, chart, depth_mm)?,
        Some("html") => as_page(case, chart, depth_mm)?,
        _ => {
            return Err(Error::input(format!(
                "{}: the ending says what to write; .svg, .html, .csv or .json is needed",
                path.display()
            )));
        }
    };
    Ok(file::write(path, text.as_bytes())?)
}

fn picture(case: &Case, chart: &Chart, depth_mm: f64) -> Result<String, Error> {
    let mut columns: Vec<Column> = chart.speeds.iter().map(Column::from).collect();
    columns.sort_by(|a, b| a.rpm.total_cmp(&b.rpm));
    // What can be wrong with a picture is what was asked for: a single speed.
    lobe_chart(&case.name, &columns, depth_mm, &[]).map_err(Error::input)
}

fn as_page(case: &Case, chart: &Chart, depth_mm: f64) -> Result<String, Error> {
    let svg = picture(case, chart, depth_mm)?;
    let caption = format!(
        "Stable depths over spindle speed, by {}. Lines: where stability is first lost.",
        chart.method
    );
    let body = maud::html! {
        h1 { (case.name) }
        (figure(&svg, &caption))
        h2 { "Limits" }
        table {
            tr { th { "rev/min" } th { "first limit [mm]" } th { "kind" } th { "chatter [Hz]" } th { "stable [mm]" } }
            @for line in &chart.speeds { (row(line)) }
        }
    };
    Ok(page(&case.name, &body))
}

fn row(line: &SpeedLine) -> maud::Markup {
    let stable: Vec<String> = line
        .stable_mm
        .iter()
        .map(|[from, to]| format!("{from:.3} to {to:.3}"))
        .collect();
    maud::html! {
        tr {
            td { (format!("{:.1}", line.rpm)) }
            @if let Some(limit) = line.first_limit {
                td { (format!("{:.4}", limit.depth_mm)) }
                td { (limit.kind.name()) }
                td { @if let Some(hz) = limit.chatter_hz { (format!("{hz:.2}")) } }
            } @else {
                td { "none" } td {} td {}
            }
            td { (stable.join(", ")) }
        }
    }
}

/// One row per switch; a speed without any has one row with nothing but its speed.
fn as_csv(chart: &Chart) -> Result<String, Error> {
    let mut writer = csv::Writer::from_writer(Vec::new());
    writer
        .write_record([
            "rpm [rev/min]",
            "depth [mm]",
            "kind",
            "gain",
            "chatter [Hz]",
            "first",
        ])
        .map_err(Error::other)?;
    for line in &chart.speeds {
        let rpm = line.rpm.to_string();
        if line.switches.is_empty() {
            writer
                .write_record([&rpm, "", "", "", "", ""])
                .map_err(Error::other)?;
        }
        for switch in &line.switches {
            let first = line
                .first_limit
                .is_some_and(|limit| limit.depth_mm == switch.depth_mm);
            writer
                .write_record([
                    rpm.as_str(),
                    &switch.depth_mm.to_string(),
                    switch.kind.name(),
                    &switch.gain.to_string(),
                    &switch.chatter_hz.map_or_else(String::new, |hz| hz.to_string()),
                    &first.to_string(),
                ])
                .map_err(Error::other)?;
        }
    }
    let bytes = writer.into_inner().map_err(Error::other)?;
    String::from_utf8(bytes).map_err(Error::other)
}

/// `RPM,MM`.
fn working_point(text: &str) -> Result<(f64, f64), String> {
    let (rpm, depth_mm) = text
        .split_once(',')
        .ok_or_else(|| format!("`{text}` is not of the form RPM,MM, such as 1045,2"))?;
    Ok((super::positive(rpm)?, super::non_negative(depth_mm)?))
}
