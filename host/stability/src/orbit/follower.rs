//! Follows a branch of forced orbits over one parameter.
//!
//! Pseudo-arclength continuation passes folds. At every orbit all Floquet multipliers (characteristic multipliers) of
//! the linearized delay equation are computed. Steps are so short that each multiplier near the unit circle can be
//! identified again.

use nalgebra::DVector;
use num_complex::Complex64;
use quietcut_numerics::roots::SignChange;

use super::branch::{Branch, BranchPoint, BrokenBranch, Event, Extent};
use super::pairing::{FOLLOWED, nearest, pair, share_of_distance};
use super::parameter::Place;
use super::periodic_orbit::{Orbit, OrbitError, PeriodMap, Predecessor, Scale, Tangent};
use crate::criteria::{
    BRANCH_STEP_CLEAR, BRANCH_STEP_MAX, BRANCH_STEP_MIN, CIRCLE_SHARE_MAX, LEAST_ERROR, ORBIT_ROOM,
};
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

pub(super) struct Follower<M> {
    pub(super) map: M,
    rpm: f64,
    scale: Scale,
    /// First and last value of the parameter, in the unit of computations.
    range: [f64; 2],
}

/// Orbit with its Floquet multipliers.
#[derive(Clone)]
pub(super) struct Sample {
    pub(super) orbit: Orbit,
    tangent: Tangent,
    /// Orbit from which this one was reached; `None` for the first one of a branch.
    before: Option<Predecessor>,
    /// Floquet multipliers of the orbit near or outside the unit circle, in the upper half plane or on the real axis.
    roots: Vec<Complex64>,
    largest: f64,
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
        }
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
        self.whole(&Orbit::rest(&self.map), extent)
            .map_err(|broken| broken.cause)
    }

    /// Follows the branch through an orbit at the first value of the range.
    pub(super) fn whole(&self, start: &Orbit, extent: Extent) -> Result<Branch, BrokenBranch> {
        let order = self.map.size();
        let mut towards = DVector::zeros(order + 1);
        towards[order] = (self.range[1] - self.range[0]).signum();
        let here = self
            .sample(start, &towards)
            .map_err(|cause| BrokenBranch { cause, branch: None })?;
        let mut branch = Branch {
            parameter: self.map.parameter(),
            rpm: self.rpm,
            points: vec![self.point(&here)],
            events: Vec::new(),
        };
        match self.extend(&mut branch, here, extent) {
            Ok(()) => Ok(branch),
            Err(cause) => Err(BrokenBranch {
                cause,
                branch: Some(Box::new(branch)),
            }),
        }
    }

    /// Appends to a branch what follows its last orbit.
    fn extend(&self, branch: &mut Branch, mut here: Sample, extent: Extent) -> Result<(), OrbitError> {
        let [low, high] = [self.range[0].min(self.range[1]), self.range[0].max(self.range[1])];
        let mut step = BRANCH_STEP_MAX;
        for _ in 0..STEPS_MAX {
            let place = self.place(&here.orbit);
            let next = self.step(&here, step).and_then(|next| {
                let pairs = pair(&here.roots, &next.roots, step <= 2.0 * BRANCH_STEP_MIN);
                Ok((next, pairs.ok_or(OrbitError::NoConvergence { place })?))
            });
            let (next, pairs) = match next {
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
            let mut events: Vec<(f64, Event)> = pairs
                .iter()
                .filter(|(from, to)| (from.norm() > 1.0) != (to.norm() > 1.0))
                .filter_map(|&(from, to)| self.refine(&here, step, from, to))
                .collect();
            events.sort_by(|a, b| a.0.total_cmp(&b.0));
            branch.events.extend(events.into_iter().map(|(_, event)| event));
            here = next;
            branch.points.push(self.point(&here));
            let lost = extent == Extent::FirstLoss && branch.events.iter().any(|event| !event.gain);
            if lost || here.orbit.value >= high || here.orbit.value <= low {
                return Ok(());
            }
            // The share that a multiplier moves grows with the step; four fifths of the largest leave room for its
            // acceleration.
            let clear = (0.8 * CIRCLE_SHARE_MAX / share * step).clamp(BRANCH_STEP_MAX, BRANCH_STEP_CLEAR);
            step = (1.5 * step).min(clear);
        }
        Err(OrbitError::NoConvergence {
            place: self.place(&here.orbit),
        })
    }

    /// Forced orbit with its multipliers one step further along the branch.
    fn step(&self, from: &Sample, step: f64) -> Result<Sample, OrbitError> {
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
    fn value(&self, from: &Sample, step: f64) -> Result<f64, OrbitError> {
        let guess = self.predicted(from, step);
        let (orbit, _) = Orbit::correct(&self.map, &guess, self.scale, &from.tangent.along)?;
        Ok(orbit.value)
    }

    fn sample(&self, guess: &Orbit, normal: &DVector<f64>) -> Result<Sample, OrbitError> {
        let (orbit, tangent) = Orbit::correct(&self.map, guess, self.scale, normal)?;
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

    /// Crossing of the unit circle by the multiplier that moves from one value to another over a step, with the length
    /// of the step along the branch to it. Regula falsi with the weights of Anderson and Björck keeps the crossing
    /// enclosed. `None` if an orbit in between fails or has no followed multiplier.
    fn refine(&self, here: &Sample, step: f64, from: Complex64, to: Complex64) -> Option<(f64, Event)> {
        let outward = to.norm() > 1.0;
        let mut bracket = SignChange::new([0.0, from.norm() - 1.0], [step, to.norm() - 1.0]);
        let mut roots = [from, to];
        let mut sample = here.clone();
        let mut root = from;
        for _ in 0..60 {
            let middle = bracket.next();
            let [low, high] = bracket.ends();
            let share = ((middle - low) / (high - low)).clamp(0.0, 1.0);
            let expected = roots[0] + (roots[1] - roots[0]) * share;
            sample = self.step(here, middle).ok()?;
            root = nearest(&sample.roots, expected)?;
            let excess = root.norm() - 1.0;
            if excess.abs() < 1e-11 || bracket.width() < 1e-11 {
                break;
            }
            roots[bracket.narrow(middle, excess)] = root;
        }
        let on_circle = root / root.norm();
        let parameter = self.map.parameter();
        let kind = StabilityLoss::of(root);
        let event = Event {
            value: self.place(&sample.orbit).value,
            error: parameter.in_results(self.error(&sample, root).unwrap_or(self.scale.value)),
            kind,
            gain: !outward,
            multiplier: on_circle,
            orbit: sample.orbit.clone(),
            chatter_hz: match kind {
                // At a fold the orbit jumps to another one of the same period, so that no new frequency appears.
                StabilityLoss::Fold => None,
                _ => self.map.chatter_hz(&sample.orbit, on_circle),
            },
        };
        Some((bracket.ends()[0], event))
    }

    /// Error of the parameter at a crossing: its change along the branch over which the multiplier moves by its error,
    /// the larger one of both directions, plus [`ORBIT_ROOM`] times its change on a finer mesh.
    /// `None` if it cannot be computed, or if the multiplier hardly moves along the branch.
    fn error(&self, at: &Sample, root: Complex64) -> Option<f64> {
        let order = self.map.problem().order();
        let finer = Follower {
            map: self.map.finer()?,
            rpm: self.rpm,
            scale: self.scale,
            range: self.range,
        };
        // Normal of the hyperplane in which the orbit is corrected on the finer mesh. It contains only the states of
        // the structure and the parameter, which both meshes have in common.
        let mut normal = DVector::zeros(finer.map.size() + 1);
        normal
            .rows_mut(0, order)
            .copy_from(&at.tangent.along.rows(0, order));
        normal[finer.map.size()] = at.tangent.along[self.map.size()];
        let length = normal.norm();
        let there = finer
            .sample(&at.orbit.onto(&self.map, &finer.map), &(normal / length))
            .ok()?;
        let change = (nearest(&there.roots, root)? - root).norm();
        let error = (ORBIT_ROOM * change).max(LEAST_ERROR);
        let beside = self.step(at, BRANCH_STEP_MIN).ok()?;
        let slope = (nearest(&beside.roots, root)?.norm() - root.norm()).abs() / BRANCH_STEP_MIN;
        let reach = error / slope;
        if reach.is_nan() || reach > BRANCH_STEP_MAX {
            return None;
        }
        let value = at.orbit.value;
        let shift = |step: f64| Some((self.value(at, step).ok()? - value).abs());
        let along = shift(reach)?.max(shift(-reach)?);
        // At a fold the parameter is stationary along the branch, so that its change vanishes. At least [`LEAST_ERROR`]
        // of the parameter is therefore stated.
        Some(along.max(LEAST_ERROR * value) + ORBIT_ROOM * (there.orbit.value - value).abs())
    }

    fn point(&self, sample: &Sample) -> BranchPoint {
        BranchPoint {
            value: self.place(&sample.orbit).value,
            amplitude_mm: self.map.problem().amplitude_mm(&sample.orbit.states),
            multiplier_abs: sample.largest,
            outside: sample.outside(),
        }
    }
}
