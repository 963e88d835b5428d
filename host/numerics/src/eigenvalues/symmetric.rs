//! Eigenvalues and eigenvectors of symmetric and Hermitian matrices, and of symmetric pencils.

use nalgebra::{Cholesky, ComplexField, DMatrix, DVector, Dyn, SymmetricEigen};

use super::error::{EigenvalueError, size_of};

/// Number of QR iterations on a symmetric or Hermitian matrix, divided by the number of its eigenvalues, at which the
/// computation ends with an error; two or three are usual.
const ITERATIONS_PER_EIGENVALUE: usize = 60;

/// Eigenvalues (real) and orthonormal eigenvectors of a real symmetric or Hermitian matrix, unordered.
///
/// The entries above the diagonal are taken from those below it. The error of each eigenvalue is a few rounding errors
/// of the norm of the matrix.
///
/// # Errors
/// The matrix is not square, has an entry that is not finite, or the iteration exceeds its bound.
pub fn of_symmetric<T: ComplexField<RealField = f64>>(
    matrix: DMatrix<T>,
) -> Result<SymmetricEigen<T, Dyn>, EigenvalueError> {
    let size = size_of(&matrix)?;
    if size == 0 {
        return Ok(SymmetricEigen {
            eigenvectors: matrix,
            eigenvalues: DVector::zeros(0),
        });
    }
    let iterations = ITERATIONS_PER_EIGENVALUE * size;
    SymmetricEigen::try_new(matrix, f64::EPSILON, iterations)
        .ok_or(EigenvalueError::NotConverged { size, iterations })
}

/// Eigenvalues λ and eigenvectors v of K v = λ M v, unordered, with K = `stiffness` symmetric and M = `mass` symmetric
/// positive definite.
///
/// With M = L Lᵀ the eigenvalues are those of L⁻¹ K L⁻ᵀ; the eigenvectors, columns of V, satisfy Vᵀ M V = I and Vᵀ K V
/// = diag λ. The λ are the squares of the natural angular frequencies, the v the mode shapes.
///
/// # Errors
/// See [`EigenvalueError`].
pub fn of_symmetric_pencil(
    stiffness: &DMatrix<f64>,
    mass: &DMatrix<f64>,
) -> Result<SymmetricEigen<f64, Dyn>, EigenvalueError> {
    let size = size_of(stiffness)?;
    let (rows, columns) = mass.shape();
    if size_of(mass)? != size {
        return Err(EigenvalueError::NotSquare { rows, columns });
    }
    let not_definite = EigenvalueError::NotDefinite { size };
    let lower = Cholesky::new(mass.clone()).ok_or(not_definite)?.l();
    let half = lower.solve_lower_triangular(stiffness).ok_or(not_definite)?;
    let whole = lower
        .solve_lower_triangular(&half.transpose())
        .ok_or(not_definite)?;
    let mut eigen = of_symmetric(0.5 * (&whole + whole.transpose()))?;
    eigen.eigenvectors = lower
        .tr_solve_lower_triangular(&eigen.eigenvectors)
        .ok_or(not_definite)?;
    Ok(eigen)
}
