//! Eigenvalues of complex matrices, without the reason where there are none: see [`crate::eigenvalues`].

use nalgebra::DMatrix;
use num_complex::Complex64;

use crate::eigenvalues;

/// [`eigenvalues::of_complex`], `None` for an error.
pub fn eigenvalues(matrix: DMatrix<Complex64>) -> Option<Vec<Complex64>> {
    eigenvalues::of_complex(matrix).ok()
}

/// [`eigenvalues::dominant`], `None` for an error.
pub fn dominant(matrix: &DMatrix<Complex64>, floor: f64) -> Option<Vec<Complex64>> {
    eigenvalues::dominant(matrix, floor).ok()
}
