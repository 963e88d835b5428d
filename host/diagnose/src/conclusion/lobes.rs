//! The effect of an extension on stability limits, chatter frequencies and predictions of trial cuts.

use rayon::prelude::*;
use serde::Serialize;

use crate::conclusion::recorded_cuts::recorded_cuts;
use quietcut_model::case::Case;
use quietcut_model::effects::Treatment;
use quietcut_recording::{Recording, TestKind};
use quietcut_stability::orbit::{ForcedProblem, collocation_of};
use quietcut_stability::trial_cuts::{Call, Calls, TrialCut, call, calls};
use quietcut_stability::{
    CubicTerms, Limit, Method, Pitched, SpeedLine, StabilityError, StabilityLoss, after, chart,
    default_speeds, first_limits, needs_orbit, spaced,
};

/// Number of spindle speeds at equal ratios in a stability chart, to which those of recorded cuts are added.
const SPEEDS: usize = 41;

/// Number of spindle speeds at equal ratios in a stability chart whose limits take long, as limits about forced orbits
/// over a revolution do. Those of recorded cuts are added. Of such a chart only the first limits are computed.
const FEW_SPEEDS: usize = 2;

/// Largest number of spindle speeds at which [`depth_mm`] searches the lowest stability limit.
const COARSE: usize = 12;

/// First axial depth of the search for the lowest stability limit in [`depth_mm`], mm.
const SHALLOWEST_MM: f64 = 0.01;
/// Bound of the axial depth in the search for the lowest stability limit in [`depth_mm`], mm; its result if no limit is
/// found.
const DEEPEST_MM: f64 = 200.0;

/// Largest axial depth of a stability chart without trial cuts, as a multiple of the lowest stability limit that
/// [`depth_mm`] finds. The chart is deeper if [`BELOW_CUTS`] requires it.
const DEPTH: f64 = 4.0;

/// Largest axial depth of a stability chart with trial cuts, as a multiple of the axial depth of the deepest trial or
/// recorded cut in it. Without trial cuts a chart is at least as deep as this.
const BELOW_CUTS: f64 = 1.2;

/// Stability limit at one spindle speed before and after the extension, each with its kind and chatter frequency.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Change {
    /// Stability limit of axial depth of the case without the extension, mm; `None` if none lies within the depth of
    /// the search.
    pub limit_before_mm: Option<f64>,
    /// Stability limit of axial depth of the extended case, mm; `None` if none lies within the depth of the search.
    pub limit_after_mm: Option<f64>,
    /// 90 % interval of `limit_after_mm`, from the intervals of the causes' parameters; `None` if it was not computed.
    /// An upper end of `None` is not below the largest depth of the search.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub limit_after_ci90_mm: Option<[Option<f64>; 2]>,
    /// Spindle speed, rev/min.
    pub at_rpm: f64,
    /// Type of the stability loss at the limit of the case without the extension; `None` without this limit.
    pub kind_before: Option<StabilityLoss>,
    /// Type of the stability loss at the limit of the extended case; `None` without this limit.
    pub kind_after: Option<StabilityLoss>,
    /// Chatter frequency at the limit of the case without the extension, Hz; `None` without this limit, or if the
    /// frequency cannot be computed.
    pub chatter_before_hz: Option<f64>,
    /// Chatter frequency at the limit of the extended case, Hz; `None` without this limit, or if the frequency cannot
    /// be computed.
    pub chatter_after_hz: Option<f64>,
}

/// Counts of right and wrong predictions of trial cuts and recorded cuts, before and after the extension.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
pub struct CallsChange {
    /// Right and wrong stability predictions for trial and recorded cuts by the case without the extension.
    pub before: Calls,
    /// Right and wrong stability predictions for the same cuts by the extended case.
    pub after: Calls,
}

/// The lobes of one case with trial cuts and recorded cuts.
#[derive(Clone, Debug)]
pub struct Chart {
    /// Name of the stability method.
    pub method: &'static str,
    /// Largest axial depth up to which stability limits were searched, mm.
    pub searched_mm: f64,
    /// The stability limits of axial depth, one entry for each spindle speed, by ascending speed.
    pub lines: Vec<SpeedLine>,
    /// Trial cuts, then recorded cuts, each with the comparison of its outcome with the prediction.
    pub cuts: Vec<(TrialCut, Call)>,
    /// One sentence for each recorded cut whose outcome cannot be determined.
    pub warnings: Vec<String>,
}

/// Stability limits of the case without the extension and of the extended case.
#[derive(Clone, Debug, Serialize)]
pub struct Lobes {
    /// Limits at the speed of the first recorded cut; without one, at the speed where the limits of the two cases
    /// differ most in ratio.
    #[serde(flatten)]
    pub at: Change,
    /// Largest axial depth up to which stability limits were searched, mm.
    pub searched_mm: f64,
    /// Time since the start of the recording for which stability limits with drift or wear hold: the end of the longest
    /// recording, s; `None` if neither case has drift or wear.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub after_s: Option<f64>,
    /// Name of the stability method of the extended case.
    pub method_after: &'static str,
    /// Stability limits before and after the extension, one entry for each speed of the chart, by ascending speed.
    pub speeds: Vec<Change>,
    /// Right and wrong predictions for trial and recorded cuts, before and after; `None` without such cuts.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub calls: Option<CallsChange>,
    /// Stability charts of the case without the extension and of the extended case, in this order.
    #[serde(skip)]
    pub charts: [Chart; 2],
    /// Sentences about intervals that cannot be computed, and about recorded cuts whose outcome cannot be determined.
    #[serde(skip)]
    pub warnings: Vec<String>,
}

/// An extended case with the parameters of one cause at both ends of the 90 % interval along one principal direction of
/// their correlation.
pub type IntervalEnds = [Case; 2];

/// The stability lobes of a case over the range of the spindle speeds of trial cuts, else around those of recorded
/// cuts, else over the default speed range of the case.
///
/// # Errors
/// The case has no tool, material or cut, or its limits cannot be computed.
pub fn baseline_lobes(
    case: &Case,
    recordings: &[Recording],
    cuts: &[TrialCut],
) -> Result<Chart, StabilityError> {
    let method = method(case, after_s(&[case], recordings))?;
    let cuts = Cuts::new(case, recordings, cuts);
    let range = Range::new(case, &*method, &cuts, is_costly(case))?;
    Chart::new(&*method, &range, &cuts)
}

/// Stability limits of a case and of its extended case at the same spindle speeds. `moved` holds, for each principal
/// direction of the causes' parameters, the extended case at both ends of the 90 % interval.
///
/// # Errors
/// The case or the extended case has no tool, material or cut, or its limits cannot be computed.
pub fn lobes(
    case: &Case,
    extended: &Case,
    moved: &[IntervalEnds],
    recordings: &[Recording],
    cuts: &[TrialCut],
) -> Result<Lobes, StabilityError> {
    let after_s = after_s(&[case, extended], recordings);
    let methods = [method(case, after_s)?, method(extended, after_s)?];
    let cuts = Cuts::new(case, recordings, cuts);
    let is_costly = is_costly(case) || is_costly(extended);
    let range = Range::new(case, &*methods[0], &cuts, is_costly)?;
    let charts = [
        Chart::new(&*methods[0], &range, &cuts)?,
        Chart::new(&*methods[1], &range, &cuts)?,
    ];
    let lines = charts[0].lines.iter().zip(&charts[1].lines);
    let mut speeds: Vec<Change> = lines.map(Change::from).collect();
    let at = match cuts.recorded_rpm.first() {
        Some(rpm) => speeds.iter().position(|change| change.at_rpm == *rpm),
        None => (0..speeds.len()).max_by(|a, b| {
            let by = |index: &usize| speeds[*index].relative(range.searched_mm).abs();
            by(a).total_cmp(&by(b))
        }),
    };
    let at = at.ok_or(StabilityError::Argument {
        quantity: "number of speeds",
        value: 0.0,
        expected: "a speed",
    })?;
    let known = if is_costly { at..at + 1 } else { 0..speeds.len() };
    let mut warnings = charts[0].warnings.clone();
    if let Err(error) = spread(&mut speeds[known], range.searched_mm, moved, after_s) {
        warnings.push(format!(
            "the 90 % intervals of the stability limits could not be computed: {error}"
        ));
    }
    Ok(Lobes {
        at: speeds[at],
        searched_mm: range.searched_mm,
        after_s,
        method_after: charts[1].method,
        speeds,
        calls: (!charts[0].cuts.is_empty()).then(|| CallsChange {
            before: charts[0].calls(),
            after: charts[1].calls(),
        }),
        charts,
        warnings,
    })
}

/// Adds the 90 % intervals of the extended case's limits to `speeds`. The principal directions of the parameters are
/// independent: the squares of the changes that they cause in a limit add, separately for increases and decreases.
fn spread(
    speeds: &mut [Change],
    searched_mm: f64,
    moved: &[IntervalEnds],
    after_s: Option<f64>,
) -> Result<(), StabilityError> {
    if moved.is_empty() {
        return Ok(());
    }
    let speeds_rpm: Vec<f64> = speeds.iter().map(|change| change.at_rpm).collect();
    let or_last = |limit_mm: Option<f64>| limit_mm.unwrap_or(searched_mm);
    let limits = |case: &Case| -> Result<Vec<f64>, StabilityError> {
        let lines = first_limits(&*method(case, after_s)?, &speeds_rpm, searched_mm)?;
        let limits = lines.iter().map(|line| line.first_limit);
        Ok(limits
            .map(|limit| or_last(limit.map(|limit| limit.depth_mm)))
            .collect())
    };
    let moved: Vec<[Vec<f64>; 2]> = moved
        .par_iter()
        .map(|[low, high]| Ok([limits(low)?, limits(high)?]))
        .collect::<Result<_, StabilityError>>()?;
    for (index, change) in speeds.iter_mut().enumerate() {
        let center_mm = or_last(change.limit_after_mm);
        let reach = |sign: f64| {
            let squares = moved.iter().map(|[low, high]| {
                let furthest = |a: f64, limits: &Vec<f64>| a.max(sign * (limits[index] - center_mm));
                [low, high].into_iter().fold(0.0, furthest).powi(2)
            });
            squares.sum::<f64>().sqrt()
        };
        let high_mm = center_mm + reach(1.0);
        change.limit_after_ci90_mm = Some([
            Some((center_mm - reach(-1.0)).max(0.0)),
            (high_mm < searched_mm).then_some(high_mm),
        ]);
    }
    Ok(())
}

/// The trial cuts and recorded cuts that belong to a stability chart.
struct Cuts<'a> {
    tried: &'a [TrialCut],
    recorded: Vec<TrialCut>,
    /// One sentence for each recorded cut whose outcome cannot be determined.
    warnings: Vec<String>,
    /// Spindle speeds that the sidecars of recorded cuts give, rev/min, including cuts whose immersion or feed belongs
    /// to another chart.
    recorded_rpm: Vec<f64>,
}

impl<'a> Cuts<'a> {
    fn new(case: &Case, recordings: &[Recording], tried: &'a [TrialCut]) -> Self {
        let (recorded, warnings) = recorded_cuts(case, recordings);
        Self {
            tried,
            recorded,
            warnings,
            recorded_rpm: recordings
                .iter()
                .filter(|recording| recording.sidecar.kind == Some(TestKind::Cutting))
                .filter_map(|recording| recording.sidecar.cut?.spindle_rpm)
                .collect(),
        }
    }

    fn all(&self) -> impl Iterator<Item = &TrialCut> {
        self.tried.iter().chain(&self.recorded)
    }
}

/// Spindle speeds of a stability chart, and the largest axial depth up to which limits are searched in it.
struct Range {
    speeds_rpm: Vec<f64>,
    searched_mm: f64,
    /// True if only the first limits are computed.
    is_costly: bool,
}

impl Range {
    fn new(
        case: &Case,
        method: &dyn Method,
        cuts: &Cuts<'_>,
        is_costly: bool,
    ) -> Result<Self, StabilityError> {
        let count = if is_costly { FEW_SPEEDS } else { SPEEDS };
        let speeds_rpm = speeds(case, cuts.tried, &cuts.recorded_rpm, count)?;
        let below_cuts_mm = BELOW_CUTS * cuts.all().map(|cut| cut.depth_mm).fold(0.0, f64::max);
        let searched_mm = if cuts.tried.is_empty() {
            let first_mm = if is_costly {
                below_cuts_mm.max(SHALLOWEST_MM)
            } else {
                SHALLOWEST_MM
            };
            depth_mm(method, &speeds_rpm, first_mm)?.max(below_cuts_mm)
        } else {
            below_cuts_mm
        };
        Ok(Self {
            speeds_rpm,
            searched_mm,
            is_costly,
        })
    }
}

impl Chart {
    fn new(method: &dyn Method, range: &Range, cuts: &Cuts<'_>) -> Result<Self, StabilityError> {
        let lines = if range.is_costly {
            first_limits(method, &range.speeds_rpm, range.searched_mm)?
        } else {
            chart(method, &range.speeds_rpm, range.searched_mm, 0)?.speeds
        };
        let mut said = calls(method, cuts.tried)?;
        let is_beyond = |cut: &TrialCut| {
            let mut limits = lines.iter().filter(|line| line.rpm == cut.rpm);
            limits.any(|line| {
                line.first_limit
                    .is_some_and(|limit| limit.depth_mm < cut.depth_mm)
            })
        };
        if range.is_costly && cuts.recorded.iter().any(is_beyond) {
            said.extend(calls(method, &cuts.recorded)?);
        } else {
            said.extend(cuts.recorded.iter().map(|cut| call(&lines, cut)));
        }
        Ok(Self {
            method: method.name(),
            searched_mm: range.searched_mm,
            lines,
            cuts: cuts.all().copied().zip(said).collect(),
            warnings: cuts.warnings.clone(),
        })
    }

    /// Counts of right and wrong stability predictions for the chart's cuts.
    pub fn calls(&self) -> Calls {
        let calls: Vec<Call> = self.cuts.iter().map(|(_, call)| *call).collect();
        Calls::of(&calls)
    }
}

fn after_s(cases: &[&Case], recordings: &[Recording]) -> Option<f64> {
    let moves = cases.iter().any(|case| {
        case.effects()
            .any(|spec| matches!(spec.treatment, Treatment::OfMoment(_)))
    });
    moves.then(|| recordings.iter().map(duration_s).fold(0.0, f64::max))
}

fn is_costly(case: &Case) -> bool {
    // A case whose forced orbit cannot be set up is refused later, when its stability limits are computed.
    needs_orbit(case) && ForcedProblem::new(case).is_ok_and(|problem| problem.is_over_revolution())
}

impl Change {
    /// Natural logarithm of the limit after the extension over the limit before it. A limit of `None` counts as
    /// `searched_mm`, one below a millionth of it as that millionth.
    pub fn relative(&self, searched_mm: f64) -> f64 {
        let limit = |limit_mm: Option<f64>| limit_mm.unwrap_or(searched_mm).max(1e-6 * searched_mm);
        (limit(self.limit_after_mm) / limit(self.limit_before_mm)).ln()
    }
}

impl From<(&SpeedLine, &SpeedLine)> for Change {
    fn from((before, after): (&SpeedLine, &SpeedLine)) -> Self {
        let depth = |limit: Limit| limit.depth_mm;
        let (a, b) = (before.first_limit, after.first_limit);
        Self {
            limit_before_mm: a.map(depth),
            limit_after_mm: b.map(depth),
            limit_after_ci90_mm: None,
            at_rpm: before.rpm,
            kind_before: a.map(|limit| limit.kind),
            kind_after: b.map(|limit| limit.kind),
            chatter_before_hz: a.and_then(|limit| limit.chatter_hz),
            chatter_after_hz: b.and_then(|limit| limit.chatter_hz),
        }
    }
}

fn duration_s(recording: &Recording) -> f64 {
    recording.len() as f64 / recording.sample_rate_hz
}

fn method(case: &Case, after_s: Option<f64>) -> Result<Box<dyn Method>, StabilityError> {
    match after_s {
        Some(after_s) => collocation_of(&after(case, after_s)?),
        None => collocation_of(case),
    }
}

/// Spindle speeds of a stability chart, rev/min: `count` at equal ratios over the range of the trial cuts `cuts`
/// (widened if it is one speed), else around that of recorded cuts, else over the default range of the case. Speeds of
/// recorded cuts are always added.
fn speeds(
    case: &Case,
    cuts: &[TrialCut],
    recorded_rpm: &[f64],
    count: usize,
) -> Result<Vec<f64>, StabilityError> {
    let ends = |speeds: &mut dyn Iterator<Item = f64>| {
        speeds.fold(None, |ends: Option<(f64, f64)>, rpm| {
            Some(ends.map_or((rpm, rpm), |(from, to)| (from.min(rpm), to.max(rpm))))
        })
    };
    let (from_rpm, to_rpm) = match ends(&mut cuts.iter().map(|cut| cut.rpm)) {
        Some((from, to)) if from < to => (from, to),
        Some((from, to)) => (0.8 * from, 1.25 * to),
        None => match ends(&mut recorded_rpm.iter().copied()) {
            Some((from, to)) => (0.7 * from, 1.4 * to),
            None => {
                let pitched = Pitched::new(case, CubicTerms::Kept)?;
                let linear = pitched.with_mean_pitch();
                default_speeds(case, &linear.structure, linear.teeth)
            }
        },
    };
    let mut speeds = spaced(from_rpm, to_rpm, count);
    speeds.extend(recorded_rpm);
    speeds.sort_by(f64::total_cmp);
    speeds.dedup();
    Ok(speeds)
}

/// Largest axial depth of a stability chart, mm: [`DEPTH`] times the lowest stability limit over at most [`COARSE`] of
/// the speeds, which is searched by doubling the depth from `first_mm`; [`DEEPEST_MM`] if no limit is found.
fn depth_mm(method: &dyn Method, speeds_rpm: &[f64], first_mm: f64) -> Result<f64, StabilityError> {
    let every = speeds_rpm.len().div_ceil(COARSE).max(1);
    let coarse: Vec<f64> = speeds_rpm.iter().copied().step_by(every).collect();
    let mut depth_mm = first_mm;
    while depth_mm < DEEPEST_MM {
        let lines = first_limits(method, &coarse, depth_mm)?;
        let limits = lines.iter().filter_map(|line| line.first_limit);
        if let Some(lowest_mm) = limits.map(|limit| limit.depth_mm).min_by(f64::total_cmp) {
            return Ok(DEPTH * lowest_mm);
        }
        depth_mm *= 2.0;
    }
    Ok(DEEPEST_MM)
}

#[cfg(test)]
mod tests;
