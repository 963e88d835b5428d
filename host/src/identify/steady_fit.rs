//! Parameters of a law from measured periodic motions, by harmonic balance.
//!
//! The motion that the law predicts under the *measured* force is fitted to the measured motion. What is left is weighed
//! with its covariance: noise of the motion, noise of the force and of the frequency carried through the law by its
//! exact derivatives. Intervals are those of the normal distribution; where the law does not reach the noise they come
//! from the scatter of the dwells themselves (sandwich).

use nalgebra::{Cholesky, DMatrix, DVector};

use super::dwell::{Dwell, Line};
use super::harmonic_balance::{Grid, Problem, Solution};
use super::law::Law;
use crate::recording::Quantity;
use crate::structure::Direction;

/// A fit of a law.
#[derive(Clone, Debug)]
pub struct Fit {
    /// The parameters.
    pub theta: DVector<f64>,
    /// Their covariance.
    pub covariance: DMatrix<f64>,
    /// Sum of squares over degrees of freedom, in units of the noise: near 1 where the law explains the data.
    pub misfit: f64,
    /// Root mean square of what is left over that of the data, at the fundamental.
    pub relative_error: f64,
    /// True where the covariance is the sandwich.
    pub robust: bool,
}

/// Why no law can be fitted.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum FitError {
    /// Too few data for the parameters.
    #[error(
        "{found} dwells with motion in every direction are too few for {parameters} parameters; at least {needed} are needed"
    )]
    TooFew {
        /// Dwells that can be used.
        found: usize,
        /// Parameters.
        parameters: usize,
        /// Dwells needed.
        needed: usize,
    },
    /// Data that do not determine the parameters.
    #[error(
        "the data do not determine all parameters; more force levels, or frequencies on both sides of the resonance, are needed"
    )]
    Undetermined,
    /// The law has no periodic motion near the measured one.
    #[error(
        "the law has no periodic motion near the measured one at {failed} of {all} dwells; another law is needed, or steadier data"
    )]
    NoMotion {
        /// Dwells without.
        failed: usize,
        /// All dwells.
        all: usize,
    },
    /// No minimum was found.
    #[error("the fit does not converge; its sum of squares over degrees of freedom is {0:.3e}")]
    NotConverged(f64),
}

/// 90 % of a normal distribution lie within this many deviations.
pub const NINETY_PERCENT: f64 = 1.644_853_626_951_472_2;

/// Above this misfit the law does not explain the data, and the sandwich is taken.
const MISFIT: f64 = 1.3;

/// Data of a fit: dwells and the directions that are the degrees of freedom of the law.
#[derive(Clone, Copy)]
pub struct Data<'a> {
    /// The law.
    pub law: &'a Law,
    /// Direction of each degree of freedom.
    pub directions: &'a [Direction],
    /// The dwells, all with the grid's number of harmonics.
    pub dwells: &'a [Dwell],
    /// The grid.
    pub grid: &'a Grid,
}

impl Data<'_> {
    fn degree_of(&self, line: &Line) -> Option<usize> {
        self.directions
            .iter()
            .position(|direction| *direction == line.direction)
    }

    /// Fourier coefficients of the force on every degree of freedom; its mean is left out, load cells do not have it.
    fn force(&self, dwell: &Dwell) -> DVector<f64> {
        let width = self.grid.width();
        let mut force = DVector::zeros(self.law.dofs * width);
        for line in &dwell.forces {
            if let Some(dof) = self.degree_of(line) {
                force
                    .rows_mut(dof * width + 1, width - 1)
                    .copy_from(&line.coefficients.rows(1, width - 1));
            }
        }
        force
    }

    /// The measured displacement of every degree of freedom; `None` where one is not measured.
    fn displacement(&self, dwell: &Dwell) -> Option<DVector<f64>> {
        let width = self.grid.width();
        let mut x = DVector::zeros(self.law.dofs * width);
        for dof in 0..self.law.dofs {
            let line = dwell
                .motions
                .iter()
                .find(|line| self.degree_of(line) == Some(dof))?;
            let motion = undo(&line.coefficients, derivative(line.quantity), dwell.omega);
            x.rows_mut(dof * width, width).copy_from(&motion);
            x[dof * width] = 0.0;
        }
        Some(x)
    }

    /// Parameters of the balance at the fundamental with the measured motion in it: linear least squares.
    ///
    /// # Errors
    /// Too few dwells, or data that do not determine them.
    pub fn first_guess(&self) -> Result<DVector<f64>, FitError> {
        let parameters = self.law.parameters.len();
        let width = self.grid.width();
        let usable: Vec<_> = self
            .dwells
            .iter()
            .filter_map(|dwell| Some((dwell, self.displacement(dwell)?)))
            .collect();
        let needed = parameters.div_ceil(2 * self.law.dofs) + 1;
        if usable.len() < needed {
            return Err(FitError::TooFew {
                found: usable.len(),
                parameters,
                needed,
            });
        }
        let rows = 2 * self.law.dofs;
        let mut matrix = DMatrix::zeros(rows * usable.len(), parameters);
        let mut right = DVector::zeros(rows * usable.len());
        for (index, (dwell, x)) in usable.iter().enumerate() {
            let features = self.grid.features(self.law, dwell.omega, x);
            let force = self.force(dwell);
            for dof in 0..self.law.dofs {
                for part in 0..2 {
                    let (row, from) = (index * rows + 2 * dof + part, dof * width + 1 + part);
                    matrix.row_mut(row).copy_from(&features.row(from));
                    right[row] = force[from];
                }
            }
        }
        scaled_least_squares(&matrix, &right).ok_or(FitError::Undetermined)
    }

    /// Residual of a dwell over its noise, and its derivative by θ.
    fn whitened(&self, dwell: &Dwell, theta: &DVector<f64>) -> Option<(DVector<f64>, DMatrix<f64>)> {
        let start = self.displacement(dwell)?;
        let solution = self.solve(dwell, theta, &start)?;
        let width = self.grid.width();
        let lines: Vec<(&Line, usize)> = dwell
            .motions
            .iter()
            .filter_map(|line| Some((line, self.degree_of(line)?)))
            .collect();
        let used = width - 1;
        let (by_theta, by_force, by_omega) = solution.sensitivities(0..self.law.dofs * width)?;
        let mut residual = DVector::zeros(lines.len() * used);
        let mut slope = DMatrix::zeros(lines.len() * used, theta.len());
        let mut force_slope = DMatrix::zeros(lines.len() * used, by_force.ncols());
        let mut omega_slope = DVector::zeros(lines.len() * used);
        let noise = dwell.gram_inverse.view((1, 1), (used, used));
        let mut covariance = DMatrix::zeros(lines.len() * used, lines.len() * used);
        for (index, (line, dof)) in lines.iter().enumerate() {
            let order = derivative(line.quantity);
            let rows = dof * width..(dof + 1) * width;
            let to = |motion: DVector<f64>| apply(&motion, order, dwell.omega).rows(1, used).into_owned();
            let motion = solution.x.rows(rows.start, width).into_owned();
            residual
                .rows_mut(index * used, used)
                .copy_from(&(line.coefficients.rows(1, used) - to(motion.clone())));
            for column in 0..theta.len() {
                let derived = to(by_theta
                    .view((rows.start, column), (width, 1))
                    .column(0)
                    .into_owned());
                slope
                    .view_mut((index * used, column), (used, 1))
                    .copy_from(&derived);
            }
            for column in 0..by_force.ncols() {
                let derived = to(by_force
                    .view((rows.start, column), (width, 1))
                    .column(0)
                    .into_owned());
                force_slope
                    .view_mut((index * used, column), (used, 1))
                    .copy_from(&derived);
            }
            let own = to(motion) * (f64::from(order) / dwell.omega);
            omega_slope
                .rows_mut(index * used, used)
                .copy_from(&(to(by_omega.rows(rows.start, width).into_owned()) + own));
            covariance
                .view_mut((index * used, index * used), (used, used))
                .copy_from(&(noise * line.variance));
        }
        for line in &dwell.forces {
            if let Some(dof) = self.degree_of(line) {
                let part = force_slope.columns(dof * width + 1, used);
                covariance += part * (noise * line.variance) * part.transpose();
            }
        }
        covariance += &omega_slope * omega_slope.transpose() * dwell.omega_variance;
        let root = Cholesky::new(covariance)?.unpack();
        root.solve_lower_triangular_mut(&mut residual).then_some(())?;
        root.solve_lower_triangular_mut(&mut slope).then_some(())?;
        Some((residual, slope))
    }

    fn solve(&self, dwell: &Dwell, theta: &DVector<f64>, start: &DVector<f64>) -> Option<Solution> {
        let force = self.force(dwell);
        let problem = Problem {
            law: self.law,
            theta: theta.as_slice(),
            omega: dwell.omega,
            force: &force,
        };
        self.grid.solve(problem, start).ok()
    }

    /// The displacement that the law predicts at a dwell, near the measured one; degree after degree.
    pub fn predicted(&self, dwell: &Dwell, theta: &DVector<f64>) -> Option<DVector<f64>> {
        let start = self.displacement(dwell)?;
        Some(self.solve(dwell, theta, &start)?.x)
    }

    /// Root mean square of prediction less measurement over that of the measurement, at the fundamental.
    pub fn relative_error(&self, theta: &DVector<f64>) -> f64 {
        let (mut left, mut all) = (0.0, 0.0);
        for dwell in self.dwells {
            let Some(measured) = self.displacement(dwell) else {
                continue;
            };
            let predicted = self.predicted(dwell, theta);
            for dof in 0..self.law.dofs {
                for place in [1, 2].map(|part| dof * self.grid.width() + part) {
                    // No motion at all is predicted where there is none near the measured one.
                    let found = predicted.as_ref().map_or(0.0, |x| x[place]);
                    left += (found - measured[place]).powi(2);
                    all += measured[place].powi(2);
                }
            }
        }
        if all > 0.0 { (left / all).sqrt() } else { 0.0 }
    }

    fn normal(&self, theta: &DVector<f64>) -> Normal {
        let size = theta.len();
        let mut normal = Normal {
            matrix: DMatrix::zeros(size, size),
            gradient: DVector::zeros(size),
            scatter: DMatrix::zeros(size, size),
            sum: 0.0,
            rows: 0,
            failed: 0,
        };
        for dwell in self.dwells {
            let Some((residual, slope)) = self.whitened(dwell, theta) else {
                normal.failed += 1;
                continue;
            };
            let gradient = slope.tr_mul(&residual);
            normal.matrix += slope.tr_mul(&slope);
            normal.scatter += &gradient * gradient.transpose();
            normal.gradient += gradient;
            normal.sum += residual.norm_squared();
            normal.rows += residual.len();
        }
        normal
    }

    /// The fit from a first guess.
    ///
    /// # Errors
    /// See [`FitError`].
    pub fn fit(&self, start: DVector<f64>) -> Result<Fit, FitError> {
        let mut theta = start;
        let mut normal = self.normal(&theta);
        let mut damping = 0.0;
        for _ in 0..60 {
            // A dwell or two without a motion near the measured one may be found once the parameters are better.
            if normal.failed * 2 > self.dwells.len() {
                return Err(FitError::NoMotion {
                    failed: normal.failed,
                    all: self.dwells.len(),
                });
            }
            let mut matrix = normal.matrix.clone();
            for i in 0..theta.len() {
                matrix[(i, i)] *= 1.0 + damping;
            }
            let step = scaled_solve(&matrix, &normal.gradient).ok_or(FitError::Undetermined)?;
            let next = &theta + &step;
            let tried = self.normal(&next);
            // The step in units of the interval that the parameters will get. Weights move with the parameters, so that
            // the sum itself need not fall at the very end.
            let length = step.dot(&(&normal.matrix * &step)).sqrt();
            if length < 1e-3 && tried.failed == normal.failed {
                return self.finish(next, tried);
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
        let free = normal.rows.saturating_sub(theta.len()).max(1) as f64;
        Err(FitError::NotConverged(normal.sum / free))
    }

    fn finish(&self, theta: DVector<f64>, normal: Normal) -> Result<Fit, FitError> {
        if normal.failed > 0 {
            return Err(FitError::NoMotion {
                failed: normal.failed,
                all: self.dwells.len(),
            });
        }
        let inverse = scaled_inverse(&normal.matrix).ok_or(FitError::Undetermined)?;
        let free = normal.rows.saturating_sub(theta.len()).max(1) as f64;
        let misfit = normal.sum / free;
        let robust = misfit > MISFIT;
        let covariance = if robust {
            &inverse * normal.scatter * &inverse
        } else {
            inverse
        };
        Ok(Fit {
            relative_error: self.relative_error(&theta),
            theta,
            covariance,
            misfit,
            robust,
        })
    }
}

struct Normal {
    matrix: DMatrix<f64>,
    gradient: DVector<f64>,
    scatter: DMatrix<f64>,
    sum: f64,
    rows: usize,
    failed: usize,
}

impl Fit {
    /// Half the width of the 90 % interval of a parameter.
    pub fn half_width(&self, parameter: usize) -> f64 {
        NINETY_PERCENT * self.covariance[(parameter, parameter)].max(0.0).sqrt()
    }
}

/// How often a channel is differentiated.
pub(super) fn derivative(quantity: Quantity) -> u8 {
    match quantity {
        Quantity::Velocity => 1,
        Quantity::Acceleration => 2,
        _ => 0,
    }
}

/// Coefficients of the derivative.
fn apply(x: &DVector<f64>, order: u8, omega: f64) -> DVector<f64> {
    let mut derived = x.clone();
    for _ in 0..order {
        derived[0] = 0.0;
        for h in 1..=x.len() / 2 {
            let (c, s) = (derived[2 * h - 1], derived[2 * h]);
            let factor = h as f64 * omega;
            (derived[2 * h - 1], derived[2 * h]) = (factor * s, -factor * c);
        }
    }
    derived
}

/// Coefficients of the integral.
pub(super) fn undo(x: &DVector<f64>, order: u8, omega: f64) -> DVector<f64> {
    let mut integral = x.clone();
    for _ in 0..order {
        integral[0] = 0.0;
        for h in 1..=x.len() / 2 {
            let (c, s) = (integral[2 * h - 1], integral[2 * h]);
            let factor = 1.0 / (h as f64 * omega);
            (integral[2 * h - 1], integral[2 * h]) = (-factor * s, factor * c);
        }
    }
    integral
}

/// Least squares with columns brought to length 1: parameters differ by many powers of ten.
pub(super) fn scaled_least_squares(matrix: &DMatrix<f64>, right: &DVector<f64>) -> Option<DVector<f64>> {
    let lengths = DVector::from_iterator(matrix.ncols(), matrix.column_iter().map(|column| column.norm()));
    if lengths.iter().any(|length| *length <= 0.0 || !length.is_finite()) {
        return None;
    }
    let mut scaled = matrix.clone();
    for (mut column, length) in scaled.column_iter_mut().zip(lengths.iter()) {
        column /= *length;
    }
    let svd = scaled.svd(true, true);
    let largest = svd.singular_values.max();
    // Below the rounding of the data nothing is determined.
    if svd.singular_values.min() < 1e-12 * largest {
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
