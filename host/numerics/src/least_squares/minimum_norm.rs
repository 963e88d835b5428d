//! Least squares of columns that may depend on each other: the solution of least norm.

use nalgebra::{DMatrix, DVector, Dyn, SVD};

use crate::singular_values::{SingularValueError, Vectors, decompose};

/// The x of least norm among those of least ‖A x − b‖², from the singular value decomposition.
///
/// Columns are not scaled: the least norm depends on the units of the parameters.
#[derive(Clone, Debug)]
pub struct MinimumNorm {
    decomposed: SVD<f64, Dyn, Dyn>,
    least: f64,
}

impl MinimumNorm {
    /// Decomposes A, m × n; singular values below `tolerance` count as zero.
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

    /// The solution for one right side, m entries.
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

/// The singular value below which a combination of columns is rounding.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Tolerance {
    /// In the unit of the columns.
    Absolute(f64),
    /// As a share of the largest one.
    Relative(f64),
}
