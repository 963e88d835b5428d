//! Errors of eigenvalue problems, and the check of a matrix before its eigenvalues are computed.

use nalgebra::{ComplexField, DMatrix};

/// Error of an eigenvalue problem.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum EigenvalueError {
    /// The matrix, or one of a pencil, is not square, or the matrices of a pencil differ in size.
    #[error("a matrix of {rows} × {columns} has no eigenvalues; it must be square")]
    NotSquare {
        /// Rows.
        rows: usize,
        /// Columns.
        columns: usize,
    },
    /// An entry of the matrix, or of a matrix or vector computed from it, is infinite or not a number.
    #[error(
        "a matrix of {size} × {size} has an entry that is not finite; check the data for gaps, overflow and division by zero"
    )]
    NotFinite {
        /// Number of rows, equal to that of columns, of the matrix.
        size: usize,
    },
    /// The matrix M of a symmetric pencil is not positive definite within rounding.
    #[error(
        "the mass matrix of {size} × {size} is not positive definite; every degree of freedom needs a mass"
    )]
    NotDefinite {
        /// Number of rows, equal to that of columns, of the matrix M.
        size: usize,
    },
    /// The QR iteration for the eigenvalues reaches its bound.
    #[error(
        "the QR iteration on a matrix of {size} × {size} does not converge within {iterations} iterations; use a lower model order, or scale the data to similar magnitudes"
    )]
    NotConverged {
        /// Number of rows, equal to that of columns, of the matrix whose eigenvalues do not converge.
        size: usize,
        /// Largest number of iterations: for all eigenvalues of a symmetric or Hermitian matrix, otherwise until the
        /// next eigenvalue or pair is split off.
        iterations: usize,
    },
}

/// Number of rows of the matrix; an error if it is not square or has an entry that is not finite.
pub(super) fn size_of<T: ComplexField>(matrix: &DMatrix<T>) -> Result<usize, EigenvalueError> {
    let (rows, columns) = matrix.shape();
    if rows != columns {
        return Err(EigenvalueError::NotSquare { rows, columns });
    }
    if matrix.iter().any(|entry| !entry.is_finite()) {
        return Err(EigenvalueError::NotFinite { size: rows });
    }
    Ok(rows)
}
