//! Eigenvectors of a matrix by inverse iteration.

use nalgebra::{DMatrix, DVector};
use num_complex::Complex64;

/// Number of steps of [`inverse_iteration`]. With a shift at the relative distance [`BESIDE`] from the eigenvalue, each
/// step amplifies the wanted eigenvector by about 1e8 relative to those of well separated eigenvalues.
const STEPS: usize = 3;

/// Distance of the shift in [`eigenvector`] from an eigenvalue other than zero, relative to that eigenvalue; it keeps
/// the shifted matrix regular.
const BESIDE: f64 = 1e-8;

/// Right eigenvector of length 1 of a square matrix for an approximate eigenvalue. `None` if the matrix is not square,
/// or if [`null_vector`] of the matrix minus a shift next to the eigenvalue is `None`.
pub fn eigenvector(matrix: &DMatrix<Complex64>, eigenvalue: Complex64) -> Option<DVector<Complex64>> {
    if !matrix.is_square() {
        return None;
    }
    let order = matrix.nrows();
    let shift = if eigenvalue.norm() > 0.0 {
        eigenvalue * (1.0 + BESIDE)
    } else {
        Complex64::from(1e-10 * matrix.norm())
    };
    null_vector(matrix - DMatrix::identity(order, order) * shift)
}

/// Vector v of length 1 with A v ≈ 0, of a matrix A that is nearly singular, but not exactly: approximately its
/// eigenvector of the eigenvalue nearest to zero. `None` if A is not square or not finite, or if [`inverse_iteration`]
/// returns `None`, as it does if the LU decomposition of A has a pivot of zero.
pub fn null_vector(matrix: DMatrix<Complex64>) -> Option<DVector<Complex64>> {
    // An infinite pivot would be divided out unseen.
    if !matrix.is_square() || matrix.iter().any(|entry| !entry.is_finite()) {
        return None;
    }
    let order = matrix.nrows();
    let lu = matrix.lu();
    let start = DVector::from_fn(order, |i, _| Complex64::new(1.0, 0.3 * i as f64));
    inverse_iteration(start, |vector| lu.solve_mut(vector))
}

/// Inverse iteration from `start`: `solve` replaces v by (A − σI)⁻¹ v, and v is scaled to length 1 after each of three
/// steps. `None` if `solve` returns false, or a vector whose norm is zero or not finite.
pub fn inverse_iteration(
    start: DVector<Complex64>,
    mut solve: impl FnMut(&mut DVector<Complex64>) -> bool,
) -> Option<DVector<Complex64>> {
    let mut vector = start;
    for _ in 0..STEPS {
        let is_solved = solve(&mut vector);
        let norm = vector.norm();
        if !(is_solved && norm.is_finite() && norm > 0.0) {
            return None;
        }
        vector.unscale_mut(norm);
    }
    Some(vector)
}

#[cfg(test)]
mod tests {
    use rand::{RngExt, SeedableRng};

    use super::*;
    use crate::eigenvalues::of_complex;

    #[test]
    fn every_eigenvector_of_a_random_matrix_meets_its_equation() {
        let seed = 23;
        println!("seed {seed}");
        let mut rng = rand_chacha::ChaCha8Rng::seed_from_u64(seed);
        for size in [1, 2, 5, 20] {
            let matrix = DMatrix::from_fn(size, size, |_, _| {
                Complex64::new(rng.random_range(-1.0..1.0), rng.random_range(-1.0..1.0))
            });
            for eigenvalue in of_complex(matrix.clone()).unwrap() {
                let vector = eigenvector(&matrix, eigenvalue).unwrap();
                assert!((vector.norm() - 1.0).abs() < 1e-14);
                let miss = &matrix * &vector - &vector * eigenvalue;
                assert!(miss.norm() < 1e-12 * matrix.norm(), "{size}: {}", miss.norm());
            }
        }
        // An eigenvalue of zero, and no number.
        let nilpotent = DMatrix::from_fn(2, 2, |i, j| Complex64::from(f64::from(u8::from(i < j))));
        let vector = eigenvector(&nilpotent, Complex64::ZERO).unwrap();
        assert!(vector[1].norm() < 1e-9);
        assert!(null_vector(DMatrix::repeat(2, 2, Complex64::from(f64::NAN))).is_none());
        let infinite = DMatrix::from_diagonal(&DVector::from_vec(vec![
            Complex64::from(f64::INFINITY),
            Complex64::ONE,
        ]));
        assert!(null_vector(infinite).is_none());
        // No square.
        assert!(null_vector(DMatrix::repeat(2, 3, Complex64::ONE)).is_none());
        assert!(eigenvector(&DMatrix::repeat(3, 2, Complex64::ONE), Complex64::ONE).is_none());
    }
}
