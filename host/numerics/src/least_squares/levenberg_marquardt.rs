//! Nonlinear least squares by Levenberg and Marquardt.

use nalgebra::{DMatrix, DVector};

use super::{invert_normal_equations, solve_normal_equations};

/// A nonlinear sum of squares, linearized at some parameters.
pub trait Linearization {
    /// N = JᵀJ, n × n, of the residuals over their noise.
    fn normal_matrix(&self) -> &DMatrix<f64>;

    /// g = Jᵀr, n entries, r = measured − predicted and J the derivative of the predicted.
    fn gradient(&self) -> &DVector<f64>;

    /// True where these parameters are no worse than those `before`.
    fn is_no_worse_than(&self, before: &Self) -> bool;

    /// True where the sums of both hold the same data; a step between others does not count as converged.
    fn is_comparable_with(&self, _before: &Self) -> bool {
        true
    }

    /// False where the model holds for too few of the data to go on.
    fn is_usable(&self) -> bool {
        true
    }
}

/// The reason for which an iteration stopped.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Stop {
    /// The step is below the tolerance: a minimum.
    Converged,
    /// No step of any damping makes the sum smaller.
    Stagnated,
    /// The data do not determine the parameters: N is singular even when damped.
    Singular,
    /// The model does not hold for enough of the data.
    Unusable,
    /// The bound of the iterations is reached.
    Iterations,
}

/// Parameters where an iteration stopped, and why.
#[derive(Clone, Debug)]
pub struct Minimum<L> {
    /// θ, n entries.
    pub parameters: DVector<f64>,
    /// The sums there.
    pub at: L,
    /// The reason.
    pub stop: Stop,
    /// Steps that were tried.
    pub iterations: usize,
}

/// The damped Gauss–Newton iteration (N + λ diag N) δ = g (Marquardt, J. SIAM 11 (1963) 431).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LevenbergMarquardt {
    /// λ of the first step: 0 near the minimum.
    pub damping: f64,
    /// The bound of the iterations.
    pub iterations_max: usize,
    /// √(δᵀNδ) of the last step: with residuals over their noise the step in standard deviations of the parameters.
    pub tolerance: f64,
}

/// λ after the first step that makes the sum larger.
const DAMPING_MIN: f64 = 1e-3;
/// λ below which the next step is not damped.
const DAMPING_NONE: f64 = 1e-6;
/// λ beyond which no step makes the sum smaller.
const DAMPING_MAX: f64 = 1e8;

impl LevenbergMarquardt {
    /// The parameters of the least sum from `start`; `linearize` gives the sums at some parameters.
    ///
    /// Always returns: see [`Minimum::stop`] for the reason.
    pub fn minimize<L: Linearization>(
        &self,
        start: DVector<f64>,
        linearize: impl Fn(&DVector<f64>) -> L,
    ) -> Minimum<L> {
        let mut damping = self.damping;
        let at = linearize(&start);
        let mut here = Minimum {
            parameters: start,
            at,
            stop: Stop::Iterations,
            iterations: 0,
        };
        for iteration in 0..self.iterations_max {
            here.iterations = iteration;
            if !here.at.is_usable() {
                here.stop = Stop::Unusable;
                return here;
            }
            let mut matrix = here.at.normal_matrix().clone();
            for i in 0..here.parameters.len() {
                matrix[(i, i)] *= 1.0 + damping;
            }
            let Some(step) = solve_normal_equations(&matrix, here.at.gradient()) else {
                // Far from the minimum parameters may look alike that are not.
                if damping >= 1.0 {
                    here.stop = Stop::Singular;
                    return here;
                }
                damping = (10.0 * damping).max(DAMPING_MIN);
                continue;
            };
            let next = &here.parameters + &step;
            let tried = linearize(&next);
            // Weights may move with the parameters, so that the sum itself need not fall at the very end.
            let length = step.dot(&(here.at.normal_matrix() * &step)).sqrt();
            if length < self.tolerance && tried.is_comparable_with(&here.at) {
                return Minimum {
                    parameters: next,
                    at: tried,
                    stop: Stop::Converged,
                    iterations: iteration + 1,
                };
            }
            if tried.is_no_worse_than(&here.at) {
                (here.parameters, here.at) = (next, tried);
                damping = if damping < DAMPING_NONE {
                    0.0
                } else {
                    0.1 * damping
                };
            } else {
                damping = (10.0 * damping).max(DAMPING_MIN);
                if damping > DAMPING_MAX {
                    here.stop = Stop::Stagnated;
                    return here;
                }
            }
        }
        here.iterations = self.iterations_max;
        here
    }
}

/// The sums of residuals and a Jacobian that are held whole.
#[derive(Clone, Debug, PartialEq)]
pub struct Residuals {
    matrix: DMatrix<f64>,
    gradient: DVector<f64>,
    sum: f64,
}

impl Residuals {
    /// From r = measured − predicted, m entries, and J = ∂predicted/∂θ, m × n, both over the noise.
    pub fn new(residual: &DVector<f64>, jacobian: &DMatrix<f64>) -> Self {
        Self {
            matrix: jacobian.tr_mul(jacobian),
            gradient: jacobian.tr_mul(residual),
            sum: residual.norm_squared(),
        }
    }

    /// rᵀr.
    pub fn sum_of_squares(&self) -> f64 {
        self.sum
    }

    /// (JᵀJ)⁻¹, the covariance of the parameters with unit-variance noise; `None` where the data do not determine them.
    pub fn covariance(&self) -> Option<DMatrix<f64>> {
        invert_normal_equations(&self.matrix)
    }
}

impl Linearization for Residuals {
    fn normal_matrix(&self) -> &DMatrix<f64> {
        &self.matrix
    }

    fn gradient(&self) -> &DVector<f64> {
        &self.gradient
    }

    fn is_no_worse_than(&self, before: &Self) -> bool {
        self.sum <= before.sum
    }
}
