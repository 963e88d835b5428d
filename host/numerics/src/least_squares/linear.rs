//! Linear least squares with weights and a prior.

use nalgebra::{DMatrix, DVector};

use super::LeastSquaresError;
use super::factored::Factored;

/// Linear least squares: min over x of Σᵢ wᵢ (aᵢᵀx − bᵢ)² + Σⱼ pⱼ (xⱼ − x₀ⱼ)², where A has m rows aᵢᵀ and n columns.
///
/// If the weights wᵢ = 1/σᵢ² and the pⱼ are inverse variances of independent errors, then [`LinearFit::covariance`] is
/// the covariance of the parameters.
///
/// ```
/// use nalgebra::{DMatrix, DVector};
/// use quietcut_numerics::least_squares::LinearProblem;
///
/// // A line through (0, 1), (1, 3), (2, 5).
/// let matrix = DMatrix::from_row_slice(3, 2, &[1.0, 0.0, 1.0, 1.0, 1.0, 2.0]);
/// let right = DVector::from_vec(vec![1.0, 3.0, 5.0]);
/// let fit = LinearProblem::new(&matrix, &right).solve()?;
/// assert!((fit.parameters[1] - 2.0).abs() < 1e-12);
/// # Ok::<(), quietcut_numerics::least_squares::LeastSquaresError>(())
/// ```
#[derive(Clone, Copy, Debug)]
pub struct LinearProblem<'a> {
    matrix: &'a DMatrix<f64>,
    right: &'a DVector<f64>,
    weights: Option<&'a DVector<f64>>,
    prior: Option<[&'a DVector<f64>; 2]>,
}

/// The solution of a [`LinearProblem`].
#[derive(Clone, Debug, PartialEq)]
pub struct LinearFit {
    /// Parameters x, n entries.
    pub parameters: DVector<f64>,
    /// (AᵀWA + P)⁻¹, n × n: covariance of the parameters if the weights wᵢ and the pⱼ are inverse variances. If weights
    /// are known up to a common factor only, and without a prior, the covariance is this matrix times
    /// [`Self::variance`].
    pub covariance: DMatrix<f64>,
    /// Weighted sum of squared residuals Σᵢ wᵢ (aᵢᵀx − bᵢ)², without the term of the prior.
    pub sum_of_squares: f64,
    /// Number of rows with a weight above zero, minus the number of parameters; 0 if the difference is negative.
    pub degrees_of_freedom: usize,
    /// Estimate of the condition number of the weighted rows with those of the prior, each column scaled to length 1:
    /// absolute value of the first pivot of the QR decomposition divided by that of the last; 1 without parameters.
    pub condition: f64,
}

impl LinearFit {
    /// Variance of the noise of a row of weight 1, estimated from the residuals without regard to a prior; infinite or
    /// NaN without degrees of freedom.
    pub fn variance(&self) -> f64 {
        self.sum_of_squares / self.degrees_of_freedom as f64
    }
}

impl<'a> LinearProblem<'a> {
    /// The least-squares problem A x = b with unit weights and without a prior; A = `matrix`, b = `right`.
    pub fn new(matrix: &'a DMatrix<f64>, right: &'a DVector<f64>) -> Self {
        Self {
            matrix,
            right,
            weights: None,
            prior: None,
        }
    }

    /// This problem with weights wᵢ ≥ 0 of the m rows.
    #[must_use]
    pub fn with_weights(self, weights: &'a DVector<f64>) -> Self {
        Self {
            weights: Some(weights),
            ..self
        }
    }

    /// This problem with a prior of the parameters: mean x₀ and inverse variances pⱼ ≥ 0, n entries each; a mean of 0
    /// and equal pⱼ are ridge regression.
    #[must_use]
    pub fn with_prior(self, mean: &'a DVector<f64>, inverse_variances: &'a DVector<f64>) -> Self {
        Self {
            prior: Some([mean, inverse_variances]),
            ..self
        }
    }

    /// Solution with the least sum of squares, that of the prior included, from Householder QR with pivoting of the
    /// scaled columns (Golub and Van Loan, *Matrix Computations*, 4th edition, 5.4.2).
    ///
    /// # Errors
    /// See [`LeastSquaresError`].
    pub fn solve(&self) -> Result<LinearFit, LeastSquaresError> {
        self.check()?;
        let (stacked, target) = self.rows();
        if stacked.ncols() == 0 {
            return Ok(self.fit(DVector::zeros(0), DMatrix::zeros(0, 0), 1.0));
        }
        let factored = Factored::new(stacked)?;
        let solution = factored.solve(target);
        Ok(self.fit(solution, factored.covariance(), factored.condition()))
    }

    fn fit(&self, parameters: DVector<f64>, covariance: DMatrix<f64>, condition: f64) -> LinearFit {
        let residual = self.matrix * &parameters - self.right;
        let weight = |i: usize| self.weights.map_or(1.0, |weights| weights[i]);
        let used = (0..self.right.len()).filter(|&i| weight(i) > 0.0).count();
        let squares = residual.iter().enumerate().map(|(i, r)| weight(i) * r * r);
        LinearFit {
            sum_of_squares: squares.sum(),
            degrees_of_freedom: used.saturating_sub(parameters.len()),
            parameters,
            covariance,
            condition,
        }
    }

    /// Weighted rows √W A and √W b, followed by the rows √P and √P x₀ of the prior.
    fn rows(&self) -> (DMatrix<f64>, DVector<f64>) {
        let (rows, columns) = self.matrix.shape();
        let (mut matrix, mut right) = (self.matrix.clone(), self.right.clone());
        if let Some(weights) = self.weights {
            for (i, weight) in weights.iter().enumerate() {
                matrix.row_mut(i).scale_mut(weight.sqrt());
                right[i] *= weight.sqrt();
            }
        }
        if let Some([mean, inverse_variances]) = self.prior {
            matrix = matrix.resize_vertically(rows + columns, 0.0);
            right = right.resize_vertically(rows + columns, 0.0);
            for (j, inverse_variance) in inverse_variances.iter().enumerate() {
                matrix[(rows + j, j)] = inverse_variance.sqrt();
                right[rows + j] = inverse_variance.sqrt() * mean[j];
            }
        }
        (matrix, right)
    }

    fn check(&self) -> Result<(), LeastSquaresError> {
        let (rows, columns) = self.matrix.shape();
        // Weights and inverse variances of the prior must not be negative, since their square roots enter the rows.
        let [any, not_negative] = [f64::NEG_INFINITY, 0.0];
        let mut vectors = vec![("the right side", self.right, rows, any)];
        vectors.extend(
            self.weights
                .map(|weights| ("the vector of weights", weights, rows, not_negative)),
        );
        if let Some([mean, inverse_variances]) = self.prior {
            vectors.push(("the mean of the prior", mean, columns, any));
            vectors.push((
                "the vector of inverse variances of the prior",
                inverse_variances,
                columns,
                not_negative,
            ));
        }
        for (what, vector, expected, least) in vectors {
            let found = vector.len();
            if found != expected {
                return Err(LeastSquaresError::Shape {
                    what,
                    found,
                    expected,
                });
            }
            if vector.iter().any(|entry| !entry.is_finite() || *entry < least) {
                return Err(LeastSquaresError::NotFinite { what });
            }
        }
        if self.matrix.iter().any(|entry| !entry.is_finite()) {
            return Err(LeastSquaresError::NotFinite { what: "the matrix" });
        }
        Ok(())
    }
}
