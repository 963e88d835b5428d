//! A search for the cheapest set of tests that narrows the 90 % intervals of the stability limits of a lobe chart to a
//! given width.
//!
//! The uncertain parameters of a machine have a normal distribution (`unknowns`). Exact derivatives propagate it to
//! every limit (`chart`). The Fisher information of every test (`candidate`) follows from exact derivatives or from
//! central differences. After a set of tests with the Fisher information J_t each, Λ = I + Σ J_t is the inverse
//! covariance of the parameters, in units of the prior standard deviations. `selection` searches for the cheapest set
//! of tests after which all limits are narrow enough.

mod candidate;
mod chart;
mod means;
mod selection;
mod speeds;
mod unknowns;

#[cfg(test)]
mod tests;

use nalgebra::DMatrix;
use rayon::prelude::*;
use serde::Serialize;

pub use candidate::Test;
pub use chart::WithoutDerivative;
pub use means::Means;
pub use speeds::speeds_of_range;
pub use unknowns::Prior;

use candidate::{Candidate, candidates};
use chart::{KnownChart, KnownLimit};
use quietcut_model::case::Case;
use quietcut_stability::{CubicTerms, Linearized, Problem, SpeedLine, StabilityError, line};
use selection::{Chosen, Selection};
use unknowns::Unknowns;

/// Request of a plan: chart, required width of the limits' intervals, prior of the parameters, and properties of the
/// tests.
#[derive(Clone, Debug, PartialEq)]
pub struct Request {
    /// Spindle speeds of the chart, rev/min; [`speeds_of_range`] gives those of a range.
    pub speeds_rpm: Vec<f64>,
    /// Spindle speeds whose intervals the plan lists, rev/min; empty: those of the chart. They influence no test.
    pub listed_rpm: Vec<f64>,
    /// Largest axial depth up to which stability limits are searched, mm.
    pub depth_mm: f64,
    /// Number of equal steps in axial depth over which Floquet multipliers are followed, before refinement.
    pub samples: usize,
    /// Required width of the 90 % interval of every stability limit, relative to the limit.
    pub width: f64,
    /// Relative standard deviations of the uncertain parameters, for a case that states none.
    pub prior: Prior,
    /// Properties of the possible tests.
    pub means: Means,
    /// True to leave out cubic terms of the structure; otherwise a case with cubic terms is refused.
    pub linear: bool,
}

/// Reason why a plan of tests cannot be computed.
#[derive(Debug, thiserror::Error)]
pub enum PlanError {
    /// The case is refused, for example for its cubic terms; the case is invalid after a change of an unknown parameter
    /// in either direction; or its stability at a speed of the chart cannot be computed.
    #[error(transparent)]
    Stability(#[from] StabilityError),
    /// At no speed of the chart is stability lost up to the largest depth.
    #[error(
        "{case}: at none of the {speeds} speeds is stability lost up to {depth_mm} mm; ask for a greater --depth-mm"
    )]
    NoLimit {
        /// Path of the case file.
        case: String,
        /// Number of speeds of the chart.
        speeds: usize,
        /// Largest depth of the chart, mm.
        depth_mm: f64,
    },
    /// No first stability limit of the chart has derivatives by the unknown parameters, no parameter is unknown, the
    /// modes of the structure cannot be computed, or the Fisher information of a test cannot be computed.
    #[error("{case}: limits have no derivatives with respect to the unknowns: {what}")]
    NoDerivatives {
        /// Path of the case file.
        case: String,
        /// Reason why no plan can be computed: of the limits, of the unknown parameters or of a test.
        what: String,
    },
}

/// Width of the 90 % intervals of the stability limits over the speeds of the chart, in percent of the limits.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Width {
    /// Width of the widest 90 % interval of a stability limit in the chart, percent of that limit.
    pub widest_percent: f64,
    /// Spindle speed with the widest interval of the stability limit, rev/min.
    pub at_rpm: f64,
    /// Median over the speeds (of an even number, the upper of the two middle values) of the widths of the limits' 90 %
    /// intervals, percent of the limits.
    pub median_percent: f64,
}

/// A spindle speed of the chart with its stability limit and the 90 % intervals of the limit.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Speed {
    /// Spindle speed, rev/min.
    pub rpm: f64,
    /// First stability limit of the nominal case, mm.
    pub limit_mm: f64,
    /// 90 % interval of the stability limit before any test, mm.
    pub before_mm: [f64; 2],
    /// 90 % interval of the stability limit after all tests of the plan, mm, if the tests confirm the nominal case.
    pub after_mm: [f64; 2],
}

/// A test of the plan with its cost and its effect on the limits' intervals.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Step {
    /// The test.
    #[serde(flatten)]
    pub test: Test,
    /// Number of cuts of a test that brackets a limit; 1 for every other test.
    pub cuts_or_tests: usize,
    /// Width of the limits' 90 % intervals after this test and all before it.
    pub after: Width,
}

/// Reason why the plan does not reach the required width of the limits' intervals.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Obstacle {
    /// Width of the limits' 90 % intervals if every candidate test is repeated a thousand times.
    pub at_best: Width,
    /// Up to three unknown parameters whose exact values would then narrow the widest interval of a limit most, the
    /// most effective first. Empty if a thousand repetitions of every test reach the required width.
    pub if_known: Vec<IfKnown>,
}

/// An unknown parameter, and the width of the widest interval of a limit if its value were exact and every candidate
/// test were repeated a thousand times.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct IfKnown {
    /// Name of the unknown.
    pub name: String,
    /// Width of the widest 90 % interval of a limit if the unknown parameter were exact and every candidate test were
    /// repeated a thousand times, percent of that limit.
    pub widest_percent: f64,
}

/// The cheapest set of tests found that narrows the stability limits of a chart to the required width, and its effect.
/// If no set is found that reaches this width, `obstacle` states the reason.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Plan {
    /// The required width, percent.
    pub wanted_percent: f64,
    /// True if the tests reach the required width of every limit's interval.
    pub reached: bool,
    /// Total number of cuts and other tests in the plan.
    pub cuts_and_tests: usize,
    /// Names of the unknown parameters, including differences at standstill and sensor gains, each with its standard
    /// deviation in percent where it is assumed.
    pub unknowns: Vec<String>,
    /// True if the case states uncertainties of its parameters; otherwise those of the request's prior are assumed.
    pub stated: bool,
    /// Width of the limits' 90 % intervals before any test.
    pub before: Width,
    /// The tests in the order in which to carry them out.
    pub tests: Vec<Step>,
    /// Width of the limits' 90 % intervals after all tests of the plan.
    pub after: Width,
    /// Reason why the required width is not reached; `None` if it is.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub obstacle: Option<Obstacle>,
    /// Spindle speeds that the plan does not list, rev/min: without a stability limit up to the largest depth, or with a
    /// first limit without derivatives.
    pub without_limit_rpm: Vec<f64>,
    /// First limits and deeper lobes without derivatives with respect to the unknown parameters at the speeds of the
    /// chart and at the listed ones, with the reasons.
    #[serde(skip)]
    pub without_derivative: Vec<WithoutDerivative>,
    /// The listed spindle speeds that have a stability limit with derivatives.
    pub chart: Vec<Speed>,
}

/// Number of repetitions of every candidate test that stands for unlimited repetition. A choice.
const AT_BEST: f64 = 1000.0;

/// The cheapest set of tests found after which the 90 % interval of every stability limit of the chart has at most the
/// required width. If no such set is found, [`Plan::obstacle`] states the reason. Calls `progress` after each speed.
///
/// Intervals follow from limits that are linearized in the unknown parameters: they hold for machines whose parameters
/// lie within a few standard deviations of the case. At each speed the lowest of several lobes counts.
///
/// # Errors
/// See [`PlanError`].
pub fn plan(case: &Case, request: &Request, progress: impl Fn() + Sync) -> Result<Plan, PlanError> {
    let basis = Basis::new(case, request, progress)?;
    let selection = Selection::new(&basis.chart, &basis.candidates, request.width);
    let chosen = selection.fewest();
    Ok(basis.plan(request, &selection, &chosen))
}

/// Error of a chart in which no speed has a limit with derivatives: the reason of the first limit without derivatives,
/// or that no speed has a limit.
fn no_known_limit(case: &Case, request: &Request, without_derivative: &[WithoutDerivative]) -> PlanError {
    let case = case.path.display().to_string();
    match without_derivative.iter().find(|limit| limit.is_first) {
        Some(limit) => PlanError::NoDerivatives {
            case,
            what: limit.reason.clone(),
        },
        None => PlanError::NoLimit {
            case,
            speeds: request.speeds_rpm.len(),
            depth_mm: request.depth_mm,
        },
    }
}

/// Data of a plan: unknowns, linearized limits and candidate tests.
struct Basis {
    unknowns: Unknowns,
    chart: KnownChart,
    /// Limits at the speeds that the plan lists; `None` if they are those of `chart`.
    listed: Option<KnownChart>,
    candidates: Vec<Candidate>,
    without_limit_rpm: Vec<f64>,
    without_derivative: Vec<WithoutDerivative>,
}

/// Linearized limits at some spindle speeds.
struct Limits {
    chart: KnownChart,
    /// Speeds without a first limit that has derivatives, rev/min.
    without_limit_rpm: Vec<f64>,
    without_derivative: Vec<WithoutDerivative>,
}

impl Limits {
    fn new(lines: &[SpeedLine], linearized: &Linearized, unknowns: usize) -> Self {
        let (limits, without_derivative): (Vec<Option<KnownLimit>>, Vec<Vec<WithoutDerivative>>) = lines
            .par_iter()
            .map(|line| KnownLimit::new(line, linearized, unknowns))
            .unzip();
        let without = lines.iter().zip(&limits).filter(|(_, limit)| limit.is_none());
        Self {
            without_limit_rpm: without.map(|(line, _)| line.rpm).collect(),
            without_derivative: without_derivative.into_iter().flatten().collect(),
            chart: KnownChart::new(limits.into_iter().flatten().collect()),
        }
    }
}

impl Basis {
    fn new(case: &Case, request: &Request, progress: impl Fn() + Sync) -> Result<Self, PlanError> {
        let cubic = if request.linear {
            CubicTerms::LeaveOut
        } else {
            CubicTerms::Refuse
        };
        let problem = Problem::new(case, cubic)?;
        let no_derivatives = |what| PlanError::NoDerivatives {
            case: case.path.display().to_string(),
            what,
        };
        let unknowns = Unknowns::new(case, &request.prior, &request.means).map_err(no_derivatives)?;
        let linearized = Linearized::new(case, &unknowns.variables)?;
        let at = |speeds_rpm: &[f64]| {
            let lines: Vec<Result<SpeedLine, StabilityError>> = speeds_rpm
                .par_iter()
                .map(|&rpm| {
                    let found = line(&problem, rpm, request.depth_mm, request.samples);
                    progress();
                    found
                })
                .collect();
            let lines = lines.into_iter().collect::<Result<Vec<_>, _>>()?;
            Ok::<_, PlanError>(Limits::new(&lines, &linearized, unknowns.len()))
        };
        let Limits {
            chart,
            mut without_limit_rpm,
            mut without_derivative,
        } = at(&request.speeds_rpm)?;
        if chart.limits.is_empty() {
            return Err(no_known_limit(case, request, &without_derivative));
        }
        let mut listed = None;
        if !request.listed_rpm.is_empty() {
            let limits = at(&request.listed_rpm)?;
            without_limit_rpm = limits.without_limit_rpm;
            let further = limits.without_derivative.into_iter();
            let is_known = |limit: &WithoutDerivative| request.speeds_rpm.contains(&limit.rpm);
            without_derivative.extend(further.filter(|limit| !is_known(limit)));
            listed = Some(limits.chart);
        }
        let candidates = candidates(case, &problem, &unknowns, &chart, &request.means)
            .map_err(|error| no_derivatives(error.to_string()))?;
        Ok(Self {
            unknowns,
            chart,
            listed,
            candidates,
            without_limit_rpm,
            without_derivative,
        })
    }

    fn plan(&self, request: &Request, selection: &Selection<'_>, chosen: &[Chosen]) -> Plan {
        let nothing = selection.information(&[]);
        let everything = selection.information(chosen);
        let mut tests = Vec::new();
        for (index, one) in chosen.iter().enumerate() {
            let information = selection.information(&chosen[..=index]);
            tests.push(Step {
                test: self.candidates[one.candidate].test.clone(),
                cuts_or_tests: one.cost,
                after: self.width(&information),
            });
        }
        let after = self.width(&everything);
        let reached = selection.is_reached(&everything);
        let obstacle = (!reached).then(|| self.obstacle(selection));
        let listed = self.listed.as_ref().unwrap_or(&self.chart);
        let (before_mm, after_mm) = (listed.intervals(&nothing), listed.intervals(&everything));
        let speeds = listed.limits.iter().zip(before_mm).zip(after_mm);
        Plan {
            wanted_percent: 100.0 * request.width,
            reached,
            cuts_and_tests: chosen.iter().map(|one| one.cost).sum(),
            unknowns: self.unknowns.names.clone(),
            stated: self.unknowns.stated,
            before: self.width(&nothing),
            tests,
            after,
            obstacle,
            without_limit_rpm: self.without_limit_rpm.clone(),
            without_derivative: self.without_derivative.clone(),
            chart: speeds
                .map(|((limit, before_mm), after_mm)| Speed {
                    rpm: limit.rpm,
                    limit_mm: limit.depth_mm(),
                    before_mm,
                    after_mm,
                })
                .collect(),
        }
    }

    fn width(&self, information: &DMatrix<f64>) -> Width {
        let widths = self.chart.widths(information);
        let widest = widths
            .iter()
            .zip(&self.chart.limits)
            .max_by(|a, b| a.0.total_cmp(b.0));
        let mut sorted = widths.clone();
        sorted.sort_by(f64::total_cmp);
        Width {
            widest_percent: widest.map_or(0.0, |(width, _)| 100.0 * width),
            at_rpm: widest.map_or(0.0, |(_, limit)| limit.rpm),
            median_percent: sorted.get(sorted.len() / 2).map_or(0.0, |width| 100.0 * width),
        }
    }

    /// The [`Obstacle`], with every candidate test repeated [`AT_BEST`] times.
    fn obstacle(&self, selection: &Selection<'_>) -> Obstacle {
        let size = self.unknowns.len();
        let mut information = DMatrix::identity(size, size);
        for candidate in &self.candidates {
            information += &candidate.information * AT_BEST;
        }
        let mut if_known: Vec<IfKnown> = (0..size)
            .map(|index| {
                let mut known = information.clone();
                // An exact value is modelled by adding 1e12 times the prior information: the standard deviation falls
                // to a millionth of the prior one or less.
                known[(index, index)] += 1e12;
                IfKnown {
                    name: self.unknowns.names[index].clone(),
                    widest_percent: self.width(&known).widest_percent,
                }
            })
            .collect();
        if_known.sort_by(|a, b| a.widest_percent.total_cmp(&b.widest_percent));
        if_known.truncate(if selection.is_reached(&information) { 0 } else { 3 });
        Obstacle {
            at_best: self.width(&information),
            if_known,
        }
    }
}
