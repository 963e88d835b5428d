//! Roots of a polynomial: eigenvalues of its companion matrix.

use nalgebra::DMatrix;
use num_complex::Complex64;

use super::complex::of_complex;
use super::error::EigenvalueError;

/// The roots of the polynomial Σₖ cₖ zᵏ, unordered, from its coefficients c₀ … cₙ in ascending powers.
///
/// Coefficients of zero at the highest powers are dropped, so that the number of roots is the degree; a constant, zero
/// included, has none. The roots are the eigenvalues of the companion matrix; for their rounding errors see Edelman and
/// Murakami, Math. Comp. 64 (1995) 763.
///
/// # Errors
/// A coefficient, or its ratio to the leading one, is not finite, or the QR iteration exceeds its bound.
pub fn polynomial_roots(coefficients: &[Complex64]) -> Result<Vec<Complex64>, EigenvalueError> {
    let Some(degree) = coefficients.iter().rposition(|c| *c != Complex64::ZERO) else {
        return Ok(Vec::new());
    };
    if coefficients.iter().any(|c| !c.is_finite()) {
        return Err(EigenvalueError::NotFinite { size: degree });
    }
    let leading = coefficients[degree];
    of_complex(DMatrix::from_fn(degree, degree, |i, j| {
        if i == 0 {
            -coefficients[degree - 1 - j] / leading
        } else {
            Complex64::from(f64::from(u8::from(i == j + 1)))
        }
    }))
}
