//! Nonlinear least squares by Levenberg and Marquardt.

use nalgebra::{DMatrix, DVector};

use super::{Idle, NormalEquations};
use crate::stop::Stop;

/// A sum of squares ‖r(θ)‖² of residuals over their noise, r = measured − predicted, to be minimized.
///
/// The point θ is a type of the caller: a vector, or the parts of a model. Values and derivatives are separate, since most trial points
/// need no derivatives.
pub trait Objective {
    /// The point θ.
    type Point;

    /// The sum of squares at a point, with all that comparing and linearizing need.
    type Value;

    /// The value at a point; `None` where the model does not hold there.
    fn value(&mut self, point: &Self::Point) -> Option<Self::Value>;

    /// The normal equations at a point; `None` where they break down.
    fn linearize(&mut self, point: &Self::Point, value: &Self::Value) -> Option<NormalSums>;

    /// θ + δ, within the bounds of the parameters.
    fn moved(&self, point: &Self::Point, step: &DVector<f64>) -> Self::Point;

    /// The step, shortened where the parameters may not move so far at once.
    fn limited(&self, step: DVector<f64>) -> DVector<f64> {
        step
    }

    /// True where the value `next` is no worse than the value `now`.
    fn is_no_worse(&self, next: &Self::Value, now: &Self::Value) -> bool;

    /// True where a step of `length` = √(δᵀNδ) from `now` to `next` is the last one.
    ///
    /// The length is in standard deviations of the parameters. A step to a worse value may be the last one: weights that move with the
    /// parameters keep the sum from falling at the very end.
    fn has_converged(&self, length: f64, next: &Self::Value, now: &Self::Value) -> bool;

    /// True where the value is not worth another linearization; `before` is the value at the linearization before.
    fn gives_up(&self, _round: usize, _value: &Self::Value, _before: Option<&Self::Value>) -> bool {
        false
    }

    /// True where the linearization promises too little for a step.
    fn gives_up_linearized(&self, _round: usize, _value: &Self::Value, _sums: &NormalSums) -> bool {
        false
    }
}

/// N = JᵀJ, n × n, and g = Jᵀr, n entries, of r = measured − predicted and J = ∂predicted/∂θ, both over the noise.
#[derive(Clone, Debug, PartialEq)]
pub struct NormalSums {
    /// N.
    pub matrix: DMatrix<f64>,
    /// g.
    pub gradient: DVector<f64>,
}

/// The point where a minimization stopped.
#[derive(Clone, Debug)]
pub struct Minimum<P, V> {
    /// θ.
    pub point: P,
    /// The value there.
    pub value: V,
    /// The sums of the last linearization, at θ or one step before; `None` if there was none.
    pub sums: Option<NormalSums>,
    /// Reason for which the iteration stopped.
    pub stop: Stop,
    /// Linearizations.
    pub iterations: usize,
}

/// The damping λ of (N + λ diag N) δ = g, and how it changes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Damping {
    /// Damping λ of the first step; 0 if the start is near the minimum.
    pub first: f64,
    /// The factor of λ after an improvement, below 1.
    pub shrink: f64,
    /// The factor of λ after a step without improvement, above 1.
    pub growth: f64,
    /// The least λ after an improvement: above 0 where N is singular.
    pub least: f64,
    /// The least λ after a step without improvement.
    pub least_retried: f64,
}

impl Damping {
    /// λ falls and rises tenfold; undamped near the minimum.
    pub fn tenfold(first: f64) -> Self {
        Self {
            first,
            shrink: 0.1,
            growth: 10.0,
            least: 0.0,
            least_retried: 1e-3,
        }
    }

    fn shrunk(&self, damping: f64) -> f64 {
        if self.least == 0.0 && damping < UNDAMPED {
            0.0
        } else {
            (self.shrink * damping).max(self.least)
        }
    }

    fn grown(&self, damping: f64) -> f64 {
        (self.growth * damping).max(self.least_retried)
    }
}

/// λ below which the next step is not damped: it changes the step by a millionth.
const UNDAMPED: f64 = 1e-6;

/// The damped Gauss–Newton iteration (Marquardt, J. SIAM 11 (1963) 431).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LevenbergMarquardt {
    /// The damping.
    pub damping: Damping,
    /// The bound of the linearizations.
    pub iterations_max: usize,
    /// The bound of the steps that are tried from one point.
    pub trials_max: usize,
    /// The treatment of parameters without effect.
    pub idle: Idle,
}

impl LevenbergMarquardt {
    /// The parameters of the least sum near `start`; `None` where the model does not hold at the start.
    ///
    /// Always returns: see [`Minimum::stop`].
    pub fn minimize<O: Objective>(
        &self,
        objective: &mut O,
        start: O::Point,
    ) -> Option<Minimum<O::Point, O::Value>> {
        let value = objective.value(&start)?;
        let mut here = Minimum {
            point: start,
            value,
            sums: None,
            stop: Stop::Iterations,
            iterations: 0,
        };
        let mut damping = self.damping.first;
        let mut before: Option<O::Value> = None;
        while here.iterations < self.iterations_max {
            if objective.gives_up(here.iterations, &here.value, before.as_ref()) {
                here.stop = Stop::GivenUp;
                break;
            }
            let Some(sums) = objective.linearize(&here.point, &here.value) else {
                here.stop = Stop::LeftDomain;
                break;
            };
            let gives_up = objective.gives_up_linearized(here.iterations, &here.value, &sums);
            here.iterations += 1;
            let sums = here.sums.insert(sums);
            if gives_up {
                here.stop = Stop::GivenUp;
                break;
            }
            let mut moved = None;
            for _ in 0..self.trials_max {
                let Some(step) = self.step(sums, damping) else {
                    // Far from the minimum, the normal matrix may be singular although the data determine the parameters: damp more.
                    if damping >= 1.0 {
                        here.stop = Stop::Singular;
                        return Some(here);
                    }
                    damping = self.damping.grown(damping);
                    continue;
                };
                let step = objective.limited(step);
                let length = step.dot(&(&sums.matrix * &step)).max(0.0).sqrt();
                let point = objective.moved(&here.point, &step);
                if let Some(value) = objective.value(&point) {
                    if objective.has_converged(length, &value, &here.value) {
                        (here.point, here.value, here.stop) = (point, value, Stop::Converged);
                        return Some(here);
                    }
                    if objective.is_no_worse(&value, &here.value) {
                        moved = Some((point, value));
                        break;
                    }
                }
                damping = self.damping.grown(damping);
            }
            let Some((point, value)) = moved else {
                here.stop = Stop::Stagnated;
                break;
            };
            here.point = point;
            before = Some(std::mem::replace(&mut here.value, value));
            damping = self.damping.shrunk(damping);
        }
        Some(here)
    }

    fn step(&self, sums: &NormalSums, damping: f64) -> Option<DVector<f64>> {
        let step = NormalEquations::new(&sums.matrix, damping, self.idle)?.solve(&sums.gradient);
        step.iter().all(|entry| entry.is_finite()).then_some(step)
    }
}
