//! Crossings of the unit circle by the Floquet multipliers (characteristic multipliers) along a branch, with their errors.

use nalgebra::DVector;
use num_complex::Complex64;
use quietcut_numerics::roots::SignChange;

use super::branch::Event;
use super::follower::{Follower, Sample};
use super::pairing::nearest;
use super::periodic_orbit::PeriodMap;
use crate::criteria::{BRANCH_STEP_MAX, BRANCH_STEP_MIN, LEAST_ERROR, ORBIT_ROOM};
use crate::spectrum::stability_loss::StabilityLoss;

impl<M: PeriodMap> Follower<M> {
    /// Crossing of the unit circle by the multiplier that moves from one value to another over a step, with the length
    /// of the step along the branch to it. Regula falsi with the weights of Anderson and Björck keeps the crossing
    /// enclosed. `None` if an orbit in between fails or has no followed multiplier.
    pub(super) fn refine(
        &self,
        here: &Sample,
        step: f64,
        from: Complex64,
        to: Complex64,
    ) -> Option<(f64, Event)> {
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
            after: 0,
            multiplier: on_circle,
            amplitude_mm: self.map.problem().amplitude_mm(&sample.orbit.states),
            displacement_mm: self.map.problem().displacement_mm(&sample.orbit.start),
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
            lands: self.lands,
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
}
