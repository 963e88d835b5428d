//! Branch of period-doubled orbits from a flip.

use serde::Serialize;

use super::period::SubharmonicPeriod;
use super::start::{beside, repeated};
use crate::limits::speed_line::union;
use crate::orbit::branch::{Branch, BrokenBranch, Event, Extent};
use crate::orbit::branch_record::{BranchJournal, BranchRecord};
use crate::orbit::coefficients::Coefficients;
use crate::orbit::follower::Follower;
use crate::orbit::forced::ForcedProblem;
use crate::orbit::parameter::{Parameter, Setting};
use crate::orbit::periodic_orbit::{Orbit, OrbitError, PeriodMap};
use crate::orbit::varied_period::VariedPeriod;
use crate::spectrum::stability_loss::StabilityLoss;

/// Period-doubled orbit on a branch, beside its [`BranchPoint`](crate::orbit::BranchPoint).
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct DoubledPoint {
    /// Displacement of the tool at the starts of both tooth periods, in feed, normal and axial direction, mm.
    pub displacements_mm: Vec<[f64; 3]>,
    /// Smallest chip thickness on the orbit, mm. Below 0 a tooth would leave the surface: the orbit is then one of the cut
    /// without loss of contact, and that of the real cut differs.
    pub smallest_chip_mm: f64,
}

/// Branch of period-doubled orbits from a flip.
///
/// Its multipliers, and the kinds of its events, are those over two tooth periods.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct DoubledBranch {
    /// Value of the varied parameter at the flip, in the unit of results.
    pub flip: f64,
    /// Amplitude and stability of the doubled orbits, and their bifurcations.
    pub branch: Branch,
    /// What else is known of each orbit of the branch.
    pub points: Vec<DoubledPoint>,
    /// True if the branch ends where it meets the forced orbits again, at another flip.
    pub rejoins: bool,
}

/// Branch of doubled orbits that cannot be followed to its end.
#[derive(Clone, Debug, thiserror::Error)]
#[error("{cause}")]
pub struct BrokenDoubledBranch {
    /// Reason.
    pub cause: OrbitError,
    /// The branch so far; `None` if not even its first orbit is found.
    pub branch: Option<Box<DoubledBranch>>,
}

/// Orbits of a branch as they are recorded.
struct Observed<'a> {
    inner: &'a mut dyn BranchJournal,
    order: usize,
    orbits: Vec<Orbit>,
}

impl BranchJournal for Observed<'_> {
    fn recorded(&mut self) -> Vec<BranchRecord> {
        let records = self.inner.recorded();
        let orbits = records.iter().filter_map(|record| record.orbit(self.order));
        self.orbits.extend(orbits);
        records
    }

    fn record(&mut self, record: &BranchRecord) -> bool {
        self.orbits.extend(record.orbit(self.order));
        self.inner.record(record)
    }
}

/// Follows the period-doubled orbits from a flip on a branch of `problem` over a parameter within a range, in the unit of
/// results, until they leave the range or meet the forced orbits again. `setting` holds the other parameters.
///
/// # Errors
/// The problem has a feature that is not covered; the event is no flip; no doubled orbit is found beside it; the branch
/// cannot be followed further (the error then holds the branch so far); or the journal fails.
pub fn follow_doubled(
    problem: &ForcedProblem,
    setting: Setting,
    parameter: Parameter,
    range: [f64; 2],
    flip: &Event,
    journal: &mut dyn BranchJournal,
) -> Result<DoubledBranch, BrokenDoubledBranch> {
    let none = |cause| BrokenDoubledBranch { cause, branch: None };
    check(problem, flip).map_err(none)?;
    let at_flip = repeated(flip);
    let setting = setting.with(parameter, flip.value);
    let map = SubharmonicPeriod::new(VariedPeriod::new(problem, setting, parameter, range), 2);
    let ends = range.map(|value| value * parameter.result_unit());
    let follower = Follower::over(ends, map, setting.rpm, at_flip.start.norm()).landing();
    let first = beside(&follower, &at_flip).map_err(none)?;
    let mut observed = Observed {
        inner: journal,
        order: problem.order(),
        orbits: vec![first.orbit.clone()],
    };
    let found = follower.beyond(first, Extent::Whole, &mut observed);
    let orbits = observed.orbits;
    let described = |branch: Branch| DoubledBranch {
        flip: flip.value,
        points: orbits.iter().map(|orbit| point(&follower.map, orbit)).collect(),
        rejoins: orbits
            .windows(2)
            .any(|pair| follower.map.has_rejoined(&pair[0], &pair[1])),
        branch,
    };
    match found {
        Ok(branch) => Ok(described(branch)),
        Err(BrokenBranch { cause, branch }) => Err(BrokenDoubledBranch {
            cause,
            branch: branch.map(|branch| Box::new(described(*branch))),
        }),
    }
}

fn point(map: &SubharmonicPeriod<'_>, orbit: &Orbit) -> DoubledPoint {
    DoubledPoint {
        displacements_mm: map.displacements_mm(orbit),
        smallest_chip_mm: 1e3 * map.smallest_chip_m(orbit),
    }
}

fn check(problem: &ForcedProblem, flip: &Event) -> Result<(), OrbitError> {
    let what = if flip.kind != StabilityLoss::Flip {
        "doubled orbits from another event than a flip"
    } else if problem.is_over_revolution() {
        "doubled orbits of teeth with unequal pitch or runout; leave out runout and unequal pitch"
    } else if problem.coefficients != Coefficients::Exact {
        "doubled orbits with smoothed or averaged coefficients; use the exact ones"
    } else if problem.chip_exponent().is_some() {
        "doubled orbits with extension.force-exponent; leave it out"
    } else if problem.linear.process.axial_depth_modulation {
        "doubled orbits with axial-depth modulation; leave it out"
    } else if problem.is_linear() {
        "doubled orbits of a linear structure, which grow without bounds beyond a flip; they need a nonlinear term"
    } else {
        return Ok(());
    };
    Err(OrbitError::NotCovered { what })
}

impl DoubledBranch {
    /// Value of the varied parameter at the first fold along the branch, at which the doubled orbits turn back, in the unit
    /// of results; `None` if they do not.
    pub fn fold(&self) -> Option<&Event> {
        let mut events = self.branch.events.iter();
        events.find(|event| event.kind == StabilityLoss::Fold)
    }

    /// Intervals of the varied parameter in which both a forced orbit of `forced` and a doubled orbit are stable.
    ///
    /// Below a subcritical flip this is the interval from the fold of the doubled orbits to the flip. A cut there stays at
    /// the forced vibration until a disturbance takes it beyond the unstable doubled orbit in between.
    pub fn bistable(&self, forced: &Branch) -> Vec<[f64; 2]> {
        let mut both = Vec::new();
        for a in union(forced.stable()) {
            for b in union(self.branch.stable()) {
                let (from, to) = (a[0].max(b[0]), a[1].min(b[1]));
                if from < to {
                    both.push([from, to]);
                }
            }
        }
        both
    }

    /// Value of the varied parameter at the first orbit along the branch on which a tooth would leave the surface, in the
    /// unit of results; `None` if all teeth stay in contact.
    pub fn contact_lost(&self) -> Option<f64> {
        let points = self.points.iter().zip(&self.branch.points);
        let mut lost = points.filter(|(point, _)| point.smallest_chip_mm < 0.0);
        lost.next().map(|(_, at)| at.value)
    }
}
