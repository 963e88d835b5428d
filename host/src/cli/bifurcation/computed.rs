//! Results of `quietcut bifurcation`: the branch, its curves, and the reason where one of them ends early.

use super::super::Error;
use super::names::word;
use super::records::{DoubledRecords, Records};
use super::request::{CurveRequest, Request};
use super::strobe::StrobeSet;
use crate::orbit::curve::{Curve, CurveError, CurveSeed, follow_curve};
use crate::orbit::{
    Branch, Criticality, DoubledBranch, Extent, ForcedProblem, OrbitError, criticality, follow_doubled,
    follow_recorded,
};
use crate::stability::StabilityLoss;

/// What was computed.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Computed {
    /// The branch.
    pub(super) branch: Branch,
    /// Criticality of each bifurcation of the branch, where it is known.
    pub(super) criticality: Vec<Option<Criticality>>,
    /// Period-doubled orbits from its flips.
    pub(super) doubled: Vec<Doubled>,
    /// Its curves in two parameters.
    pub(super) curves: Vec<Curve>,
    /// Stroboscopic diagram of simulated cuts.
    pub(super) strobe: Vec<StrobeSet>,
    /// Reason why the branch ends early, and what to try.
    pub(super) broken: Option<Broken>,
}

/// Period-doubled orbits from a flip of the branch.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Doubled {
    /// Index of the flip among the bifurcations of the branch.
    pub(super) event: usize,
    /// The doubled orbits; `None` if not even one is found.
    pub(super) found: Option<DoubledBranch>,
    /// Reason why they end early, and what to try.
    pub(super) broken: Option<Broken>,
}

/// Reason why a branch ends early.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
pub(super) struct Broken {
    /// Reason.
    pub(super) reason: String,
    /// What to try.
    pub(super) try_instead: &'static str,
}

/// Follows the branch and the curves of a request.
///
/// # Errors
/// Not even the first orbit is found, the records cannot be kept, or no curve begins on the branch.
pub(super) fn compute(
    problem: &ForcedProblem,
    request: &Request,
    records: &mut Records,
) -> Result<Computed, Error> {
    let (vary, range) = (request.vary, request.range);
    let found = follow_recorded(problem, request.setting, vary, range, Extent::Whole, records);
    let (branch, broken) = match found {
        Ok(branch) => (branch, None),
        Err(broken) => match (broken.branch, broken.cause) {
            (_, OrbitError::Journal { .. }) => return Err(records.failed()),
            (Some(branch), cause) => (*branch, Some(Broken::of(cause))),
            (None, cause) => return Err(no_branch(cause)),
        },
    };
    let curves = match &request.curves {
        Some(curves) => follow_curves(problem, request, curves, &branch, records)?,
        None => Vec::new(),
    };
    let doubled = if request.doubled {
        follow_all_doubled(problem, request, &branch, records)?
    } else {
        Vec::new()
    };
    let criticality = branch
        .events
        .iter()
        .map(|event| criticality(problem, request.setting, vary, range, event))
        .collect();
    Ok(Computed {
        branch,
        criticality,
        doubled,
        curves,
        strobe: Vec::new(),
        broken,
    })
}

impl Computed {
    /// The doubled branches that were found.
    pub(super) fn doubled_branches(&self) -> Vec<DoubledBranch> {
        self.doubled
            .iter()
            .filter_map(|doubled| doubled.found.clone())
            .collect()
    }

    /// Intervals of the varied parameter in which two forced orbits are stable, or a doubled one beside a forced one.
    pub(super) fn bistable(&self) -> Vec<[f64; 2]> {
        let found = self.doubled.iter().filter_map(|doubled| doubled.found.as_ref());
        let beside = found.flat_map(|found| found.bistable(&self.branch));
        let mut all: Vec<[f64; 2]> = self.branch.bistable().into_iter().chain(beside).collect();
        all.sort_by(|a, b| a[0].total_cmp(&b[0]));
        // Doubled orbits between two flips are found from both.
        all.dedup_by(|next, last| {
            let overlaps = next[0] < last[1];
            if overlaps {
                last[1] = last[1].max(next[1]);
            }
            overlaps
        });
        all
    }
}

/// Follows the doubled orbits from each flip on whose one side the forced orbits are stable.
fn follow_all_doubled(
    problem: &ForcedProblem,
    request: &Request,
    branch: &Branch,
    records: &mut Records,
) -> Result<Vec<Doubled>, Error> {
    let mut all = Vec::new();
    let mut outside = branch.points.first().map_or(0, |point| point.outside);
    for (event, at) in branch.events.iter().enumerate() {
        let count = at.kind.count();
        let before = outside;
        outside += if at.gain { -count } else { count };
        if at.kind != StabilityLoss::Flip || before.min(outside) > 0 {
            continue;
        }
        let (vary, range) = (request.vary, request.range);
        let mut journal = DoubledRecords { records, event };
        let (found, broken) = match follow_doubled(problem, request.setting, vary, range, at, &mut journal) {
            Ok(found) => (Some(found), None),
            Err(broken) => match broken.cause {
                OrbitError::NotCovered { .. } => return Err(Error::input(broken.cause)),
                OrbitError::Journal { .. } => return Err(records.failed()),
                cause => (broken.branch.map(|found| *found), Some(Broken::of(cause))),
            },
        };
        all.push(Doubled { event, found, broken });
    }
    Ok(all)
}

fn follow_curves(
    problem: &ForcedProblem,
    request: &Request,
    asked: &CurveRequest,
    branch: &Branch,
    records: &mut Records,
) -> Result<Vec<Curve>, Error> {
    let second = request.setting.get(asked.plane.parameters[1]);
    let events = branch
        .events
        .iter()
        .filter(|event| asked.kinds.contains(&event.kind));
    let mut curves: Vec<Curve> = Vec::new();
    let mut refused = Vec::new();
    for event in events {
        let seed = CurveSeed::of_event(event, second);
        if curves.iter().any(|curve| curve.passes(&seed)) {
            continue;
        }
        match follow_curve(problem, request.setting, asked.plane, &seed, records) {
            Ok(curve) => curves.push(curve),
            Err(error @ CurveError::NoStart { .. }) => refused.push(error.to_string()),
            Err(CurveError::Journal { .. }) => return Err(records.failed()),
            Err(error) => return Err(Error::input(error)),
        }
        records.next_curve();
    }
    if curves.is_empty() {
        return Err(Error::input(no_curve(asked, branch, &refused)));
    }
    for reason in refused {
        tracing::warn!("{reason}");
    }
    Ok(curves)
}

/// Message that no curve begins on a branch.
fn no_curve(asked: &CurveRequest, branch: &Branch, refused: &[String]) -> String {
    let kinds: Vec<&str> = asked.kinds.iter().map(|kind| word(*kind)).collect();
    if !refused.is_empty() {
        return refused.join("; ");
    }
    let unit = branch.parameter.key();
    let found: Vec<String> = branch
        .events
        .iter()
        .map(|event| format!("{} at {unit} = {:.4}", word(event.kind), event.value))
        .collect();
    let found = if found.is_empty() {
        "no bifurcation at all".to_owned()
    } else {
        found.join(", ")
    };
    format!(
        "no {} on the branch over {}, so that no curve begins; it has {found}. Another --fix or a longer --range may have one",
        kinds.join(" or "),
        branch.parameter.name()
    )
}

/// Error if not even the first orbit is found.
fn no_branch(cause: OrbitError) -> Error {
    match cause {
        OrbitError::NotCovered { .. } => Error::input(cause),
        OrbitError::Lost { .. } => Error::input(format!("{cause}; {}", advice(cause))),
        _ => Error::other(format!("{cause}; {}", advice(cause))),
    }
}

impl Broken {
    fn of(cause: OrbitError) -> Self {
        Self {
            reason: cause.to_string(),
            try_instead: advice(cause),
        }
    }
}

/// What to try after an error.
fn advice(cause: OrbitError) -> &'static str {
    match cause {
        OrbitError::NoConvergence { .. } => {
            "a softening structure may have no orbit beyond, and a resonance without damping none of finite size; end --range there, begin it at the other end, or reach the place by \
             another parameter (--vary)"
        }
        OrbitError::Lost { .. } => {
            "the first orbit is reached from depth 0 at the first value of --range; begin there at a smaller depth, or vary depth, \
             which passes the fold"
        }
        OrbitError::Singular { .. } => {
            "two bifurcations may coincide there; change a fixed parameter a little (--fix)"
        }
        OrbitError::Eigenvalues { .. } => {
            "end --range before it, or change a fixed parameter a little (--fix)"
        }
        OrbitError::NotCovered { .. } | OrbitError::Journal { .. } => "",
    }
}
