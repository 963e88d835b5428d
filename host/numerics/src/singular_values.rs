//! Singular value decomposition A = U Σ Vᴴ with a bounded iteration.

use nalgebra::{ComplexField, DMatrix, DVector, Dyn, SVD};

/// Number of QR iterations on a matrix, divided by the number of its singular values, at which the decomposition ends
/// with an error; two or three are usual.
const ITERATIONS_PER_VALUE: usize = 100;

/// Error of the singular value decomposition of a matrix.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum SingularValueError {
    /// The matrix has no rows or no columns.
    #[error("a matrix of {rows} × {columns} has no singular values; there are no data")]
    Empty {
        /// Rows.
        rows: usize,
        /// Columns.
        columns: usize,
    },
    /// An entry of the matrix is infinite or not a number.
    #[error(
        "a matrix of {rows} × {columns} has an entry that is not finite; check the data for gaps, overflow and division by zero"
    )]
    NotFinite {
        /// Rows.
        rows: usize,
        /// Columns.
        columns: usize,
    },
    /// The QR iteration for the singular values exceeds its bound.
    #[error(
        "the singular values of a matrix of {rows} × {columns} do not converge within {iterations} iterations; scale the data to similar magnitudes"
    )]
    NotConverged {
        /// Rows.
        rows: usize,
        /// Columns.
        columns: usize,
        /// Largest number of iterations.
        iterations: usize,
    },
}

/// Selects which singular vectors are computed together with the singular values.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Vectors {
    /// None.
    Neither,
    /// The left singular vectors, columns of U.
    Left,
    /// The left singular vectors, columns of U, and the right ones, rows of Vᵀ (Vᴴ for a complex matrix).
    Both,
}

/// Singular value decomposition of `matrix`, with the singular values in descending order.
///
/// # Errors
/// The matrix is empty, has an entry that is not finite, or the iteration exceeds its bound.
pub fn decompose<T: ComplexField<RealField = f64>>(
    matrix: DMatrix<T>,
    vectors: Vectors,
) -> Result<SVD<T, Dyn, Dyn>, SingularValueError> {
    let (rows, columns) = matrix.shape();
    if matrix.is_empty() {
        return Err(SingularValueError::Empty { rows, columns });
    }
    if matrix.iter().any(|entry| !entry.is_finite()) {
        return Err(SingularValueError::NotFinite { rows, columns });
    }
    let iterations = ITERATIONS_PER_VALUE * rows.min(columns);
    let (left, right) = (vectors != Vectors::Neither, vectors == Vectors::Both);
    SVD::try_new(matrix, left, right, 5.0 * f64::EPSILON, iterations).ok_or(
        SingularValueError::NotConverged {
            rows,
            columns,
            iterations,
        },
    )
}

/// The singular values of `matrix` in descending order, without singular vectors.
///
/// # Errors
/// See [`decompose`].
pub fn singular_values<T: ComplexField<RealField = f64>>(
    matrix: DMatrix<T>,
) -> Result<DVector<f64>, SingularValueError> {
    decompose(matrix, Vectors::Neither).map(|decomposed| decomposed.singular_values)
}

#[cfg(test)]
mod tests {
    use std::time::{Duration, Instant};

    use nalgebra::DMatrix;
    use num_complex::Complex64;
    use rand::{RngExt, SeedableRng};

    use super::*;

    #[test]
    fn squares_are_the_eigenvalues_of_the_gram_matrix() {
        let seed = 17;
        println!("seed {seed}");
        let mut rng = rand_chacha::ChaCha8Rng::seed_from_u64(seed);
        for (rows, columns) in [(1, 1), (5, 2), (2, 5), (30, 12)] {
            let matrix = DMatrix::from_fn(rows, columns, |_, _| {
                Complex64::new(rng.random_range(-1.0..1.0), rng.random_range(-1.0..1.0))
            });
            let gram = if rows < columns {
                &matrix * matrix.adjoint()
            } else {
                matrix.adjoint() * &matrix
            };
            let mut squares: Vec<f64> = crate::eigenvalues::of_symmetric(gram)
                .unwrap()
                .eigenvalues
                .iter()
                .copied()
                .collect();
            squares.sort_by(|a, b| b.total_cmp(a));
            let decomposed = decompose(matrix.clone(), Vectors::Both).unwrap();
            for (value, square) in decomposed.singular_values.iter().zip(&squares) {
                assert!((value * value - square).abs() < 1e-12 * squares[0]);
            }
            assert!((decomposed.recompose().unwrap() - matrix).norm() < 1e-13 * squares[0].max(1.0));
        }
    }

    #[test]
    fn hard_matrices_return_in_time() {
        let start = Instant::now();
        for size in [2, 3, 10, 60] {
            let cyclic = DMatrix::from_fn(size, size, |i, j| f64::from(u8::from(i == (j + 1) % size)));
            for value in &singular_values(cyclic).unwrap() {
                assert!((value - 1.0).abs() < 1e-13);
            }
            assert_eq!(
                singular_values(DMatrix::<f64>::zeros(size, size)).unwrap().max(),
                0.0
            );
            let graded = DMatrix::from_fn(size, size, |i, j| {
                if i <= j {
                    10.0_f64.powi(-(i as i32 * 7) % 290)
                } else {
                    0.0
                }
            });
            assert!(singular_values(graded).is_ok());
            let mut bad = DMatrix::identity(size, size);
            bad[(0, size - 1)] = f64::NAN;
            let (rows, columns) = (size, size);
            let expected = SingularValueError::NotFinite { rows, columns };
            assert_eq!(singular_values(bad).unwrap_err(), expected);
        }
        assert!(singular_values(DMatrix::<f64>::zeros(0, 3)).is_err());
        assert!(start.elapsed() < Duration::from_secs(10));
    }
}
