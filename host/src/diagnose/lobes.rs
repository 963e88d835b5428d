//! What an extension changes for the user: limits, chatter frequencies, calls of stable and unstable.

use serde::Serialize;

use crate::case::Case;
use crate::continuation::{ForcedProblem, collocation_of};
use crate::recording::{Kind as RecordKind, Recording};
use crate::stability::{
    CubicTerms, Kind, Limit, Method, Pitched, SpeedLine, StabilityError, after, chart, default_speeds,
    needs_orbit, spaced,
};
use crate::test_cuts::{Call, Calls, TestCut, calls};

/// Speeds of the charts.
const SPEEDS: usize = 41;

/// The same where a speed takes seconds, as forced orbits over the revolution do.
const FEW_SPEEDS: usize = 2;

/// Speeds at which the lowest limit is sought.
const COARSE: usize = 12;

/// Depths between which it is, mm.
const SHALLOWEST_MM: f64 = 0.01;
const DEEPEST_MM: f64 = 200.0;

/// How many times the lowest limit charts go down to.
const DEPTH: f64 = 4.0;

/// The limit at one speed before and after; `None` for none up to the last depth.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Change {
    /// Where stability is first lost by the case, mm.
    pub limit_before_mm: Option<f64>,
    /// Where by the extended case, mm.
    pub limit_after_mm: Option<f64>,
    /// Spindle speed, rev/min.
    pub at_rpm: f64,
    /// How it is lost by the case.
    pub kind_before: Option<Kind>,
    /// How by the extended case.
    pub kind_after: Option<Kind>,
    /// Frequency of the chatter by the case, Hz.
    pub chatter_before_hz: Option<f64>,
    /// Frequency by the extended case, Hz.
    pub chatter_after_hz: Option<f64>,
}

/// How cuts that were tried are called.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
pub struct CallsChange {
    /// By the case.
    pub before: Calls,
    /// By the extended case.
    pub after: Calls,
}

/// The limits of the case and of the extended case.
#[derive(Clone, Debug, Serialize)]
pub struct Lobes {
    /// At the speed of the recorded cuts, else where the two differ most.
    #[serde(flatten)]
    pub at: Change,
    /// The depth up to which limits were sought, mm.
    pub searched_mm: f64,
    /// The moment for which limits of a case with drift or wear hold: the end of the longest recording, s.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub after_s: Option<f64>,
    /// How the limits of the extended case were computed.
    pub method_after: &'static str,
    /// At every speed.
    pub speeds: Vec<Change>,
    /// How cuts that were tried are called, where there are any.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub calls: Option<CallsChange>,
    /// The lines of both charts.
    #[serde(skip)]
    pub lines: [Vec<SpeedLine>; 2],
    /// The cuts, each with what both say of it.
    #[serde(skip)]
    pub cuts: Vec<(TestCut, [Call; 2])>,
}

/// The limits of a case and of its extension, over the speeds of the cuts that were tried or recorded, else of the machine.
///
/// # Errors
/// A case without tool, material or cut, or one whose limits cannot be computed.
pub fn lobes(
    case: &Case,
    extended: &Case,
    recordings: &[Recording],
    cuts: &[TestCut],
) -> Result<Lobes, StabilityError> {
    let moves = [case, extended].into_iter().any(|case| {
        ["drift", "wear"]
            .iter()
            .any(|name| case.extensions.contains_key(*name))
    });
    let after_s = moves.then(|| recordings.iter().map(duration_s).fold(0.0, f64::max));
    let methods = [method(case, after_s)?, method(extended, after_s)?];
    let recorded_rpm: Vec<f64> = recordings
        .iter()
        .filter(|recording| recording.sidecar.kind == Some(RecordKind::Cutting))
        .filter_map(|recording| recording.sidecar.cut?.spindle_rpm)
        .collect();
    let is_costly = [case, extended].into_iter().any(|case| {
        needs_orbit(case) && ForcedProblem::new(case).is_ok_and(|problem| problem.is_over_revolution())
    });
    let speeds_rpm = speeds(
        case,
        cuts,
        &recorded_rpm,
        if is_costly { FEW_SPEEDS } else { SPEEDS },
    )?;
    let searched_mm = match cuts.iter().map(|cut| cut.depth_mm).max_by(f64::total_cmp) {
        Some(deepest_mm) => 1.2 * deepest_mm,
        None => depth_mm(&*methods[0], &speeds_rpm)?,
    };
    let lines = [
        chart(&*methods[0], &speeds_rpm, searched_mm, 0)?.speeds,
        chart(&*methods[1], &speeds_rpm, searched_mm, 0)?.speeds,
    ];
    let changes: Vec<Change> = lines[0].iter().zip(&lines[1]).map(Change::from).collect();
    let at = match recorded_rpm.first() {
        Some(rpm) => changes.iter().find(|change| change.at_rpm == *rpm),
        None => changes.iter().max_by(|a, b| {
            a.relative(searched_mm)
                .abs()
                .total_cmp(&b.relative(searched_mm).abs())
        }),
    };
    let at = *at.ok_or(StabilityError::Argument {
        quantity: "number of speeds",
        value: 0.0,
        expected: "a speed",
    })?;
    let said = [calls(&*methods[0], cuts)?, calls(&*methods[1], cuts)?];
    Ok(Lobes {
        at,
        searched_mm,
        after_s,
        method_after: methods[1].name(),
        speeds: changes,
        calls: (!cuts.is_empty()).then(|| CallsChange {
            before: Calls::of(&said[0]),
            after: Calls::of(&said[1]),
        }),
        lines,
        cuts: cuts
            .iter()
            .zip(said[0].iter().zip(&said[1]))
            .map(|(cut, (before, after))| (*cut, [*before, *after]))
            .collect(),
    })
}

impl Change {
    /// Natural logarithm of the limit after over that before; none counts as the last depth.
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

/// Those of the cuts, else around those of the recorded cuts, else of the machine; with the speeds of recorded cuts among them.
fn speeds(
    case: &Case,
    cuts: &[TestCut],
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

/// Some times the lowest limit, found by doubling.
fn depth_mm(method: &dyn Method, speeds_rpm: &[f64]) -> Result<f64, StabilityError> {
    let every = speeds_rpm.len().div_ceil(COARSE).max(1);
    let coarse: Vec<f64> = speeds_rpm.iter().copied().step_by(every).collect();
    let mut depth_mm = SHALLOWEST_MM;
    while depth_mm < DEEPEST_MM {
        let lines = chart(method, &coarse, depth_mm, 0)?.speeds;
        let limits = lines.iter().filter_map(|line| line.first_limit);
        if let Some(lowest_mm) = limits.map(|limit| limit.depth_mm).min_by(f64::total_cmp) {
            return Ok(DEPTH * lowest_mm);
        }
        depth_mm *= 2.0;
    }
    Ok(DEEPEST_MM)
}
