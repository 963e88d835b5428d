//! `quietcut plan`: a search for the cheapest set of tests that reduces the uncertainty of the stability limits to a
//! given width.

use std::fmt::Write;
use std::path::{Path, PathBuf};

use serde::Serialize;

use super::{Endings, Error, Output, Range, assumed, positive, progress, speed_question};
use crate::case::Case;
use crate::file;
use crate::plan::{Means, Plan, Prior, Request, Step, Test, WithoutDerivative, plan, speeds_of_range};
use crate::report::page::{figure, page};
use crate::report::plan_chart::plan_chart;

/// Finds the fewest cuts and tests that reduce the 90 % intervals of all stability limits to a given width.
///
/// The standard deviations of the parameters stand in the case (keys that end in _std); for a case without such keys
/// the options --assume-… apply. The widest 90 % interval of a limit is the width of the chart.
#[derive(Debug, clap::Args)]
#[command(
    after_help = "Example:\n  quietcut plan tests/cases/kuka-kr90-acetal.toml --rpm 700:2000:40 --depth-mm 0:6:60 --width-percent 15 --out plan.svg\n  quietcut plan tests/cases/insperger-1dof-ad1.toml --rpm 5000:15000:40 --depth-mm 0:4:60 --width-percent 10 --json"
)]
pub struct Args {
    /// The case file: structure, tool, material, cut.
    #[arg(value_name = "CASE")]
    case: PathBuf,
    /// Spindle speeds in rev/min, first:last:count or first:last (61 speeds), whose intervals are listed. The tests follow
    /// from speeds of the plan's own over this range, at most 2.5 % apart, and do not depend on the count.
    #[arg(long, value_name = "R", value_parser = Range::positive)]
    rpm: Range,
    /// Axial depths in mm, first:last:count or first:last (61 depths). Limits are searched from depth 0 to the last, in
    /// steps no wider than these.
    #[arg(long, value_name = "R", value_parser = Range::non_negative)]
    depth_mm: Range,
    /// Required width of the 90 % interval of every stability limit, in percent of the limit.
    #[arg(long, value_name = "W", value_parser = positive, allow_negative_numbers = true)]
    width_percent: f64,
    /// Ignore the cubic terms of the structure: plan for the stability limits of the linear structure.
    #[arg(long)]
    linear: bool,
    #[command(flatten)]
    assumed: Assumed,
    #[command(flatten)]
    tests: Tests,
    /// Chart or page to write; the ending sets the format: svg or html. May be repeated.
    #[arg(long, value_name = "FILE", value_parser = Endings(&["svg", "html"]).parser())]
    out: Vec<PathBuf>,
    #[command(flatten)]
    output: Output,
}

/// Standard deviations that are assumed for the parameters of a case that states none.
#[derive(Debug, clap::Args)]
#[command(next_help_heading = "Standard deviations, where the case has no keys that end in _std")]
struct Assumed {
    /// Standard deviation assumed for every natural frequency, in percent of its value.
    #[arg(long, value_name = "P", default_value_t = 100.0 * Prior::default().frequency, value_parser = positive)]
    assume_frequency_percent: f64,
    /// Standard deviation assumed for every damping ratio, in percent of its value.
    #[arg(long, value_name = "P", default_value_t = 100.0 * Prior::default().damping, value_parser = positive)]
    assume_damping_percent: f64,
    /// Standard deviation assumed for every modal stiffness, in percent of its value.
    #[arg(long, value_name = "P", default_value_t = 100.0 * Prior::default().stiffness, value_parser = positive)]
    assume_stiffness_percent: f64,
    /// Standard deviation assumed for the cutting coefficients, in percent of their values.
    #[arg(long, value_name = "P", default_value_t = 100.0 * Prior::default().force, value_parser = positive)]
    assume_force_percent: f64,
}

/// Accuracy of the available tests.
#[derive(Debug, clap::Args)]
#[command(next_help_heading = "Tests")]
struct Tests {
    /// Final distance between the deepest stable and the shallowest unstable trial cut at one spindle speed, in percent
    /// of the limit.
    #[arg(long, value_name = "P", default_value_t = 100.0 * Means::default().bracket, value_parser = positive)]
    bracket_percent: f64,
    /// Standard deviation of a measured chatter frequency, in percent of the frequency.
    #[arg(long, value_name = "P", default_value_t = 100.0 * Means::default().chatter_frequency, value_parser = positive)]
    chatter_frequency_percent: f64,
    /// Number of impacts of a planned hammer test.
    #[arg(long = "blows", value_name = "N", default_value_t = Means::default().impacts as u16, value_parser = clap::value_parser!(u16).range(1..))]
    impacts: u16,
    /// Peak force of each impact of a planned hammer test, in N.
    #[arg(long, value_name = "F", default_value_t = Means::default().peak_n, value_parser = positive)]
    peak_n: f64,
    /// Noise density of the accelerometer of a hammer test, in µg per √Hz.
    #[arg(long, value_name = "N", default_value_t = 1e6 * Means::default().accelerometer_g_per_root_hertz, value_parser = positive)]
    noise_ug: f64,
    /// Standard deviation of the calibration: of the common gain of hammer and accelerometer, and of the gain of the
    /// dynamometer, in percent.
    #[arg(long, value_name = "P", default_value_t = 100.0 * Means::default().calibration, value_parser = positive)]
    calibration_percent: f64,
    /// Standard deviation of the change of each natural frequency from standstill, where hammer tests are made, to
    /// cutting, in percent.
    #[arg(long, value_name = "P", default_value_t = 100.0 * Means::default().standstill_frequency, value_parser = positive)]
    standstill_frequency_percent: f64,
    /// Standard deviation of the change of each damping ratio from standstill, where hammer tests are made, to cutting,
    /// in percent.
    #[arg(long, value_name = "P", default_value_t = 100.0 * Means::default().standstill_damping, value_parser = positive)]
    standstill_damping_percent: f64,
}

/// A plan, with the assumptions behind it and the speeds that it leaves out.
#[derive(Serialize)]
struct PlanOutput<'a> {
    #[serde(flatten)]
    plan: &'a Plan,
    /// Assumptions behind the structure of the case, one sentence each.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    assumed: Vec<String>,
    /// Speeds of --rpm outside the limits of the spindle, rev/min: no test is proposed there.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    outside_limits_rpm: Vec<f64>,
    /// True if the case has no section `[limits]`: every speed of --rpm is then taken as possible.
    #[serde(skip_serializing_if = "std::ops::Not::not")]
    assumes_every_speed: bool,
}

/// Runs the verb.
pub fn run(args: Args) -> Result<(), Error> {
    let mut case = Case::read(&args.case)?;
    speed_question::ask(&mut case, args.output)?;
    let mut request = request(&args);
    let outside_limits_rpm = leave_out_impossible(&case, args.rpm, &mut request)?;
    let bar = progress::bar(
        Some((request.speeds_rpm.len() + request.listed_rpm.len()) as u64),
        "{spinner} limits {bar:40} {pos}/{len} {elapsed}",
    );
    let found = plan(&case, &request, || bar.inc(1))?;
    bar.finish_and_clear();
    for warning in derivative_warnings(&found.without_derivative) {
        tracing::warn!("{}: {warning}", args.case.display());
    }
    for path in &args.out {
        write(&case, &found, request.depth_mm, path)?;
    }
    let assumed = case.assumptions();
    let mut output_text = text(&found);
    output_text.push_str(&assumed::lines(&assumed));
    output_text.push_str(&about_speeds(&case, &outside_limits_rpm));
    for path in &args.out {
        let _ = write!(output_text, "\n{}", path.display());
    }
    let answer = PlanOutput {
        plan: &found,
        assumed,
        outside_limits_rpm,
        assumes_every_speed: case.limits.is_none(),
    };
    args.output.answer(&answer, output_text)
}

/// Narrows the speeds of the request to the limits of the spindle, and returns the speeds of `--rpm` outside of them,
/// rev/min.
///
/// # Errors
/// No speed lies within the limits.
fn leave_out_impossible(case: &Case, rpm: Range, request: &mut Request) -> Result<Vec<f64>, Error> {
    let Some(limits) = &case.limits else {
        return Ok(Vec::new());
    };
    let (first, last) = (rpm.first().min(rpm.last()), rpm.first().max(rpm.last()));
    let possible = limits.allowed_rpm().into_iter().filter_map(|[from, to]| {
        let (from, to) = (
            from.max(first).max(limits.rpm_min),
            to.min(last).min(limits.rpm_max),
        );
        (from <= to).then(|| speeds_of_range([from, to]))
    });
    let possible: Vec<f64> = possible.flatten().collect();
    if possible.is_empty() {
        return Err(Error::input(format!(
            "--rpm: no speed lies within the limits of the spindle in {}, {} to {} rev/min",
            case.path.display(),
            limits.rpm_min,
            limits.rpm_max
        )));
    }
    request.speeds_rpm = possible;
    let listed = std::mem::take(&mut request.listed_rpm);
    let (listed, outside) = listed.into_iter().partition(|rpm| limits.allows(*rpm));
    request.listed_rpm = listed;
    Ok(outside)
}

/// Text about the speeds outside the limits of the spindle, or about limits that the case does not state; empty if
/// there is neither.
fn about_speeds(case: &Case, outside_limits_rpm: &[f64]) -> String {
    match &case.limits {
        None => {
            "\nthe case has no section [limits]: every speed is taken as possible; add rpm_min and rpm_max"
                .into()
        }
        Some(limits) if !outside_limits_rpm.is_empty() => format!(
            "\n{} speeds outside the limits of the spindle, {} to {} rev/min, are not considered",
            outside_limits_rpm.len(),
            limits.rpm_min,
            limits.rpm_max
        ),
        Some(_) => String::new(),
    }
}

/// Warnings about stability limits without derivatives with respect to the unknown parameters: one about first limits,
/// whose spindle speeds the plan leaves out, and one about lobes at larger depths; each only if there are such limits.
fn derivative_warnings(without_derivative: &[WithoutDerivative]) -> Vec<String> {
    let listed = |is_first: bool| -> Vec<String> {
        without_derivative
            .iter()
            .filter(|limit| limit.is_first == is_first)
            .map(|limit| {
                format!(
                    "{:.1} rev/min, {:.3} mm ({})",
                    limit.rpm, limit.depth_mm, limit.reason
                )
            })
            .collect()
    };
    let (first, deeper) = (listed(true), listed(false));
    let mut warnings = Vec::new();
    if !first.is_empty() {
        warnings.push(format!(
            "the limits at {} speeds have no derivatives with respect to the unknowns and are not considered: {}",
            first.len(),
            first.join("; ")
        ));
    }
    if !deeper.is_empty() {
        warnings.push(format!(
            "{} lobes above the first limit have no derivatives with respect to the unknowns; the intervals of the limits there do not \
             include that these lobes may become the lowest, and may be too narrow: {}",
            deeper.len(),
            deeper.join("; ")
        ));
    }
    warnings
}

fn request(args: &Args) -> Request {
    let share = |percent: f64| 0.01 * percent;
    let (assumed, tests) = (&args.assumed, &args.tests);
    Request {
        speeds_rpm: speeds_of_range([args.rpm.first(), args.rpm.last()]),
        listed_rpm: args.rpm.values(),
        depth_mm: args.depth_mm.first().max(args.depth_mm.last()),
        samples: args.depth_mm.steps_from_zero(),
        width: share(args.width_percent),
        prior: Prior {
            frequency: share(assumed.assume_frequency_percent),
            damping: share(assumed.assume_damping_percent),
            stiffness: share(assumed.assume_stiffness_percent),
            force: share(assumed.assume_force_percent),
        },
        means: Means {
            bracket: share(tests.bracket_percent),
            chatter_frequency: share(tests.chatter_frequency_percent),
            impacts: usize::from(tests.impacts),
            peak_n: tests.peak_n,
            accelerometer_g_per_root_hertz: 1e-6 * tests.noise_ug,
            calibration: share(tests.calibration_percent),
            standstill_frequency: share(tests.standstill_frequency_percent),
            standstill_damping: share(tests.standstill_damping_percent),
            ..Means::default()
        },
        linear: args.linear,
    }
}

/// Instruction for the machinist: how to carry out one planned test.
fn instruction(step: &Step) -> String {
    match &step.test {
        Test::Hammer { direction, impacts } => {
            format!(
                "{impacts} hammer impacts on the tool tip in {direction}; measure its acceleration in every direction"
            )
        }
        Test::Force {
            rpm,
            depth_mm,
            seconds,
        } => format!("cut on a dynamometer for {seconds} s at {rpm:.0} rev/min, {depth_mm:.3} mm"),
        Test::Cuts {
            rpm,
            about_mm,
            bracket_mm,
        } => format!(
            "{} cuts at {rpm:.0} rev/min that bracket the limit, near {about_mm:.3} mm, to {bracket_mm:.3} mm; note the chatter frequency",
            step.cuts_or_tests
        ),
    }
}

fn text(plan: &Plan) -> String {
    let mut text = format!(
        "widest 90 % interval of a limit: {:.1} % at {:.0} rev/min (median {:.1} %); required: {:.1} %",
        plan.before.widest_percent, plan.before.at_rpm, plan.before.median_percent, plan.wanted_percent
    );
    // Writing to a String cannot fail.
    if !plan.stated {
        let _ = write!(
            text,
            "\nthe case has no keys that end in _std; assumed: {}",
            plan.unknowns.join("; ")
        );
    }
    for (index, step) in plan.tests.iter().enumerate() {
        let _ = write!(
            text,
            "\n{:>2}. {}\n    then {:.1} % at {:.0} rev/min (median {:.1} %)",
            index + 1,
            instruction(step),
            step.after.widest_percent,
            step.after.at_rpm,
            step.after.median_percent
        );
    }
    let _ = match (plan.reached, plan.tests.is_empty()) {
        (true, true) => write!(text, "\nno test is needed"),
        (true, false) => write!(text, "\nreached with {} cuts and tests", plan.cuts_and_tests),
        (false, _) => write!(text, "\nnot reached with {} cuts and tests", plan.cuts_and_tests),
    };
    if let Some(obstacle) = &plan.obstacle {
        let _ = write!(
            text,
            ": with a thousand repetitions of every test the width is still {:.1} % at {:.0} rev/min",
            obstacle.at_best.widest_percent, obstacle.at_best.at_rpm
        );
        for one in &obstacle.if_known {
            let _ = write!(
                text,
                "\n    {:.1} % if this parameter were known exactly: {}",
                one.widest_percent, one.name
            );
        }
    }
    let has_limit = |rpm: &&f64| {
        let mut firsts = plan.without_derivative.iter().filter(|limit| limit.is_first);
        firsts.any(|limit| limit.rpm == **rpm)
    };
    let without = plan.without_limit_rpm.iter();
    let stable = without.filter(|rpm| !has_limit(rpm)).count();
    if stable > 0 {
        let _ = write!(
            text,
            "\n{stable} speeds are stable up to the last depth and are not considered"
        );
    }
    text
}

fn write(case: &Case, plan: &Plan, depth_mm: f64, path: &Path) -> Result<(), Error> {
    let title = format!("{}: limits before and after the tests", case.name);
    let picture = || plan_chart(&title, plan, depth_mm).map_err(Error::input);
    let text = match file::ending(path).as_str() {
        "svg" => picture()?,
        "html" => {
            let caption = "Grey: 90 % intervals of the limits from the case. Blue: 90 % intervals after the tests, if they confirm the \
                           case. Points: trial cuts that bracket a limit.";
            let body = maud::html! {
                h1 { (case.name) ": planned tests" }
                (figure(&picture()?, caption))
                (assumed::section(&case.assumptions()))
                pre { (self::text(plan)) }
            };
            page(&case.name, &body)
        }
        _ => {
            return Err(Error::input(format!(
                "{}: the ending of the file sets its format; .svg or .html is needed",
                path.display()
            )));
        }
    };
    Ok(file::write(path, text.as_bytes())?)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::plan::Width;

    #[test]
    fn listed_speeds_that_are_stable_are_counted_apart_from_those_without_derivatives() {
        let width = Width {
            widest_percent: 10.0,
            at_rpm: 900.0,
            median_percent: 10.0,
        };
        let without = |rpm| WithoutDerivative {
            rpm,
            depth_mm: 2.0,
            is_first: true,
            reason: "at the tip of an island".into(),
        };
        let mut plan = Plan {
            wanted_percent: 20.0,
            reached: true,
            cuts_and_tests: 0,
            unknowns: Vec::new(),
            stated: true,
            before: width,
            tests: Vec::new(),
            after: width,
            obstacle: None,
            without_limit_rpm: Vec::new(),
            // Two speeds of the plan's own, which it does not list.
            without_derivative: vec![without(910.0), without(930.0)],
            chart: Vec::new(),
        };
        assert!(!text(&plan).contains("stable up to"), "{}", text(&plan));
        plan.without_limit_rpm = vec![930.0, 1000.0];
        assert!(
            text(&plan).contains("\n1 speeds are stable up to"),
            "{}",
            text(&plan)
        );
    }

    #[test]
    fn every_limit_without_derivatives_is_listed_with_its_reason() {
        let limit = |rpm, is_first, reason: &str| WithoutDerivative {
            rpm,
            depth_mm: 2.0,
            is_first,
            reason: reason.into(),
        };
        assert!(derivative_warnings(&[]).is_empty());
        let warnings = derivative_warnings(&[
            limit(900.0, true, "at the tip of an island"),
            limit(950.0, false, "no motion"),
            limit(990.0, true, "not finite"),
        ]);
        let [first, deeper] = &warnings[..] else {
            panic!("{warnings:?}")
        };
        assert!(first.contains("limits at 2 speeds"), "{first}");
        assert!(
            first.contains("900.0 rev/min, 2.000 mm (at the tip of an island); 990.0"),
            "{first}"
        );
        assert!(
            deeper.contains("1 lobes above") && deeper.contains("(no motion)"),
            "{deeper}"
        );
    }
}
