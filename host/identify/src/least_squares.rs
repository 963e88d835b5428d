//! Weighted least squares on steady motions; the weights depend on the parameters.

use crate::criteria::LARGEST_MISFIT;
use nalgebra::{DMatrix, DVector};
use quietcut_numerics::Stop;
use quietcut_numerics::least_squares::{
    Damping, Idle, LevenbergMarquardt, Minimum, NormalSums, Objective, invert_normal_equations,
};

/// Reason why a law cannot be fitted to dwells.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum FitError {
    /// There are too few dwells for the number of parameters.
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
    /// The data do not determine the parameters.
    #[error(
        "the data do not determine all parameters; more force levels, or frequencies on both sides of the resonance, are needed"
    )]
    Undetermined,
    /// The law has no periodic motion near the measured one at some dwells.
    #[error(
        "the law has no periodic motion near the measured one at {failed} of {all} dwells; another law is needed, or steadier data"
    )]
    NoMotion {
        /// Number of dwells without a predicted motion.
        failed: usize,
        /// Number of all dwells.
        all: usize,
    },
    /// The iteration found no minimum of the sum of squares.
    #[error("the fit does not converge; its sum of squares over degrees of freedom is {0:.3e}")]
    NotConverged(f64),
}

/// Normal equations summed over dwells, from the whitened residual r of each dwell and its derivative S by the parameters.
pub(super) struct Normal {
    /// Σ SᵀS and Σ Sᵀr.
    sums: NormalSums,
    /// Σ Sᵀr rᵀS.
    scatter: DMatrix<f64>,
    /// Σ rᵀr.
    sum: f64,
    rows: usize,
    /// Number of dwells at which the law has no motion near the measured one.
    failed: usize,
    dwells: usize,
}

/// Covariance and misfit of a fit.
pub(super) struct Spread {
    /// Covariance of the parameters.
    pub(super) covariance: DMatrix<f64>,
    /// χ² per degree of freedom: near 1 if the law explains the data.
    pub(super) misfit: f64,
    /// True if the covariance is the sandwich covariance, from the scatter between dwells.
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

    /// Adds the whitened residual (measured − predicted) of a dwell and the derivative of the whitened prediction; `None` counts
    /// the dwell as one without a predicted motion.
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

    /// Covariance and misfit of the parameters.
    ///
    /// # Errors
    /// The law has no motion at a dwell, or the data do not determine the parameters.
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

/// The sum of squares over dwells as a function of the parameters.
struct DwellFit<F>(F);

/// Step, in standard deviations of the parameters, that ends a fit: far below the width of any interval.
const LAST_STEP: f64 = 1e-3;

/// χ² per degree of freedom below which a fit is exact: residuals are below a thousandth of the noise, so that rounding of the predicted
/// motion moves every step.
const EXACT_MISFIT: f64 = 1e-6;

/// Relative increase of the sum of squares that still counts as no worse: weights change with the parameters.
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

    /// A dwell or two without a motion near the measured one may be found once the parameters are better; half of them are too many.
    fn gives_up(&self, _: usize, value: &Normal, _: Option<&Normal>) -> bool {
        value.failed * 2 > value.dwells
    }
}

/// Parameters with the smallest sum of squares, by Levenberg–Marquardt steps from `start`. The first step adds the fraction
/// `damping` to the diagonal of the normal matrix; 0 for a start near the minimum.
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

/// Parameters nearer to the minimum: as [`minimum`], but few steps suffice.
///
/// # Errors
/// The data do not determine the parameters, or too many dwells have no motion.
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
        // λ = 0, then from 1e-3 to 1e8: the last steps are shorter than [`LAST_STEP`] even where rounding hides the minimum.
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
