//! Parameters of a nonlinear equation of motion from measured periodic motions, by harmonic balance.
//!
//! The motion that the equation predicts under the *measured* force is fitted to the measured motion. The residual is
//! weighted with its covariance: noise of the motion, and noise of force and frequency propagated through the exact
//! derivatives of the prediction. Intervals are those of the normal distribution. If the residual exceeds the noise,
//! intervals come from the scatter between dwells (sandwich covariance).

use nalgebra::{DMatrix, DVector};
use quietcut_numerics::least_squares::LinearProblem;

use crate::dwells::differentiation::{derivative, undo};
use crate::dwells::dwell::{Dwell, FourierSeries};
pub use crate::least_squares::FitError;
use crate::least_squares::{Normal, Spread, minimum};
use crate::nonlinear::harmonic_balance::{Grid, Problem, Solution};
use crate::nonlinear::law::Law;
use crate::nonlinear::whitening::OutputMap;
use quietcut_model::structure::Direction;
use quietcut_numerics::statistics::NINETY_PERCENT;

/// Result of a fit of an equation of motion to dwells of steady motion.
#[derive(Clone, Debug)]
pub struct Fit {
    /// The fitted parameters θ of the equation of motion.
    pub theta: DVector<f64>,
    /// Covariance of the parameters.
    pub covariance: DMatrix<f64>,
    /// χ² per degree of freedom: near 1 if the equation of motion explains the dwells within their noise.
    pub misfit: f64,
    /// NRMSE of the fundamental of the predicted motion over the dwells: see [`Data::relative_error`].
    pub relative_error: f64,
    /// True if the covariance of the parameters is the sandwich covariance, from the scatter between dwells.
    pub robust: bool,
}

/// Data of a fit to steady motion: dwells, and the equation of motion whose degrees of freedom are displacements in
/// given directions.
#[derive(Clone, Copy)]
pub struct Data<'a> {
    /// The equation of motion whose parameters are fitted.
    pub law: &'a Law,
    /// For each degree of freedom, the direction of the displacement that it is.
    pub directions: &'a [Direction],
    /// The dwells of steady motion; the Fourier series of every channel has as many harmonics as the grid.
    pub dwells: &'a [Dwell],
    /// The harmonic-balance grid.
    pub grid: &'a Grid,
}

impl Data<'_> {
    fn degree_of(&self, line: &FourierSeries) -> Option<usize> {
        self.directions
            .iter()
            .position(|direction| *direction == line.direction)
    }

    /// Output matrix S of [`OutputMap`], here the identity: every degree of freedom is the displacement in one
    /// direction.
    fn unit(&self) -> DMatrix<f64> {
        DMatrix::identity(self.law.dofs, self.law.dofs)
    }

    fn output_map<'b>(&'b self, shape: &'b DMatrix<f64>) -> OutputMap<'b> {
        OutputMap {
            directions: self.directions,
            shape,
        }
    }

    fn force(&self, dwell: &Dwell) -> DVector<f64> {
        self.output_map(&self.unit()).force(dwell, self.grid.width())
    }

    /// Fourier coefficients of the displacement measured in a dwell, with zero mean, one degree of freedom after the
    /// other; `None` if one of them is not measured.
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

    /// First guess of the parameters: linear least squares on the harmonic balance of the measured motion at the
    /// fundamental.
    ///
    /// # Errors
    /// Too few dwells, or dwells that do not determine the parameters.
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
        let fit = LinearProblem::new(&matrix, &right).solve();
        fit.map(|fit| fit.parameters).map_err(|_| FitError::Undetermined)
    }

    /// Whitened residual (measured − predicted motion) of a dwell, and the derivative of the whitened prediction by θ;
    /// `None` if the equation of motion has no periodic solution near the measured motion, if a displacement is not
    /// measured, or if the covariance is singular.
    fn whitened(&self, dwell: &Dwell, theta: &DVector<f64>) -> Option<(DVector<f64>, DMatrix<f64>)> {
        let solution = self.solve(dwell, theta, &self.displacement(dwell)?)?;
        self.output_map(&self.unit())
            .whitened(dwell, &solution, self.grid.width())
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

    /// Fourier coefficients of the displacement that the equation of motion predicts near the measured motion of a
    /// dwell, one degree of freedom after the other. `None` if a displacement is not measured, or if no periodic
    /// solution is found there.
    pub fn predicted(&self, dwell: &Dwell, theta: &DVector<f64>) -> Option<DVector<f64>> {
        let start = self.displacement(dwell)?;
        Some(self.solve(dwell, theta, &start)?.x)
    }

    /// NRMSE of the fundamental of the predicted motion over all dwells whose displacements are measured; a missing
    /// prediction counts as zero.
    pub fn relative_error(&self, theta: &DVector<f64>) -> f64 {
        let (mut left, mut all) = (0.0, 0.0);
        for dwell in self.dwells {
            let Some(measured) = self.displacement(dwell) else {
                continue;
            };
            let predicted = self.predicted(dwell, theta);
            for dof in 0..self.law.dofs {
                for place in [1, 2].map(|part| dof * self.grid.width() + part) {
                    // If the equation of motion has no periodic solution near the measured motion, the prediction
                    // counts as zero.
                    let found = predicted.as_ref().map_or(0.0, |x| x[place]);
                    left += (found - measured[place]).powi(2);
                    all += measured[place].powi(2);
                }
            }
        }
        if all > 0.0 { (left / all).sqrt() } else { 0.0 }
    }

    /// Fits the parameters of the equation of motion, from the first guess `start`, by nonlinear least squares.
    ///
    /// # Errors
    /// See [`FitError`].
    pub fn fit(&self, start: DVector<f64>) -> Result<Fit, FitError> {
        let (theta, normal) = minimum(start, 0.0, |theta| {
            let mut normal = Normal::new(theta.len());
            for dwell in self.dwells {
                normal.add(self.whitened(dwell, theta));
            }
            normal
        })?;
        let Spread {
            covariance,
            misfit,
            robust,
        } = normal.spread()?;
        Ok(Fit {
            relative_error: self.relative_error(&theta),
            theta,
            covariance,
            misfit,
            robust,
        })
    }
}

impl Fit {
    /// Half-width of the 90 % interval of the parameter with this index.
    pub fn half_width(&self, parameter: usize) -> f64 {
        NINETY_PERCENT * self.covariance[(parameter, parameter)].max(0.0).sqrt()
    }
}
