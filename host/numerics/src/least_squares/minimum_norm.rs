//! Least squares with linearly dependent columns: the solution of least norm.

use nalgebra::{DMatrix, DVector, Dyn, SVD};

use crate::singular_values::{SingularValueError, Vectors, decompose};

/// Least-squares solution of A x = b for a matrix A that may have linearly dependent columns: of all x with the least
/// ‖A x − b‖², that of least norm, from the singular value decomposition.
///
/// The columns are not scaled, so that the solution depends on the units of the parameters.
#[derive(Clone, Debug)]
pub struct MinimumNorm {
    decomposed: SVD<f64, Dyn, Dyn>,
    least: f64,
}

impl MinimumNorm {
    /// Decomposes A, m × n; singular values up to `tolerance` count as zero.
    ///
    /// # Errors
    /// A is empty or not finite, or the iteration exceeds its bound.
    pub fn new(matrix: DMatrix<f64>, tolerance: Tolerance) -> Result<Self, SingularValueError> {
        let decomposed = decompose(matrix, Vectors::Both)?;
        let least = match tolerance {
            Tolerance::Absolute(least) => least,
            Tolerance::Relative(share) => share * decomposed.singular_values.max(),
        };
        Ok(Self { decomposed, least })
    }

    /// The solution x of least norm for the right side b = `right`, m entries.
    pub fn solve(&self, right: &DVector<f64>) -> DVector<f64> {
        let svd = &self.decomposed;
        let (Some(u), Some(v_t)) = (&svd.u, &svd.v_t) else {
            return DVector::zeros(0);
        };
        let mut shares = u.tr_mul(right);
        for (share, value) in shares.iter_mut().zip(svd.singular_values.iter()) {
            *share = if *value > self.least { *share / value } else { 0.0 };
        }
        v_t.tr_mul(&shares)
    }
}

/// Bound up to which a singular value of a matrix counts as zero, so that the solution has no component along its right
/// singular vector.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Tolerance {
    /// Absolute bound on the singular values, in the unit of the entries of the matrix.
    Absolute(f64),
    /// Bound on the singular values as a fraction of the largest one.
    Relative(f64),
}
