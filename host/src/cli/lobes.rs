//! `quietcut lobes`: stability limits of a case over spindle speed, or Floquet multipliers at given points.

use std::fmt::Write;
use std::path::PathBuf;

use super::counted::counted_chart;
use super::lobes_files::{LobesOutput, ShownChart};
use super::lobes_rescaled::{RescaleOptions, RescaledCase};
use super::lobes_spindle::Spindle;
use super::lobes_spread::{intervals, percentiles};
use super::method::MethodChoice;
use super::varied::{self, Varied};
use super::{
    Endings, Error, Output, Range, assumed, lobes_cells, lobes_points, plausible_structure, speed_question,
};
use crate::case::Case;
use crate::report::marks::Mark;
use crate::stability::{Chart, Method, Resolution, Uncertainty};
use crate::trial_cuts::{self, Calls, TrialCut};

/// Computes stability limits over the spindle speed, or the dominant Floquet multiplier at given points.
#[derive(Debug, clap::Args)]
#[command(
    after_help = "Example:\n  quietcut lobes tests/cases/kuka-kr90-acetal.toml --rpm 900:1200:7 --depth-mm 0.1:4:40 --out lobes.svg\n  quietcut lobes tests/cases/kuka-kr90-acetal.toml --rpm 600:2400:200 --depth-mm 0.05:5:100 --cells --out cells.svg\n  quietcut lobes tests/cases/kuka-kr90-acetal.toml --at 1045,2 --at 900,2"
)]
pub struct Args {
    /// The case file: structure, tool, material, cut.
    #[arg(value_name = "CASE")]
    case: PathBuf,
    /// Case of the same machine whose structure holds at another spindle speed: both have rpm under [structure], 0 at
    /// standstill. Modes are interpolated over the speed. May be repeated.
    #[arg(long, value_name = "CASE", conflicts_with = "frf")]
    at_speed: Vec<PathBuf>,
    /// Spindle speeds in rev/min, first:last:count or first:last (61 speeds).
    #[arg(long, value_name = "R", value_parser = Range::positive)]
    rpm: Option<Range>,
    /// Axial depths in mm, first:last:count or first:last (61 depths). Limits are searched from depth 0 to the last, in
    /// steps no wider than these.
    #[arg(long, value_name = "R", value_parser = Range::non_negative)]
    depth_mm: Option<Range>,
    #[command(flatten)]
    method: MethodChoice,
    /// Compute the dominant Floquet multiplier and its error at every speed and depth, instead of the limits.
    #[arg(long)]
    cells: bool,
    #[command(flatten)]
    varied: Varied,
    /// Ignore the standard deviations of the case (keys that end in _std): compute only the limits of the nominal
    /// parameters.
    #[arg(long)]
    nominal: bool,
    /// Compute the probability of a stable cut at every speed and depth from the standard deviations of the case.
    #[arg(long, conflicts_with_all = ["nominal", "cells"])]
    probability: bool,
    /// Trial cuts, a CSV file with the columns rpm [rev/min], depth [mm] and outcome (stable, chatter, marginal), or
    /// the table that identify --method inverse-stability reads. The chart shows them, and wrong predictions are
    /// counted.
    #[arg(long, value_name = "FILE", conflicts_with = "cells")]
    cuts: Option<PathBuf>,
    #[command(flatten)]
    rescale: RescaleOptions,
    /// Compute the limits at the given speeds only. Without this option further speeds are added where limits bend, so
    /// that straight lines between all speeds are right to 1 % in depth or 0.1 % in speed; methods that need seconds
    /// per speed add none.
    #[arg(long, conflicts_with = "cells")]
    no_refine: bool,
    /// Seed of the random parameters that are drawn from the standard deviations.
    #[arg(long, value_name = "N", default_value_t = 1)]
    seed: u64,
    /// Chart or table to write; the ending sets the format: svg, html, csv or json; with --rescale also toml, the rescaled
    /// case. May be repeated.
    #[arg(long, value_name = "FILE", value_parser = Endings(&["svg", "html", "csv", "json", "toml"]).parser())]
    out: Vec<PathBuf>,
    /// Working point at which to compute the dominant Floquet multiplier: spindle speed in rev/min and axial depth in
    /// mm, as RPM,MM; may be repeated.
    #[arg(long, value_name = "RPM,MM", conflicts_with = "rpm", value_parser = working_point)]
    at: Vec<(f64, f64)>,
    #[command(flatten)]
    output: Output,
}

impl Args {
    /// Refuses a command without `--rpm` or without `--depth-mm`, unless it has `--at`, neither of these ranges and no
    /// option of a chart, such as `--cells` or `--out`. The message names each missing range.
    fn check(&self) -> Result<(), Error> {
        let has_range = self.rpm.is_some() || self.depth_mm.is_some();
        let missing: Vec<&str> = [
            (self.rpm.is_none(), "--rpm 900:1200:31 (rev/min)"),
            (self.depth_mm.is_none(), "--depth-mm 0.1:4:40 (mm)"),
        ]
        .into_iter()
        .filter_map(|(is_missing, option)| is_missing.then_some(option))
        .collect();
        let of_chart = [
            (self.cells, "--cells"),
            (self.nominal, "--nominal"),
            (self.probability, "--probability"),
            (self.cuts.is_some(), "--cuts"),
            (self.no_refine, "--no-refine"),
            (!self.out.is_empty(), "--out"),
        ];
        let needs_chart = of_chart
            .iter()
            .find(|(given, _)| *given)
            .map(|(_, option)| *option);
        if missing.is_empty() || (!self.at.is_empty() && !has_range && needs_chart.is_none()) {
            return Ok(());
        }
        let missing = missing.join(" and ");
        Err(Error::input(match needs_chart {
            Some(option) => format!("{option} belongs to a chart, which needs {missing} with your ranges"),
            None if has_range => format!("a chart needs {missing} with your range too"),
            None => format!(
                "a chart needs {missing} with your ranges; single points need --at RPM,MM, such as --at 1045,2"
            ),
        }))
    }
}

/// Runs the verb.
pub fn run(args: Args) -> Result<(), Error> {
    args.check()?;
    let mut case = read_case(&args)?;
    if args.rpm.is_some() {
        speed_question::ask(&mut case, args.output)?;
    }
    plausible_structure::warn(&case);
    args.method.announce()?;
    let maker = |case: &Case| args.method.on(case).map_err(|error| error.to_string());
    let cuts = args.cuts.as_deref().map(trial_cuts::read).transpose()?;
    let rescaled = args.rescale.of(&case, &maker, cuts.as_deref())?;
    if let Some(rescaled) = &rescaled {
        case = rescaled.case.clone();
    }
    let assumed = args.method.assumptions(&case)?;
    if args.cells || args.varied.variation().is_some() {
        for sentence in &assumed {
            tracing::warn!("{}: assumed: {sentence}", case.path.display());
        }
    }
    if let (Some(variation), Some(rpm), Some(depth_mm)) = (args.varied.variation(), args.rpm, args.depth_mm) {
        return varied::run(&case, &args.method, &variation, rpm, depth_mm, args.output);
    }
    let method = args.method.on(&case)?;
    match (args.rpm, args.depth_mm) {
        (Some(rpm), Some(depth_mm)) if args.cells => {
            let grid = (rpm, depth_mm);
            lobes_cells::run(&case, method.as_ref(), grid, &args.out, args.output)
        }
        (Some(rpm), Some(depth_mm)) => {
            let uncertainty = if args.nominal {
                None
            } else {
                Uncertainty::new(&case, &maker, args.seed)
            };
            let request = ChartRequest {
                rpm,
                depth_mm,
                probability: args.probability,
                refine: !args.no_refine && !method.takes_seconds(),
                cuts,
                rescaled,
                assumed,
            };
            run_chart(
                &case,
                method.as_ref(),
                uncertainty.as_ref(),
                request,
                &args.out,
                args.output,
            )
        }
        _ => lobes_points::run(&case, method.as_ref(), &args.at, &assumed, args.output),
    }
}

/// The case, with the structures of the cases of `--at-speed`.
fn read_case(args: &Args) -> Result<Case, Error> {
    let case = Case::read(&args.case).map_err(Error::input)?;
    if args.at_speed.is_empty() {
        return Ok(case);
    }
    let others = args.at_speed.iter().map(Case::read);
    let others = others.collect::<Result<Vec<_>, _>>().map_err(Error::input)?;
    case.with_structures_of(&others).map_err(Error::input)
}

struct ChartRequest {
    rpm: Range,
    depth_mm: Range,
    probability: bool,
    /// Whether stability limits are also computed at further speeds, where the limits bend.
    refine: bool,
    cuts: Option<Vec<TrialCut>>,
    /// The case with the natural frequencies of the trial cuts.
    rescaled: Option<RescaledCase>,
    /// Assumptions behind the structure, one sentence each.
    assumed: Vec<String>,
}

fn run_chart(
    case: &Case,
    method: &dyn Method,
    uncertainty: Option<&Uncertainty<'_>>,
    request: ChartRequest,
    out: &[PathBuf],
    output: Output,
) -> Result<(), Error> {
    let ChartRequest {
        rpm,
        depth_mm,
        probability,
        refine,
        cuts,
        rescaled,
        assumed,
    } = request;
    if probability && uncertainty.is_none() {
        return Err(Error::input(format!(
            "{}: --probability needs standard deviations in the case (keys that end in _std), such as ktc_mpa_std = 5.0 beside ktc_mpa, or a section [uncertainty]",
            case.path.display()
        )));
    }
    let deepest_mm = depth_mm.first().max(depth_mm.last());
    let mut chart = counted_chart(method, &rpm.values(), deepest_mm, depth_mm.steps_from_zero())?;
    if refine && rpm.count() > 1 {
        let teeth = case.tool.as_ref().map_or(1, |tool| tool.teeth);
        chart = chart.with_lines_between(method, deepest_mm, depth_mm.steps_from_zero(), teeth)?;
    }
    if let Some(uncertainty) = uncertainty {
        let cells_mm = if probability {
            depth_mm.values()
        } else {
            Vec::new()
        };
        chart = chart.with_spread(uncertainty, deepest_mm, &cells_mm)?;
    }
    if let Some(warning) = error_warning(&chart) {
        tracing::warn!("{}: {warning}", case.path.display());
    }
    let spindle = Spindle::of_chart(case, &chart)?;
    let calls = cuts.as_deref().map(|cuts| Calls::new(method, cuts)).transpose()?;
    let shown = ShownChart {
        case,
        chart: &chart,
        depth_mm: deepest_mm,
        marks: cuts.iter().flatten().map(Mark::from).collect(),
        assumed: &assumed,
        spindle: spindle.as_ref(),
        rescaled: rescaled.as_ref(),
    };
    for path in out {
        shown.write(path)?;
    }
    let mut text = limits_as_text(&chart, spindle.as_ref());
    if let Some(resolution) = &chart.resolution {
        text.push_str(&resolution_as_text(&chart, resolution));
    }
    if let Some(calls) = &calls {
        let _ = write!(
            text,
            "\n{} of {} trial cuts are predicted wrong: {} chattered and are predicted stable, {} were stable and are predicted unstable; {} undecided",
            calls.wrong, calls.cuts, calls.missed_chatter, calls.false_alarms, calls.undecided
        );
    }
    text.push_str(&spindle.as_ref().map_or_else(String::new, Spindle::as_text));
    text.push_str(&assumed::lines(&assumed));
    for path in out {
        let _ = write!(text, "\n{}", path.display());
    }
    let answer = LobesOutput {
        chart: &chart,
        cuts: calls,
        assumed: &assumed,
        spindle: spindle.as_ref(),
        rescaling: rescaled.as_ref().map(|rescaled| &rescaled.answer),
    };
    output.answer(&answer, text)
}

/// Warning about stability limits whose error cannot be computed, with the reason for each; `None` if there are no such
/// limits.
fn error_warning(chart: &Chart) -> Option<String> {
    let reasons: Vec<&str> = chart
        .lines()
        .into_iter()
        .flat_map(|line| line.without_error.iter().map(String::as_str))
        .collect();
    (!reasons.is_empty()).then(|| {
        format!(
            "the error of {} limits cannot be computed, and is stated as the last depth: {}",
            reasons.len(),
            reasons.join("; ")
        )
    })
}

fn limits_as_text(chart: &Chart, spindle: Option<&Spindle>) -> String {
    let mut text = format!(
        "method: {}\n  rev/min  first limit [mm]  kind   chatter [Hz]  stable [mm]",
        chart.label
    );
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
        for [from, to] in &line.bistable_mm {
            let _ = write!(
                text,
                "; bistable {from:.3}–{to:.3}: stable unless something knocks the tool"
            );
        }
        if let Some(spread) = &line.spread {
            text.push_str("; 5, 50, 95 % percentiles of the limit:");
            let both = percentiles(spread, "beyond")
                .into_iter()
                .zip(intervals(spread, "beyond"));
            for (percentile, [from, to]) in both {
                let _ = write!(text, " {percentile} ({from}–{to})");
            }
        }
        text.push_str(&spindle.map_or_else(String::new, |spindle| spindle.beside(line.rpm)));
    }
    text
}

/// Text about the resolution of a stability chart: the number of added spindle speeds, the error of straight lines
/// between neighbouring speeds, the width of the narrowest island, and the number of gaps between speeds in which the
/// verdict may be open.
fn resolution_as_text(chart: &Chart, resolution: &Resolution) -> String {
    let mut text = format!(
        "\n{} further speeds; straight lines between all speeds are right to {} % in depth or {} % in speed",
        chart.refined.len(),
        100.0 * resolution.depth_share,
        100.0 * resolution.speed_share
    );
    if let Some(rpm) = resolution.narrowest_island_rpm {
        let _ = write!(text, "; the narrowest island is {rpm:.1} rev/min wide");
    }
    let open = resolution.unresolved_rpm.len();
    if open > 0 {
        let _ = write!(
            text,
            "; over {open} gaps stable depths begin or end, and the verdict is open where both ends differ"
        );
    }
    text
}

/// Parses `RPM,MM` or `RPM:MM` into spindle speed in rev/min and axial depth in mm.
fn working_point(text: &str) -> Result<(f64, f64), String> {
    let (rpm, depth_mm) = text
        .split_once([',', ':'])
        .ok_or_else(|| format!("`{text}` is not of the form RPM,MM, such as 1045,2"))?;
    Ok((super::positive(rpm)?, super::non_negative(depth_mm)?))
}
