//! Weighted least squares on steady motions; the weights depend on the parameters.

use crate::criteria::{FULL_RANK, LARGEST_MISFIT};
use nalgebra::{Cholesky, DMatrix, DVector};
use quietcut_numerics::singular_values::{Vectors, decompose};

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
    /// Σ SᵀS.
    matrix: DMatrix<f64>,
    /// Σ Sᵀr.
    gradient: DVector<f64>,
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
            matrix: DMatrix::zeros(size, size),
            gradient: DVector::zeros(size),
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
        self.matrix += slope.tr_mul(&slope);
        self.scatter += &gradient * gradient.transpose();
        self.gradient += gradient;
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
        self.sum / self.rows.saturating_sub(self.gradient.len()).max(1) as f64
    }

    /// Covariance and misfit of the parameters.
    ///
    /// # Errors
    /// The law has no motion at a dwell, or the data do not determine the parameters.
    pub(super) fn spread(&self) -> Result<Spread, FitError> {
        if self.failed > 0 {
            return Err(self.failure());
        }
        let inverse = scaled_inverse(&self.matrix).ok_or(FitError::Undetermined)?;
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
    match descend(start, damping, 60, of)? {
        (theta, normal, true) => Ok((theta, normal)),
        (_, normal, false) => Err(FitError::NotConverged(normal.misfit())),
    }
}

/// Parameters nearer to the minimum than `start`: like [`minimum`], but with fewer steps and without a test of convergence.
///
/// # Errors
/// The data do not determine them, or too many dwells have no motion.
pub(super) fn nearer(
    start: DVector<f64>,
    damping: f64,
    of: impl Fn(&DVector<f64>) -> Normal,
) -> Result<DVector<f64>, FitError> {
    descend(start, damping, 25, of).map(|(theta, ..)| theta)
}

/// Parameters after at most `rounds` steps, their normal equations, and whether the minimum was reached.
fn descend(
    start: DVector<f64>,
    mut damping: f64,
    rounds: usize,
    of: impl Fn(&DVector<f64>) -> Normal,
) -> Result<(DVector<f64>, Normal, bool), FitError> {
    let mut theta = start;
    let mut normal = of(&theta);
    for _ in 0..rounds {
        // Dwells without a predicted motion are tolerated up to one half: better parameters may give them one.
        if normal.failed * 2 > normal.dwells {
            return Err(normal.failure());
        }
        let mut matrix = normal.matrix.clone();
        for i in 0..theta.len() {
            matrix[(i, i)] *= 1.0 + damping;
        }
        let Some(step) = scaled_solve(&matrix, &normal.gradient) else {
            // Far from the minimum the normal matrix may be singular although the data determine the parameters.
            if damping >= 1.0 {
                return Err(FitError::Undetermined);
            }
            damping = (10.0 * damping).max(1e-3);
            continue;
        };
        let next = &theta + &step;
        let tried = of(&next);
        // Length of the step in standard deviations of the parameters. The weights depend on the parameters, so the sum of squares
        // may rise slightly at convergence.
        let length = step.dot(&(&normal.matrix * &step)).sqrt();
        if length < 1e-3 && tried.failed == normal.failed {
            return Ok((next, tried, true));
        }
        let better = tried.failed < normal.failed
            || (tried.failed == normal.failed && tried.sum <= normal.sum * (1.0 + 1e-6));
        if better {
            (theta, normal) = (next, tried);
            damping = if damping < 1e-6 { 0.0 } else { 0.1 * damping };
        } else {
            damping = (10.0 * damping).max(1e-3);
            if damping > 1e8 {
                break;
            }
        }
    }
    Ok((theta, normal, false))
}

/// Least squares with columns scaled to length 1, because parameters differ by many powers of ten. `None` if the columns are
/// linearly dependent.
pub(super) fn scaled_least_squares(matrix: &DMatrix<f64>, right: &DVector<f64>) -> Option<DVector<f64>> {
    let lengths = DVector::from_iterator(matrix.ncols(), matrix.column_iter().map(|column| column.norm()));
    if lengths.iter().any(|length| *length <= 0.0 || !length.is_finite()) {
        return None;
    }
    let mut scaled = matrix.clone();
    for (mut column, length) in scaled.column_iter_mut().zip(lengths.iter()) {
        column /= *length;
    }
    let svd = decompose(scaled, Vectors::Both).ok()?;
    let largest = svd.singular_values.max();
    // Singular values below the rounding of the data do not determine the solution.
    if svd.singular_values.min() < FULL_RANK * largest {
        return None;
    }
    let solution = svd.solve(right, 0.0).ok()?;
    Some(solution.component_div(&lengths))
}

fn scaled(matrix: &DMatrix<f64>) -> Option<(Cholesky<f64, nalgebra::Dyn>, DVector<f64>)> {
    let lengths = matrix.diagonal().map(f64::sqrt);
    if lengths.iter().any(|length| *length <= 0.0 || !length.is_finite()) {
        return None;
    }
    let scaled = DMatrix::from_fn(matrix.nrows(), matrix.ncols(), |i, j| {
        matrix[(i, j)] / (lengths[i] * lengths[j])
    });
    Some((Cholesky::new(scaled)?, lengths))
}

pub(super) fn scaled_solve(matrix: &DMatrix<f64>, right: &DVector<f64>) -> Option<DVector<f64>> {
    let (cholesky, lengths) = scaled(matrix)?;
    Some(
        cholesky
            .solve(&right.component_div(&lengths))
            .component_div(&lengths),
    )
}

pub(super) fn scaled_inverse(matrix: &DMatrix<f64>) -> Option<DMatrix<f64>> {
    let (cholesky, lengths) = scaled(matrix)?;
    let inverse = cholesky.inverse();
    Some(DMatrix::from_fn(matrix.nrows(), matrix.ncols(), |i, j| {
        inverse[(i, j)] / (lengths[i] * lengths[j])
    }))
}
