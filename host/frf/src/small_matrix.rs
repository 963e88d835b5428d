//! Complex matrices up to 3 × 3, without allocation: a measurement has several for each frequency line.

use num_complex::Complex64;

/// A complex 3 × 3 matrix. Smaller matrices occupy its leading block; all other entries are zero.
pub(super) type Matrix = [[Complex64; 3]; 3];

/// The zero matrix.
pub(super) const ZERO: Matrix = [[Complex64::ZERO; 3]; 3];

/// Matrix product A B.
pub(super) fn product(a: &Matrix, b: &Matrix) -> Matrix {
    std::array::from_fn(|i| std::array::from_fn(|j| (0..3).map(|k| a[i][k] * b[k][j]).sum()))
}

/// Product with the adjoint, A Bᴴ.
pub(super) fn product_adjoint(a: &Matrix, b: &Matrix) -> Matrix {
    std::array::from_fn(|i| std::array::from_fn(|j| (0..3).map(|k| a[i][k] * b[j][k].conj()).sum()))
}

/// Adjoint (conjugate transpose) Aᴴ.
pub(super) fn adjoint(a: &Matrix) -> Matrix {
    std::array::from_fn(|i| std::array::from_fn(|j| a[j][i].conj()))
}

/// Sum A + B.
pub(super) fn sum(a: &Matrix, b: &Matrix) -> Matrix {
    std::array::from_fn(|i| std::array::from_fn(|j| a[i][j] + b[i][j]))
}

/// Product s A with a real scalar.
pub(super) fn scaled(a: &Matrix, s: f64) -> Matrix {
    a.map(|row| row.map(|entry| entry * s))
}

/// Inverse of the leading `size` × `size` block by Gauss–Jordan elimination with partial pivoting; `None` if it is
/// singular to working precision.
pub(super) fn inverse(a: &Matrix, size: usize) -> Option<Matrix> {
    let mut left = *a;
    let mut right = ZERO;
    for (i, row) in right.iter_mut().enumerate().take(size) {
        row[i] = Complex64::ONE;
    }
    let largest = a.iter().flatten().map(|entry| entry.norm()).fold(0.0, f64::max);
    for column in 0..size {
        let pivot =
            (column..size).max_by(|&i, &j| left[i][column].norm().total_cmp(&left[j][column].norm()))?;
        if left[pivot][column].norm() <= f64::EPSILON * largest {
            return None;
        }
        left.swap(column, pivot);
        right.swap(column, pivot);
        let factor = left[column][column].inv();
        left[column] = left[column].map(|entry| entry * factor);
        right[column] = right[column].map(|entry| entry * factor);
        for row in (0..size).filter(|&row| row != column) {
            let factor = left[row][column];
            for k in 0..size {
                let (l, r) = (left[column][k], right[column][k]);
                left[row][k] -= factor * l;
                right[row][k] -= factor * r;
            }
        }
    }
    Some(right)
}

/// Smallest and largest eigenvalue of D^−½ A D^−½ for the leading `size` × `size` block (`size` ≤ 3) of a positive
/// semidefinite Hermitian matrix A with diagonal D. But for rounding, both lie between 0 and `size`. If a diagonal
/// entry of A is 0, the result is 0 and `size`.
///
/// Closed form for `size` 3: with the entries a_ij of D^−½ A D^−½, μ = λ − 1 solves μ³ − pμ − q = 0 with p = Σ_{i<j}
/// |a_ij|² and q = 2 Re(a_12 a_23 a_31).
pub(super) fn extreme_eigenvalues(a: &Matrix, size: usize) -> (f64, f64) {
    let entry = |i: usize, j: usize| {
        let scale = (a[i][i].re * a[j][j].re).sqrt();
        if i < size && j < size && scale > 0.0 {
            a[i][j] / scale
        } else {
            Complex64::ZERO
        }
    };
    if (0..size).any(|i| a[i][i].re <= 0.0) {
        return (0.0, size as f64);
    }
    let (u, v, w) = (entry(0, 1), entry(1, 2), entry(2, 0));
    if size < 3 {
        return (1.0 - u.norm(), 1.0 + u.norm());
    }
    let p = u.norm_sqr() + v.norm_sqr() + w.norm_sqr();
    let radius = (p / 3.0).sqrt();
    if radius == 0.0 {
        return (1.0, 1.0);
    }
    let cosine = ((u * v * w).re / radius.powi(3)).clamp(-1.0, 1.0);
    let angle = cosine.acos() / 3.0;
    let third = std::f64::consts::TAU / 3.0;
    (
        1.0 + 2.0 * radius * (angle + third).cos(),
        1.0 + 2.0 * radius * angle.cos(),
    )
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn matrix() -> impl Strategy<Value = Matrix> {
        prop::array::uniform3(prop::array::uniform3((-1.0..1.0f64, -1.0..1.0f64)))
            .prop_map(|rows| rows.map(|row| row.map(|(re, im)| Complex64::new(re, im))))
    }

    proptest! {
        #[test]
        fn a_matrix_times_its_inverse_is_the_identity(a in matrix(), size in 1usize..4) {
            let mut a = a;
            (0..3).for_each(|i| (0..3).filter(|&j| i >= size || j >= size).for_each(|j| a[i][j] = Complex64::ZERO));
            let Some(inverse) = inverse(&a, size) else { return Ok(()) };
            let norm = |a: &Matrix| a.iter().flatten().map(|entry| entry.norm()).fold(0.0, f64::max);
            let one = product(&a, &inverse);
            for (i, row) in one.iter().enumerate().take(size) {
                for (j, entry) in row.iter().enumerate().take(size) {
                    let expected = if i == j { 1.0 } else { 0.0 };
                    prop_assert!((entry - expected).norm() < 1e-13 * (1.0 + norm(&a) * norm(&inverse)));
                }
            }
        }

        #[test]
        fn extreme_eigenvalues_agree_with_nalgebra(a in matrix(), size in 1usize..4) {
            let power = product_adjoint(&a, &a);
            let (least, most) = extreme_eigenvalues(&power, size);
            let scaled = nalgebra::DMatrix::from_fn(size, size, |i, j| {
                power[i][j] / (power[i][i].re * power[j][j].re).sqrt()
            });
            let expected = scaled.symmetric_eigenvalues();
            prop_assert!((least - expected.min()).abs() < 1e-7);
            prop_assert!((most - expected.max()).abs() < 1e-7);
        }
    }
}
