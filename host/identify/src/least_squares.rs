//! Weighted least-squares fit of an equation of motion to dwells of steady motion; the weights depend on the
//! parameters.

use crate::criteria::LARGEST_MISFIT;
use nalgebra::{DMatrix, DVector};
use quietcut_numerics::Stop;
use quietcut_numerics::least_squares::{
    Damping, Idle, LevenbergMarquardt, Minimum, NormalSums, Objective, invert_normal_equations,
};

/// Reason why an equation of motion cannot be fitted to dwells of steady motion.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum FitError {
    /// There are too few usable dwells for the number of parameters of the equation of motion.
    #[error(
        "{found} dwells with motion in every direction are too few for {parameters} parameters; at least {needed} are needed"
    )]
    TooFew {
        /// Number of usable dwells.
        found: usize,
        /// Number of parameters.
        parameters: usize,
        /// Number of dwells needed.
        needed: usize,
    },
    /// The dwells do not determine the parameters of the equation of motion.
    #[error(
        "the data do not determine all parameters; more force levels, or frequencies on both sides of the resonance, are needed"
    )]
    Undetermined,
    /// At some dwells no motion was predicted: in general the equation of motion has no periodic solution near the
    /// measured motion there.
    #[error(
        "the law has no periodic motion near the measured one at {failed} of {all} dwells; another law is needed, or steadier data"
    )]
    NoMotion {
        /// Number of dwells at which no motion was predicted.
        failed: usize,
        /// Number of all dwells.
        all: usize,
    },
    /// The iteration found no minimum of the sum of squares over the dwells.
    #[error("the fit does not converge; its sum of squares over degrees of freedom is {0:.3e}")]
    NotConverged(f64),
}

/// Normal equations for the parameters of an equation of motion, summed over dwells, from the whitened residual r of
/// each dwell and the derivative S of its whitened prediction by the parameters.
pub(super) struct Normal {
    /// Σ SᵀS and Σ Sᵀr.
    sums: NormalSums,
    /// Σ Sᵀr rᵀS.
    scatter: DMatrix<f64>,
    /// Σ rᵀr.
    sum: f64,
    rows: usize,
    /// Number of dwells at which no motion was predicted.
    failed: usize,
    dwells: usize,
}

/// Covariance of the parameters of an equation of motion, and misfit of its fit to dwells.
pub(super) struct Spread {
    /// Covariance of the parameters.
    pub(super) covariance: DMatrix<f64>,
    /// χ² per degree of freedom: near 1 if the equation of motion explains the dwells within their noise.
    pub(super) misfit: f64,
    /// True if the covariance is the sandwich covariance, from the scatter of the gradient between dwells; false if it
    /// follows from the noise alone.
    pub(super) robust: bool,
}

impl Normal {
    /// Empty normal equations for `size` parameters.
    pub(super) fn new(size: usize) -> Self {
        Self {
            sums: NormalSums {
                matrix: DMatrix::zeros(size, size),
                gradient: DVector::zeros(size),
            },
            scatter: DMatrix::zeros(size, size),
            sum: 0.0,
            rows: 0,
            failed: 0,
            dwells: 0,
        }
    }

    /// Adds the whitened residual (measured − predicted motion) of a dwell and the derivative of the whitened
    /// prediction by the parameters; `None` counts the dwell as one without a predicted motion.
    pub(super) fn add(&mut self, dwell: Option<(DVector<f64>, DMatrix<f64>)>) {
        self.dwells += 1;
        let Some((residual, slope)) = dwell else {
            self.failed += 1;
            return;
        };
        let gradient = slope.tr_mul(&residual);
        self.sums.matrix += slope.tr_mul(&slope);
        self.scatter += &gradient * gradient.transpose();
        self.sums.gradient += gradient;
        self.sum += residual.norm_squared();
        self.rows += residual.len();
    }

    fn failure(&self) -> FitError {
        FitError::NoMotion {
            failed: self.failed,
            all: self.dwells,
        }
    }

    fn misfit(&self) -> f64 {
        self.sum / self.rows.saturating_sub(self.sums.gradient.len()).max(1) as f64
    }

    /// Covariance of the parameters, and misfit of the fit to the dwells.
    ///
    /// # Errors
    /// No motion was predicted at a dwell, or the dwells do not determine the parameters.
    pub(super) fn spread(&self) -> Result<Spread, FitError> {
        if self.failed > 0 {
            return Err(self.failure());
        }
        let inverse = invert_normal_equations(&self.sums.matrix).ok_or(FitError::Undetermined)?;
        let misfit = self.misfit();
        let robust = misfit > LARGEST_MISFIT;
        let covariance = if robust {
            &inverse * &self.scatter * &inverse
        } else {
            inverse
        };
        Ok(Spread {
            covariance,
            misfit,
            robust,
        })
    }
}

/// Sum of squared whitened residuals over all dwells as a function of the parameters of the equation of motion.
struct DwellFit<F>(F);

/// Length of the step, in standard deviations of the parameters, below which a fit to dwells has converged: far below
/// the width of any interval.
const LAST_STEP: f64 = 1e-3;

/// χ² per degree of freedom below which a fit to dwells is exact: residuals are below a thousandth of the noise, so
/// that rounding of the predicted motion moves every step.
const EXACT_MISFIT: f64 = 1e-6;

/// Relative increase of the sum of squares of a fit to dwells that still counts as no worse: the weights change with
/// the parameters, and the sum with them.
const NO_WORSE: f64 = 1e-6;

impl<F: Fn(&DVector<f64>) -> Normal> Objective for DwellFit<F> {
    type Point = DVector<f64>;
    type Value = Normal;

    fn value(&mut self, point: &DVector<f64>) -> Option<Normal> {
        Some((self.0)(point))
    }

    fn linearize(&mut self, _: &DVector<f64>, value: &Normal) -> Option<NormalSums> {
        Some(value.sums.clone())
    }

    fn moved(&self, point: &DVector<f64>, step: &DVector<f64>) -> DVector<f64> {
        point + step
    }

    fn is_no_worse(&self, next: &Normal, now: &Normal) -> bool {
        next.failed < now.failed || (next.failed == now.failed && next.sum <= now.sum * (1.0 + NO_WORSE))
    }

    fn has_converged(&self, length: f64, next: &Normal, now: &Normal) -> bool {
        length < LAST_STEP && next.failed == now.failed
    }

    /// A predicted motion that is missing at a few dwells may appear once the parameters are better; if it is missing
    /// at more than half of the dwells, the fit is given up.
    fn gives_up(&self, _: usize, value: &Normal, _: Option<&Normal>) -> bool {
        value.failed * 2 > value.dwells
    }
}

/// Parameters with the smallest sum of squares over the dwells, by Levenberg–Marquardt steps from `start`. The first
/// step adds the fraction `damping` of the diagonal of the normal matrix to this diagonal; 0 for a start near the
/// minimum.
///
/// # Errors
/// See [`FitError`].
pub(super) fn minimum(
    start: DVector<f64>,
    damping: f64,
    of: impl Fn(&DVector<f64>) -> Normal,
) -> Result<(DVector<f64>, Normal), FitError> {
    let found = descend(start, damping, 60, of)?;
    if found.stop == Stop::Converged || found.value.misfit() < EXACT_MISFIT {
        Ok((found.point, found.value))
    } else {
        Err(FitError::NotConverged(found.value.misfit()))
    }
}

/// Parameters after at most 25 Levenberg–Marquardt steps towards the smallest sum of squares over the dwells; the steps
/// need not converge.
///
/// # Errors
/// The dwells do not determine the parameters, or no motion was predicted at more than half of them.
pub(super) fn nearer(
    start: DVector<f64>,
    damping: f64,
    of: impl Fn(&DVector<f64>) -> Normal,
) -> Result<DVector<f64>, FitError> {
    descend(start, damping, 25, of).map(|found| found.point)
}

fn descend(
    start: DVector<f64>,
    damping: f64,
    iterations_max: usize,
    of: impl Fn(&DVector<f64>) -> Normal,
) -> Result<Minimum<DVector<f64>, Normal>, FitError> {
    let iteration = LevenbergMarquardt {
        damping: Damping::tenfold(damping),
        iterations_max,
        // The damping λ is tried at 0, then from 1e-3 to 1e8: with the largest, steps are shorter than [`LAST_STEP`]
        // even where rounding hides the minimum.
        trials_max: 13,
        ridge: 0.0,
        idle: Idle::Refuse,
    };
    let found = iteration
        .minimize(&mut DwellFit(of), start)
        .ok_or(FitError::Undetermined)?;
    match found.stop {
        Stop::Singular => Err(FitError::Undetermined),
        Stop::GivenUp => Err(found.value.failure()),
        _ => Ok(found),
    }
}
