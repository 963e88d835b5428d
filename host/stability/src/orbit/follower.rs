//! Follows a branch of forced orbits over the axial depth.
//!
//! Pseudo-arclength continuation passes folds. At every orbit all Floquet multipliers (characteristic multipliers) of
//! the linearized delay equation are computed. Steps are so short that each multiplier near the unit circle can be
//! identified again.

use nalgebra::DVector;
use num_complex::Complex64;
use quietcut_numerics::roots::SignChange;

use super::branch::{Branch, BranchPoint, Event, Extent};
use super::forced::ForcedProblem;
use super::pairing::{FOLLOWED, nearest, pair, share_of_distance};
use super::periodic_orbit::{Orbit, OrbitError, PeriodMap, Predecessor, Scale, Tangent};
use super::revolution_period::RevolutionPeriod;
use super::tooth_period::ToothPeriod;
use crate::criteria::{
    BRANCH_STEP_CLEAR, BRANCH_STEP_MAX, BRANCH_STEP_MIN, CIRCLE_SHARE_MAX, LEAST_ERROR, ORBIT_ROOM,
};
use crate::spectrum::stability_loss::StabilityLoss;

/// Largest number of steps of a branch, failed ones included: ten times the hundred that a branch up and down takes
/// with the longest step. A choice.
const STEPS_MAX: usize = 1000;

/// Follows the forced orbits at one spindle speed from depth 0 until the depth reaches `depth_mm` or returns to 0; with
/// [`Extent::FirstLoss`] at most until a multiplier leaves the unit circle.
///
/// # Errors
/// The branch cannot be followed further with the shortest step, or takes too many steps; or no preceding tooth cuts
/// the surface in front of some tooth.
pub fn follow_depth(
    problem: &ForcedProblem,
    rpm: f64,
    depth_mm: f64,
    extent: Extent,
) -> Result<Branch, OrbitError> {
    let depth_m = depth_mm * 1e-3;
    match &problem.uneven {
        None => Follower::new(ToothPeriod::new(problem, rpm), rpm, depth_m).follow(extent),
        Some(uneven) => {
            let map = RevolutionPeriod::new(problem, uneven, rpm, depth_m)
                .ok_or(OrbitError::Singular { depth_mm })?;
            Follower::new(map, rpm, depth_m).follow(extent)
        }
    }
}

/// Dominant Floquet multiplier of a forced orbit.
pub(super) struct Dominant {
    /// Dominant multiplier of the orbit; of a conjugate pair the one above the real axis.
    pub(super) multiplier: Complex64,
    /// Vibration frequency of the Floquet mode that belongs to the multiplier, Hz; `None` if it cannot be computed.
    pub(super) chatter_hz: Option<f64>,
}

/// Dominant Floquet multiplier about the forced orbit at a depth, from the working mesh and from a finer one.
pub(super) fn multiplier_at(
    problem: &ForcedProblem,
    rpm: f64,
    depth_mm: f64,
) -> Result<[Dominant; 2], OrbitError> {
    match &problem.uneven {
        None => dominant_of(ToothPeriod::new(problem, rpm), rpm, depth_mm),
        Some(uneven) => {
            let map = RevolutionPeriod::new(problem, uneven, rpm, depth_mm * 1e-3)
                .ok_or(OrbitError::Singular { depth_mm })?;
            dominant_of(map, rpm, depth_mm)
        }
    }
}

/// Forced orbit at a depth, reached by continuation from depth 0.
#[cfg(test)]
pub(super) fn orbit_at(problem: &ForcedProblem, rpm: f64, depth_mm: f64) -> Result<Orbit, OrbitError> {
    let depth_m = depth_mm * 1e-3;
    Ok(match &problem.uneven {
        None => Follower::new(ToothPeriod::new(problem, rpm), rpm, depth_m).up_to(depth_m)?,
        Some(uneven) => {
            let map = RevolutionPeriod::new(problem, uneven, rpm, depth_m)
                .ok_or(OrbitError::Singular { depth_mm })?;
            Follower::new(map, rpm, depth_m).up_to(depth_m)?
        }
    }
    .orbit)
}

fn dominant_of<M: PeriodMap>(map: M, rpm: f64, depth_mm: f64) -> Result<[Dominant; 2], OrbitError> {
    let singular = OrbitError::Singular { depth_mm };
    let finer = map.finer().ok_or(singular)?;
    let at = |map: M| {
        let follower = Follower::new(map, rpm, depth_mm * 1e-3);
        let orbit = follower.up_to(depth_mm * 1e-3)?.orbit;
        let all = follower.map.multipliers(&orbit);
        let all = all.map_err(|cause| OrbitError::of_multipliers(cause, depth_mm))?;
        let multiplier = *all.first().ok_or(singular)?;
        let multiplier = Complex64::new(multiplier.re, multiplier.im.abs());
        Ok(Dominant {
            multiplier,
            chatter_hz: follower.map.chatter_hz(&orbit, multiplier),
        })
    };
    Ok([at(map)?, at(finer)?])
}

/// Norm of the orbit's state at the start of the period at a depth, from the equation linearized about rest at depth 0,
/// or 1 if that gives none above 0: the unit of the state along a branch.
pub(super) fn size_at(map: &impl PeriodMap, depth_m: f64) -> f64 {
    let rest = Orbit::rest(map);
    let linear = map
        .integrate(&rest.start, 0.0, &rest.states)
        .and_then(|integration| {
            let by_depth = integration.by.column(map.size()) * depth_m;
            integration.periodic().lu().solve(&by_depth)
        });
    // Without feed and edge forces the orbit is rest, and any unit of its size serves; so it does if the linearized
    // equation is singular.
    linear
        .map(|state| state.norm())
        .filter(|size| *size > 0.0)
        .unwrap_or(1.0)
}

pub(super) struct Follower<M> {
    map: M,
    rpm: f64,
    scale: Scale,
}

/// Orbit with its Floquet multipliers.
#[derive(Clone)]
struct Sample {
    orbit: Orbit,
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
        let scale = Scale {
            state: size_at(&map, depth_m),
            depth_m,
        };
        Self { map, rpm, scale }
    }

    /// Forced orbit with its multipliers at a depth, reached by continuation from depth 0.
    fn up_to(&self, depth_m: f64) -> Result<Sample, OrbitError> {
        let order = self.map.size();
        let mut along_depth = DVector::zeros(order + 1);
        along_depth[order] = 1.0;
        let mut here = self.sample(&Orbit::rest(&self.map), &along_depth)?;
        let mut step = BRANCH_STEP_MAX;
        while here.orbit.depth_m < depth_m {
            let depth_mm = here.orbit.depth_m * 1e3;
            let towards = here.tangent.along[order] * self.scale.depth_m;
            if towards <= 0.0 {
                return Err(OrbitError::Lost { depth_mm });
            }
            let next = if here.orbit.depth_m + towards * step >= depth_m {
                // The last step ends exactly at the requested depth.
                let rest = (depth_m - here.orbit.depth_m) / towards;
                let mut guess = here.orbit.along(&here.tangent, rest, self.scale);
                guess.depth_m = depth_m;
                self.sample(&guess, &along_depth)
            } else {
                self.step(&here, step)
            };
            match next {
                Ok(next) => here = next,
                Err(_) if step > BRANCH_STEP_MIN => step *= 0.5,
                Err(error) => return Err(error),
            }
            if (here.orbit.depth_m - depth_m).abs() <= 1e-12 * depth_m {
                break;
            }
        }
        Ok(here)
    }

    pub(super) fn follow(&self, extent: Extent) -> Result<Branch, OrbitError> {
        let order = self.map.size();
        let mut along_depth = DVector::zeros(order + 1);
        along_depth[order] = 1.0;
        let mut here = self.sample(&Orbit::rest(&self.map), &along_depth)?;
        let mut branch = Branch {
            rpm: self.rpm,
            points: vec![self.point(&here)],
            events: Vec::new(),
        };
        let mut step = BRANCH_STEP_MAX;
        for _ in 0..STEPS_MAX {
            let depth_mm = here.orbit.depth_m * 1e3;
            let next = self.step(&here, step).and_then(|next| {
                let pairs = pair(&here.roots, &next.roots, step <= 2.0 * BRANCH_STEP_MIN);
                Ok((next, pairs.ok_or(OrbitError::NoConvergence { depth_mm })?))
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
            if lost || here.orbit.depth_m >= self.scale.depth_m || here.orbit.depth_m <= 0.0 {
                return Ok(branch);
            }
            // The share that a multiplier moves grows with the step; four fifths of the largest leave room for its
            // acceleration.
            let clear = (0.8 * CIRCLE_SHARE_MAX / share * step).clamp(BRANCH_STEP_MAX, BRANCH_STEP_CLEAR);
            step = (1.5 * step).min(clear);
        }
        Err(OrbitError::NoConvergence {
            depth_mm: here.orbit.depth_m * 1e3,
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

    /// Axial depth of the forced orbit one step further along the branch, m.
    fn depth_m(&self, from: &Sample, step: f64) -> Result<f64, OrbitError> {
        let guess = self.predicted(from, step);
        let (orbit, _) = Orbit::correct(&self.map, &guess, self.scale, &from.tangent.along)?;
        Ok(orbit.depth_m)
    }

    fn sample(&self, guess: &Orbit, normal: &DVector<f64>) -> Result<Sample, OrbitError> {
        let (orbit, tangent) = Orbit::correct(&self.map, guess, self.scale, normal)?;
        let depth_mm = orbit.depth_m * 1e3;
        let all = self
            .map
            .multipliers(&orbit)
            .map_err(|cause| OrbitError::of_multipliers(cause, depth_mm))?;
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
        let kind = StabilityLoss::of(root);
        let event = Event {
            depth_mm: sample.orbit.depth_m * 1e3,
            error_mm: 1e3 * self.error_m(&sample, root).unwrap_or(self.scale.depth_m),
            kind,
            gain: !outward,
            multiplier: on_circle,
            chatter_hz: match kind {
                // At a fold the orbit jumps to another one of the same period, so that no new frequency appears.
                StabilityLoss::Fold => None,
                _ => self.map.chatter_hz(&sample.orbit, on_circle),
            },
        };
        Some((bracket.ends()[0], event))
    }

    /// Error of the depth of a crossing, m: the change of depth along the branch over which the multiplier moves by its
    /// error, the larger one of both directions, plus [`ORBIT_ROOM`] times the change of the depth on a finer mesh.
    /// `None` if it cannot be computed, or if the multiplier hardly moves along the branch.
    fn error_m(&self, at: &Sample, root: Complex64) -> Option<f64> {
        let order = self.map.problem().order();
        let finer = Follower {
            map: self.map.finer()?,
            rpm: self.rpm,
            scale: self.scale,
        };
        // Normal of the hyperplane in which the orbit is corrected on the finer mesh. It contains only the states of
        // the structure and the depth, which both meshes have in common.
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
        let depth_m = at.orbit.depth_m;
        let shift_m = |step: f64| Some((self.depth_m(at, step).ok()? - depth_m).abs());
        let along_m = shift_m(reach)?.max(shift_m(-reach)?);
        // At a fold the depth is stationary along the branch, so that its change vanishes. At least [`LEAST_ERROR`] of
        // the depth is therefore stated.
        Some(along_m.max(LEAST_ERROR * depth_m) + ORBIT_ROOM * (there.orbit.depth_m - depth_m).abs())
    }

    fn point(&self, sample: &Sample) -> BranchPoint {
        let c = &self.map.problem().linear.structure.c;
        let mut low = [f64::INFINITY; 3];
        let mut high = [f64::NEG_INFINITY; 3];
        for states in &sample.orbit.states {
            for state in states.column_iter() {
                let displacement = c * state;
                for axis in 0..3 {
                    low[axis] = low[axis].min(displacement[axis]);
                    high[axis] = high[axis].max(displacement[axis]);
                }
            }
        }
        BranchPoint {
            depth_mm: sample.orbit.depth_m * 1e3,
            amplitude_mm: std::array::from_fn(|axis| 0.5e3 * (high[axis] - low[axis])),
            multiplier_abs: sample.largest,
            outside: sample.outside(),
        }
    }
}
