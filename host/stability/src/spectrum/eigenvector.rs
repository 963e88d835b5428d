//! Eigenvectors of a matrix by inverse iteration.

use nalgebra::{DMatrix, DVector};
use num_complex::Complex64;

/// Right eigenvector of a matrix for an approximate eigenvalue, by inverse iteration.
pub(crate) fn eigenvector(matrix: &DMatrix<Complex64>, eigenvalue: Complex64) -> Option<DVector<Complex64>> {
    let order = matrix.nrows();
    // A shift slightly off the eigenvalue keeps the matrix regular and amplifies the eigenvector by 1e8 in each step.
    let shift = if eigenvalue.norm() > 0.0 {
        eigenvalue * (1.0 + 1e-8)
    } else {
        Complex64::from(1e-10 * matrix.norm())
    };
    let lu = (matrix - DMatrix::identity(order, order) * shift).lu();
    let mut vector = DVector::from_fn(order, |i, _| Complex64::new(1.0, 0.3 * i as f64));
    for _ in 0..3 {
        vector = lu.solve(&vector)?;
        let norm = vector.norm();
        if !(norm.is_finite() && norm > 0.0) {
            return None;
        }
        vector.unscale_mut(norm);
    }
    Some(vector)
}
