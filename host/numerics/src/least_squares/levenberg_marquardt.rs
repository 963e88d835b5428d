//! Nonlinear least squares by the Levenberg–Marquardt method.

use nalgebra::{DMatrix, DVector};

use super::{Idle, NormalEquations};
use crate::stop::Stop;

/// A sum of squares ‖r(θ)‖² to be minimized, where the residuals r = measured − predicted are divided by the standard
/// deviation of their noise.
///
/// The caller chooses the type of the parameters θ: a vector, or the parts of a model. Value and derivatives are
/// computed by separate methods, since a rejected step needs no derivatives.
pub trait Objective {
    /// Type of the parameters θ.
    type Point;

    /// The sum of squares at given parameters θ, with the intermediate results that comparison and linearization use.
    type Value;

    /// The sum of squares at the parameters `point`; `None` if it cannot be computed or is not finite.
    fn value(&mut self, point: &Self::Point) -> Option<Self::Value>;

    /// The normal equations at the parameters `point`; `None` if they cannot be computed.
    fn linearize(&mut self, point: &Self::Point, value: &Self::Value) -> Option<NormalSums>;

    /// The parameters θ + δ with θ = `point` and δ = `step`, limited to the bounds of the parameters, if any.
    fn moved(&self, point: &Self::Point, step: &DVector<f64>) -> Self::Point;

    /// The step δ, shortened if it exceeds the largest change that the model allows in one step; by default the step
    /// itself.
    fn limited(&self, step: DVector<f64>) -> DVector<f64> {
        step
    }

    /// True if a step from the value `now` to the value `next` is accepted, usually because it does not increase the
    /// sum of squares.
    fn is_no_worse(&self, next: &Self::Value, now: &Self::Value) -> bool;

    /// True if the minimization has converged with a step of `length` = √(δᵀNδ), in standard deviations of the
    /// parameters, from the value `now` to the value `next`.
    ///
    /// This step is accepted without [`Self::is_no_worse`], so that it may increase the sum slightly: weights that
    /// depend on the parameters may keep the sum from decreasing close to the minimum.
    fn has_converged(&self, length: f64, next: &Self::Value, now: &Self::Value) -> bool;

    /// True if the minimization is to be given up before it is linearized at `value`; `before` is the sum of squares at
    /// the preceding linearization, `None` before the first one. `round` counts the linearizations so far.
    fn gives_up(&self, _round: usize, _value: &Self::Value, _before: Option<&Self::Value>) -> bool {
        false
    }

    /// True if the minimization is to be given up after its linearization `sums` at `value`, usually since that
    /// predicts too small a decrease of the sum of squares. `round` counts the linearizations before this one.
    fn gives_up_linearized(&self, _round: usize, _value: &Self::Value, _sums: &NormalSums) -> bool {
        false
    }
}

/// Normal equations N δ = g of a linearized least-squares problem: N = JᵀJ, n × n, and g = Jᵀr, n entries. The
/// residuals r = measured − predicted and the Jacobian J = ∂predicted/∂θ are both divided by the standard deviation of
/// the noise.
#[derive(Clone, Debug, PartialEq)]
pub struct NormalSums {
    /// Normal matrix N.
    pub matrix: DMatrix<f64>,
    /// Right side g.
    pub gradient: DVector<f64>,
}

/// Parameters at which a minimization stopped, and the reason for the stop.
#[derive(Clone, Debug)]
pub struct Minimum<P, V> {
    /// Parameters θ.
    pub point: P,
    /// Sum of squares at these parameters.
    pub value: V,
    /// Normal equations of the last linearization, at these parameters or one step before; `None` if there was no
    /// linearization.
    pub sums: Option<NormalSums>,
    /// Reason for which the iteration stopped.
    pub stop: Stop,
    /// Number of linearizations.
    pub iterations: usize,
}

/// Damping λ of the equations (N + λ diag N) δ = g of a step δ, and the rule by which it changes from step to step.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Damping {
    /// Damping λ of the first step; 0 suits a start near the minimum.
    pub first: f64,
    /// Factor, below 1, by which λ changes after an accepted step.
    pub shrink: f64,
    /// Factor, above 1, by which λ changes after a rejected step, or if the equations of the step have no finite
    /// solution.
    pub growth: f64,
    /// Smallest λ after an accepted step; to be set above 0 if the normal matrix N may be singular.
    pub least: f64,
    /// Smallest λ after it has grown.
    pub least_retried: f64,
}

impl Damping {
    /// Rule that changes the damping λ by a factor of ten: to at least 1e-3 when it grows, and to 0 after an accepted
    /// step with λ below 1e-6. `first` is λ of the first step.
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

/// Damping λ of an accepted Levenberg–Marquardt step below which λ of the next step is 0 if [`Damping::least`] is 0: it
/// would change a step by about a millionth only, unless the normal matrix is nearly singular.
const UNDAMPED: f64 = 1e-6;

/// Settings of the damped Gauss–Newton iteration of Levenberg and Marquardt (Marquardt, J. SIAM 11 (1963) 431).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LevenbergMarquardt {
    /// Damping of the steps.
    pub damping: Damping,
    /// Largest number of linearizations.
    pub iterations_max: usize,
    /// Largest number of dampings, each larger than the one before, that are tried from one linearization.
    pub trials_max: usize,
    /// Ridge that is added to the damping λ of every step: it regularizes parameters whose effects are linearly
    /// dependent within the accuracy of the derivatives.
    pub ridge: f64,
    /// Treatment of parameters that have no effect on the prediction.
    pub idle: Idle,
}

impl LevenbergMarquardt {
    /// Searches the parameters with the least sum of squares near `start`; `None` if [`Objective::value`] is `None`
    /// there.
    ///
    /// The search always ends; [`Minimum::stop`] states the reason.
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
                    // Far from the minimum, the normal matrix may be singular although the data determine the
                    // parameters: the step is tried with more damping, unless λ is 1 or more.
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
        let step = NormalEquations::new(&sums.matrix, self.ridge + damping, self.idle)?.solve(&sums.gradient);
        step.iter().all(|entry| entry.is_finite()).then_some(step)
    }
}
