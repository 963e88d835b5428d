//! Poles of every model order by the least-squares complex frequency-domain method (LSCF) with a common denominator.
//!
//! H_k(f) = B_k(z)/A(z) with z = exp(i2π(f − f₁)T), f₁ the lower end of the band, and complex coefficients (Guillaume,
//! Verboven and Vanlanduit 1998). T is chosen so that the band covers nearly the whole unit circle. With A(0) = 1 the
//! spurious poles that fit noise lie outside the unit circle, that is, they have negative damping (Cauberghe,
//! Guillaume, Verboven, Parloo and Vanlanduit 2004).

use nalgebra::{Cholesky, DMatrix, DVector};
use num_complex::Complex64;
use std::f64::consts::TAU;

use super::receptances::Receptances;
use quietcut_numerics::eigenvalues::{EigenvalueError, polynomial_roots};

/// Fraction of the unit circle in the z plane that the frequency band covers. A choice: the gap lets receptances differ
/// between the two ends of the band.
const ARC: f64 = 0.9;

/// Ridge on the diagonal of the normal equations of the polynomial coefficients, relative to the mean of the diagonal:
/// powers of z on an arc are nearly dependent. A choice, near the rounding error. The columns have nearly equal
/// lengths, since |z| = 1, and are not scaled.
const RIDGE: f64 = 1e-13;

/// Sums over the frequency lines of one receptance H from which the normal equations of numerator and denominator
/// follow, weighted with w = 1/σ. The entry of row i and column j depends on m = j − i alone.
struct Sums {
    /// Entries of the numerator's block of the normal equations: Σ w² z^m over the lines, m = 0 … n, with the weight w.
    numerator: Vec<Complex64>,
    /// Entries between numerator and denominator in the normal equations: Σ w² H z^m over the lines, m = −n … n.
    mixed: Vec<Complex64>,
    /// Entries of the denominator's block of the normal equations: Σ w² |H|² z^m over the lines, m = 0 … n.
    denominator: Vec<Complex64>,
}

/// Poles λ of the models of order 1 to `highest`, rad/s: one list per order. The list of an order with singular
/// equations is empty.
///
/// # Errors
/// The companion matrix has an entry that is not finite, or its eigenvalue iteration exceeds its bound.
pub(super) fn poles(data: &Receptances, highest: usize) -> Result<Vec<Vec<Complex64>>, EigenvalueError> {
    let [from_hz, to_hz] = data.band_hz();
    let period_s = ARC / (to_hz - from_hz);
    let powers: Vec<Vec<Complex64>> = data
        .frequency_hz
        .iter()
        .map(|hertz| {
            let angle = TAU * (hertz - from_hz) * period_s;
            (0..=highest)
                .map(|m| Complex64::from_polar(1.0, angle * m as f64))
                .collect()
        })
        .collect();
    let sums: Vec<Sums> = (0..data.values.len())
        .map(|k| sums(data, k, &powers, highest))
        .collect();
    (1..=highest)
        .map(|order| {
            let roots = match denominator(&sums, order, highest) {
                Some(a) => roots(&a)?,
                None => Vec::new(),
            };
            Ok(roots
                .into_iter()
                .filter(|z| z.norm() > 0.0)
                .map(|z| {
                    // The band covers the angles of z from 0 to 2π·ARC; angles beyond the middle of the remaining gap
                    // belong to frequencies below the band.
                    let turn = z.arg().rem_euclid(TAU);
                    let turn = if turn > 0.5 * (1.0 + ARC) * TAU {
                        turn - TAU
                    } else {
                        turn
                    };
                    Complex64::new(z.norm().ln(), turn) / period_s + Complex64::new(0.0, TAU * from_hz)
                })
                .collect())
        })
        .collect()
}

fn sums(data: &Receptances, k: usize, powers: &[Vec<Complex64>], highest: usize) -> Sums {
    let mut sums = Sums {
        numerator: vec![Complex64::ZERO; highest + 1],
        mixed: vec![Complex64::ZERO; 2 * highest + 1],
        denominator: vec![Complex64::ZERO; highest + 1],
    };
    for ((h, deviation), powers) in data.values[k].iter().zip(&data.deviation[k]).zip(powers) {
        let weight = (deviation * deviation).recip();
        for (m, power) in powers.iter().enumerate() {
            sums.numerator[m] += weight * power;
            sums.denominator[m] += weight * h.norm_sqr() * power;
            sums.mixed[highest + m] += weight * h * power;
            if m > 0 {
                sums.mixed[highest - m] += weight * h * power.conj();
            }
        }
    }
    sums
}

/// Coefficients a₀ = 1, a₁ … a_n of the common denominator; `None` if the normal equations are singular.
fn denominator(sums: &[Sums], order: usize, highest: usize) -> Option<Vec<Complex64>> {
    let size = order + 1;
    let hermitian = |of: &[Complex64]| {
        DMatrix::from_fn(
            size,
            size,
            |i, j| if j >= i { of[j - i] } else { of[i - j].conj() },
        )
    };
    let mut reduced = DMatrix::<Complex64>::zeros(size, size);
    for sums in sums {
        let mut numerator = hermitian(&sums.numerator);
        ridge(&mut numerator);
        let mixed = DMatrix::from_fn(size, size, |i, j| -sums.mixed[highest + j - i]);
        let eliminated = mixed.adjoint() * Cholesky::new(numerator)?.solve(&mixed);
        reduced += hermitian(&sums.denominator) - eliminated;
    }
    let mut inner = reduced.view((1, 1), (order, order)).into_owned();
    ridge(&mut inner);
    let right: DVector<Complex64> = -reduced.view((1, 0), (order, 1)).column(0).into_owned();
    let solution = Cholesky::new(inner)?.solve(&right);
    Some(
        std::iter::once(Complex64::ONE)
            .chain(solution.iter().copied())
            .collect(),
    )
}

fn ridge(matrix: &mut DMatrix<Complex64>) {
    let size = matrix.nrows();
    let mean = matrix.diagonal().iter().map(|entry| entry.re).sum::<f64>() / size.max(1) as f64;
    for i in 0..size {
        matrix[(i, i)] += RIDGE * mean;
    }
}

/// Roots of a₀ + a₁z + … + a_n zⁿ with a₀ = 1, without those beyond 1e12. They are computed as inverses of the roots of
/// the reversed polynomial, whose leading coefficient is a₀.
fn roots(a: &[Complex64]) -> Result<Vec<Complex64>, EigenvalueError> {
    let reversed: Vec<Complex64> = a.iter().rev().copied().collect();
    let inverses = polynomial_roots(&reversed)?;
    Ok(inverses
        .into_iter()
        .filter(|value| value.norm() > 1e-12)
        .map(|value| value.inv())
        .collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn roots_that_cannot_be_computed_are_an_error() {
        let overflow = [Complex64::ONE, Complex64::new(f64::INFINITY, 0.0), Complex64::ONE];
        let error = crate::modes::ModesError::from(roots(&overflow).unwrap_err());
        assert!(error.to_string().contains("check the data"), "{error}");
    }
}
