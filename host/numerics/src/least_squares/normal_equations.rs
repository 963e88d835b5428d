//! Normal equations that were summed: data too many to be held as a matrix.

use nalgebra::{Cholesky, DMatrix, DVector, Dyn};

/// x of N x = g with N = Σ aᵢaᵢᵀ (n × n, symmetric) and g = Σ aᵢbᵢ; `None` where N is not positive definite.
///
/// The diagonal is scaled to 1 first. The condition of N is the square of that of the data: a
/// [`super::LinearProblem`] keeps twice the digits.
pub fn solve_normal_equations(matrix: &DMatrix<f64>, right: &DVector<f64>) -> Option<DVector<f64>> {
    let (cholesky, lengths) = scaled(matrix)?;
    Some(
        cholesky
            .solve(&right.component_div(&lengths))
            .component_div(&lengths),
    )
}

/// N⁻¹, the covariance of the parameters where the rows are over their noise; `None` where N is not positive definite.
pub fn invert_normal_equations(matrix: &DMatrix<f64>) -> Option<DMatrix<f64>> {
    let (cholesky, lengths) = scaled(matrix)?;
    let inverse = cholesky.inverse();
    Some(DMatrix::from_fn(matrix.nrows(), matrix.ncols(), |i, j| {
        inverse[(i, j)] / (lengths[i] * lengths[j])
    }))
}

fn scaled(matrix: &DMatrix<f64>) -> Option<(Cholesky<f64, Dyn>, DVector<f64>)> {
    let lengths = matrix.diagonal().map(f64::sqrt);
    if lengths.iter().any(|length| *length <= 0.0 || !length.is_finite()) {
        return None;
    }
    let scaled = DMatrix::from_fn(matrix.nrows(), matrix.ncols(), |i, j| {
        matrix[(i, j)] / (lengths[i] * lengths[j])
    });
    Some((Cholesky::new(scaled)?, lengths))
}
