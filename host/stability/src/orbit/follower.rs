//! Follows a branch of forced orbits over one parameter.
//!
//! Pseudo-arclength continuation passes folds. At every orbit all Floquet multipliers (characteristic multipliers) of
//! the linearized delay equation are computed. Steps are so short that each multiplier near the unit circle can be
//! identified again.

use nalgebra::DVector;
use num_complex::Complex64;

use super::branch::{Branch, BranchPoint, BrokenBranch, Event, Extent};
use super::branch_record::{BranchJournal, BranchRecord, Unrecorded};
use super::pairing::{FOLLOWED, pair, share_of_distance};
use super::parameter::Place;
use super::periodic_orbit::{Orbit, OrbitError, PeriodMap, Predecessor, Scale, Tangent};
use crate::criteria::{BRANCH_STEP_CLEAR, BRANCH_STEP_MAX, BRANCH_STEP_MIN, CIRCLE_SHARE_MAX};
use crate::spectrum::stability_loss::StabilityLoss;

/// Largest number of steps of a branch, failed ones included: ten times the hundred that a branch up and down takes
/// with the longest step. A choice.
const STEPS_MAX: usize = 1000;

/// Forced orbit of a map over the depth at a depth, reached by continuation from depth 0.
///
/// # Errors
/// The orbit cannot be followed to this depth.
pub(super) fn orbit_at_depth<M: PeriodMap>(map: M, rpm: f64, depth_m: f64) -> Result<Orbit, OrbitError> {
    Ok(Follower::new(map, rpm, depth_m).up_to(depth_m)?.orbit)
}

/// Norm of the orbit's state at the start of the period at a value of the varied parameter, a depth or feed, from the
/// equation linearized about rest at the value 0, or 1 if that gives none above 0: the unit of the state along a branch.
pub(super) fn size_at(map: &impl PeriodMap, value: f64) -> f64 {
    let rest = Orbit::rest(map);
    let linear = map
        .integrate(&rest.start, 0.0, &rest.states)
        .and_then(|integration| {
            let at_value = integration.by.column(map.size()) * value;
            integration.periodic().lu().solve(&at_value)
        });
    // Without feed and edge forces the orbit is rest, and any unit of its size serves; so it does if the linearized
    // equation is singular.
    linear
        .map(|state| state.norm())
        .filter(|size| *size > 0.0)
        .unwrap_or(1.0)
}

/// Multipliers of an orbit, each with that of the next orbit that it becomes.
type Pairs = Vec<(Complex64, Complex64)>;

pub(super) struct Follower<M> {
    pub(super) map: M,
    pub(super) rpm: f64,
    pub(super) scale: Scale,
    /// First and last value of the parameter, in the unit of computations.
    pub(super) range: [f64; 2],
    /// True if the last orbit of a branch lies exactly at an end of the range, not one step beyond it.
    pub(super) lands: bool,
}

/// Orbit with its Floquet multipliers.
#[derive(Clone)]
pub(super) struct Sample {
    pub(super) orbit: Orbit,
    pub(super) tangent: Tangent,
    /// Orbit from which this one was reached; `None` for the first one of a branch.
    pub(super) before: Option<Predecessor>,
    /// Floquet multipliers of the orbit near or outside the unit circle, in the upper half plane or on the real axis.
    pub(super) roots: Vec<Complex64>,
    pub(super) largest: f64,
}

impl Sample {
    fn outside(&self) -> i32 {
        self.roots
            .iter()
            .filter(|root| root.norm() > 1.0)
            .map(|root| StabilityLoss::of(*root).count())
            .sum()
    }
}

impl<M: PeriodMap> Follower<M> {
    pub(super) fn new(map: M, rpm: f64, depth_m: f64) -> Self {
        // The requested depth is the unit of steps in depth along the branch; at depth 0 any positive unit serves.
        let depth_m = if depth_m > 0.0 { depth_m } else { 1e-3 };
        let state = size_at(&map, depth_m);
        Self::over([0.0, depth_m], map, rpm, state)
    }

    /// Follower from the first value of a range to the last one, with a unit of the state along the branch.
    pub(super) fn over(range: [f64; 2], map: M, rpm: f64, state: f64) -> Self {
        let length = (range[1] - range[0]).abs();
        let scale = Scale {
            // Any unit serves for an orbit that starts at rest, and for a range without length.
            state: if state > 0.0 { state } else { 1.0 },
            value: if length > 0.0 { length } else { 1.0 },
        };
        Self {
            map,
            rpm,
            scale,
            range,
            lands: false,
        }
    }

    /// The same follower, whose branches end exactly at an end of the range.
    pub(super) fn landing(self) -> Self {
        Self { lands: true, ..self }
    }

    /// Forced orbit with its multipliers at a depth, reached by continuation from depth 0.
    pub(super) fn up_to(&self, depth_m: f64) -> Result<Sample, OrbitError> {
        let order = self.map.size();
        let mut along_depth = DVector::zeros(order + 1);
        along_depth[order] = 1.0;
        let mut here = self.sample(&Orbit::rest(&self.map), &along_depth)?;
        let mut step = BRANCH_STEP_MAX;
        while here.orbit.value < depth_m {
            let towards = here.tangent.along[order] * self.scale.value;
            if towards <= 0.0 {
                let place = self.place(&here.orbit);
                return Err(OrbitError::Lost { place });
            }
            let next = if here.orbit.value + towards * step >= depth_m {
                // The last step ends exactly at the requested depth.
                let rest = (depth_m - here.orbit.value) / towards;
                let mut guess = here.orbit.along(&here.tangent, rest, self.scale);
                guess.value = depth_m;
                self.sample(&guess, &along_depth)
            } else {
                self.step(&here, step)
            };
            match next {
                Ok(next) => here = next,
                Err(_) if step > BRANCH_STEP_MIN => step *= 0.5,
                Err(error) => return Err(error),
            }
            if (here.orbit.value - depth_m).abs() <= 1e-12 * depth_m {
                break;
            }
        }
        Ok(here)
    }

    pub(super) fn place(&self, orbit: &Orbit) -> Place {
        self.map.parameter().at(orbit.value)
    }

    /// Follows the branch that starts from rest at depth 0.
    pub(super) fn follow(&self, extent: Extent) -> Result<Branch, OrbitError> {
        self.whole(&Orbit::rest(&self.map), extent, &mut Unrecorded)
            .map_err(|broken| broken.cause)
    }

    /// Follows the branch through an orbit at the first value of the range, and on from the orbits that a journal has
    /// recorded.
    pub(super) fn whole(
        &self,
        start: &Orbit,
        extent: Extent,
        journal: &mut dyn BranchJournal,
    ) -> Result<Branch, BrokenBranch> {
        let order = self.map.size();
        let mut towards = DVector::zeros(order + 1);
        towards[order] = (self.range[1] - self.range[0]).signum();
        let here = self
            .sample(start, &towards)
            .map_err(|cause| BrokenBranch { cause, branch: None })?;
        self.beyond(here, extent, journal)
    }

    /// Follows the branch from an orbit in the direction of its tangent, and on from the orbits that a journal has
    /// recorded.
    pub(super) fn beyond(
        &self,
        here: Sample,
        extent: Extent,
        journal: &mut dyn BranchJournal,
    ) -> Result<Branch, BrokenBranch> {
        let mut branch = Branch {
            parameter: self.map.parameter(),
            rpm: self.rpm,
            points: vec![self.point(&here)],
            events: Vec::new(),
        };
        match self.extend(&mut branch, here, extent, journal) {
            Ok(()) => Ok(branch),
            Err(cause) => Err(BrokenBranch {
                cause,
                branch: Some(Box::new(branch)),
            }),
        }
    }

    /// Appends to a branch that has only its first orbit what follows.
    fn extend(
        &self,
        branch: &mut Branch,
        first: Sample,
        extent: Extent,
        journal: &mut dyn BranchJournal,
    ) -> Result<(), OrbitError> {
        let unfit = OrbitError::Journal {
            place: self.place(&first.orbit),
        };
        let records = journal.recorded();
        let (mut here, mut step) = self.resumed(branch, first, &records).ok_or(unfit)?;
        for _ in records.len()..STEPS_MAX {
            if self.is_at_end(branch, &here, extent) {
                return Ok(());
            }
            let place = self.place(&here.orbit);
            let next = self.step(&here, step).and_then(|next| {
                let pairs = pair(&here.roots, &next.roots, step <= 2.0 * BRANCH_STEP_MIN);
                Ok((next, pairs.ok_or(OrbitError::NoConvergence { place })?))
            });
            let (mut next, mut pairs) = match next {
                Ok(found) => found,
                Err(error) if step <= BRANCH_STEP_MIN => return Err(error),
                Err(_) => {
                    step = (0.5 * step).max(BRANCH_STEP_MIN);
                    continue;
                }
            };
            let share = share_of_distance(&pairs);
            if step > BRANCH_STEP_MAX && share > CIRCLE_SHARE_MAX {
                step = BRANCH_STEP_MAX;
                continue;
            }
            if let Some(landed) = self.landed(&here, &next, step) {
                (next, pairs, step) = landed;
            }
            let mut events: Vec<(f64, Event)> = pairs
                .iter()
                .filter(|(from, to)| (from.norm() > 1.0) != (to.norm() > 1.0))
                .filter_map(|&(from, to)| self.refine(&here, step, from, to))
                .collect();
            events.sort_by(|a, b| a.0.total_cmp(&b.0));
            let after = branch.points.len();
            let events = events.into_iter().map(|(_, event)| Event { after, ..event });
            let events: Vec<Event> = events.collect();
            here = next;
            // The share that a multiplier moves grows with the step; four fifths of the largest leave room for its
            // acceleration.
            let clear = (0.8 * CIRCLE_SHARE_MAX / share * step).clamp(BRANCH_STEP_MAX, BRANCH_STEP_CLEAR);
            let next_step = (1.5 * step).min(clear);
            let point = self.point(&here);
            let record = BranchRecord::new((&here.orbit, &here.tangent), [step, next_step], &point, &events);
            branch.points.push(point);
            branch.events.extend(events);
            step = next_step;
            if !journal.record(&record) {
                return Err(OrbitError::Journal {
                    place: self.place(&here.orbit),
                });
            }
        }
        Err(OrbitError::NoConvergence {
            place: self.place(&here.orbit),
        })
    }

    /// Lower and upper end of the range.
    fn ends(&self) -> [f64; 2] {
        [self.range[0].min(self.range[1]), self.range[0].max(self.range[1])]
    }

    /// The orbit at the end of the range that a step passes, with the pairs of its multipliers and the length of the step
    /// to it; `None` if the step passes no end, if the branch need not land there, or if the orbit is not found.
    fn landed(&self, here: &Sample, next: &Sample, step: f64) -> Option<(Sample, Pairs, f64)> {
        let [low, high] = self.ends();
        let value = next.orbit.value;
        let passed = [low, high]
            .into_iter()
            .find(|end| (here.orbit.value - end) * (value - end) < 0.0);
        let end = passed.filter(|_| self.lands)?;
        let share = (end - here.orbit.value) / (value - here.orbit.value);
        let mut guess = self.predicted(here, share * step);
        guess.value = end;
        let mut along = DVector::zeros(self.map.size() + 1);
        along[self.map.size()] = (end - here.orbit.value).signum();
        let mut landed = self.sample(&guess, &along).ok()?;
        landed.before = Some(Predecessor {
            orbit: here.orbit.clone(),
            tangent: here.tangent.clone(),
            step: share * step,
        });
        let pairs = pair(&here.roots, &landed.roots, step <= 2.0 * BRANCH_STEP_MIN)?;
        Some((landed, pairs, share * step))
    }

    /// True if a branch is followed far enough with its last orbit.
    fn is_at_end(&self, branch: &Branch, last: &Sample, extent: Extent) -> bool {
        let [low, high] = self.ends();
        let lost = extent == Extent::FirstLoss && branch.events.iter().any(|event| !event.gain);
        let value = last.orbit.value;
        let rejoined = last
            .before
            .as_ref()
            .is_some_and(|before| self.map.has_rejoined(&before.orbit, &last.orbit));
        branch.points.len() > 1 && (lost || rejoined || value >= high || value <= low)
    }

    /// Forced orbit with its multipliers one step further along the branch.
    pub(super) fn step(&self, from: &Sample, step: f64) -> Result<Sample, OrbitError> {
        let mut next = self.sample(&self.predicted(from, step), &from.tangent.along)?;
        next.before = Some(Predecessor {
            orbit: from.orbit.clone(),
            tangent: from.tangent.clone(),
            step,
        });
        Ok(next)
    }

    /// Predicted orbit one step further along the branch.
    fn predicted(&self, from: &Sample, step: f64) -> Orbit {
        match &from.before {
            Some(before) => from.orbit.extrapolated(&from.tangent, before, step, self.scale),
            None => from.orbit.along(&from.tangent, step, self.scale),
        }
    }

    /// Value of the parameter at the forced orbit one step further along the branch.
    pub(super) fn value(&self, from: &Sample, step: f64) -> Result<f64, OrbitError> {
        let guess = self.predicted(from, step);
        let (orbit, _) = Orbit::correct(&self.map, &guess, self.scale, &from.tangent.along)?;
        Ok(orbit.value)
    }

    pub(super) fn sample(&self, guess: &Orbit, normal: &DVector<f64>) -> Result<Sample, OrbitError> {
        let (orbit, tangent) = Orbit::correct(&self.map, guess, self.scale, normal)?;
        self.with_multipliers(orbit, tangent)
    }

    pub(super) fn with_multipliers(&self, orbit: Orbit, tangent: Tangent) -> Result<Sample, OrbitError> {
        let place = self.place(&orbit);
        let all = self
            .map
            .multipliers(&orbit)
            .map_err(|cause| OrbitError::of_multipliers(cause, place))?;
        let largest = all.first().map_or(0.0, |multiplier| multiplier.norm());
        let roots = all
            .into_iter()
            .take_while(|multiplier| multiplier.norm() > FOLLOWED)
            .filter(|multiplier| multiplier.im >= 0.0)
            .collect();
        Ok(Sample {
            orbit,
            tangent,
            before: None,
            roots,
            largest,
        })
    }

    fn point(&self, sample: &Sample) -> BranchPoint {
        BranchPoint {
            value: self.place(&sample.orbit).value,
            amplitude_mm: self.map.problem().amplitude_mm(&sample.orbit.states),
            displacement_mm: self.map.problem().displacement_mm(&sample.orbit.start),
            multiplier_abs: sample.largest,
            outside: sample.outside(),
        }
    }
}
