//! Eigenvectors of band Hessenberg matrices (few diagonals below the main one), as block Arnoldi produces them.

use nalgebra::{DMatrix, DVector};
use num_complex::Complex64;
use quietcut_numerics::eigenvalues::inverse_iteration;

/// Triangular factors of H − s I, with the shift s slightly off an eigenvalue of the real n × n matrix H.
///
/// With b diagonals below the main one the factorization takes about 4 b n² operations; a full matrix takes 8/3 n³.
#[derive(Clone, Debug)]
pub(crate) struct Shifted {
    size: usize,
    band: usize,
    /// Upper triangular factor U of H − s I, row by row.
    upper: Vec<Complex64>,
    /// Elimination factors of the `band` rows below the diagonal, for each column.
    factors: Vec<Complex64>,
    /// Index of the row exchanged with the pivot row, for each elimination step.
    pivots: Vec<usize>,
}

/// Relative distance of the shift from an eigenvalue μ ≠ 0. Each inverse iteration multiplies the eigenvector by
/// 1e8/|μ|, and the matrix stays regular.
const SHIFT: f64 = 1e-8;

impl Shifted {
    /// LU factors of H − s I, with s slightly off `eigenvalue`, for a matrix H that is zero below its `band`-th lower
    /// diagonal.
    pub(crate) fn new(matrix: &DMatrix<f64>, band: usize, eigenvalue: Complex64) -> Self {
        let size = matrix.nrows();
        let shift = if eigenvalue == Complex64::ZERO {
            Complex64::from(1e-10 * matrix.amax())
        } else {
            eigenvalue * (1.0 + SHIFT)
        };
        let mut upper = vec![Complex64::ZERO; size * size];
        for (j, column) in matrix.column_iter().enumerate() {
            for (i, entry) in column.iter().enumerate().take(j + band + 1) {
                upper[i * size + j] = Complex64::from(*entry);
            }
            upper[j * size + j] -= shift;
        }
        // Value that replaces a vanishing pivot, so that the shifted matrix stays regular.
        let least = (f64::EPSILON * matrix.amax()).max(f64::MIN_POSITIVE);
        let mut factors = vec![Complex64::ZERO; size * band];
        let mut pivots = Vec::with_capacity(size);
        for column in 0..size {
            let end = (column + band + 1).min(size);
            let pivot = (column..end)
                .max_by(|&p, &q| {
                    let entry = |row: usize| upper[row * size + column].l1_norm();
                    entry(p).total_cmp(&entry(q))
                })
                .unwrap_or(column);
            pivots.push(pivot);
            if pivot != column {
                for j in column..size {
                    upper.swap(column * size + j, pivot * size + j);
                }
            }
            if upper[column * size + column].l1_norm() < least {
                upper[column * size + column] = Complex64::from(least);
            }
            let (above, below) = upper[column * size..end * size].split_at_mut(size);
            for (row, factor) in below.chunks_exact_mut(size).zip(&mut factors[column * band..]) {
                *factor = row[column] / above[column];
                if *factor != Complex64::ZERO {
                    for (entry, known) in row[column..].iter_mut().zip(&above[column..]) {
                        *entry -= *factor * known;
                    }
                }
            }
        }
        Self {
            size,
            band,
            upper,
            factors,
            pivots,
        }
    }

    /// Solves (H − s I) x = b in place from the factors, with b in `vector`.
    fn solve(&self, vector: &mut DVector<Complex64>) {
        let (size, band) = (self.size, self.band);
        for column in 0..size {
            vector.swap_rows(column, self.pivots[column]);
            let known = vector[column];
            let end = (column + band + 1).min(size);
            for (row, factor) in (column + 1..end).zip(&self.factors[column * band..]) {
                vector[row] -= factor * known;
            }
        }
        for row in (0..size).rev() {
            let entries = &self.upper[row * size..(row + 1) * size];
            let known: Complex64 = entries[row + 1..]
                .iter()
                .zip(&vector.as_slice()[row + 1..])
                .map(|(entry, x)| entry * x)
                .sum();
            vector[row] = (vector[row] - known) / entries[row];
        }
    }

    /// Solves the transposed system (H − s I)ᵀ y = b in place from the factors, with b in `vector`.
    #[cfg(test)]
    fn solve_transposed(&self, vector: &mut DVector<Complex64>) {
        let (size, band) = (self.size, self.band);
        for row in 0..size {
            let entries = &self.upper[row * size..(row + 1) * size];
            let known = vector[row] / entries[row];
            vector[row] = known;
            for (entry, y) in entries[row + 1..]
                .iter()
                .zip(&mut vector.as_mut_slice()[row + 1..])
            {
                *y -= entry * known;
            }
        }
        for column in (0..size).rev() {
            let end = (column + band + 1).min(size);
            let below: Complex64 = (column + 1..end)
                .zip(&self.factors[column * band..])
                .map(|(row, factor)| factor * vector[row])
                .sum();
            vector[column] -= below;
            vector.swap_rows(column, self.pivots[column]);
        }
    }

    /// Right eigenvector x of length 1, H x = μ x; `None` if the result is not finite.
    pub(crate) fn right(&self) -> Option<DVector<Complex64>> {
        self.iterate(Self::solve)
    }

    /// Left eigenvector y of length 1: yᵀ H = μ yᵀ.
    #[cfg(test)]
    fn left(&self) -> Option<DVector<Complex64>> {
        self.iterate(Self::solve_transposed)
    }

    /// Condition number 1/|yᵀ x| ≥ 1 of the eigenvalue: its change per change of the matrix.
    #[cfg(test)]
    pub(crate) fn condition(&self) -> Option<f64> {
        let along: Complex64 = self.left()?.dot(&self.right()?);
        Some(along.norm().recip().max(1.0))
    }

    fn iterate(&self, solve: fn(&Self, &mut DVector<Complex64>)) -> Option<DVector<Complex64>> {
        let start = DVector::from_fn(self.size, |i, _| {
            Complex64::new(1.0, (i as f64 * 0.618).fract() - 0.3)
        });
        inverse_iteration(start, |vector| {
            solve(self, vector);
            true
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use quietcut_numerics::eigenvalues::of_real;

    #[test]
    fn vectors_of_bands_are_eigenvectors_from_both_sides() {
        for (size, band) in [(1, 1), (5, 1), (40, 1), (41, 3), (7, 12)] {
            let matrix = DMatrix::from_fn(size, size, |i, j| {
                if i > j + band {
                    0.0
                } else {
                    ((i * size + j + 1) as f64 * 2.0_f64.sqrt()).fract() - 0.5
                }
            });
            let complex = matrix.map(Complex64::from);
            for value in of_real(matrix.clone()).unwrap() {
                let shifted = Shifted::new(&matrix, band, value);
                let (right, left) = (shifted.right().unwrap(), shifted.left().unwrap());
                let miss = &complex * &right - &right * value;
                let missed = complex.tr_mul(&left) - &left * value;
                // Tolerance: rounding of the matrix, whose norm is below 20.
                assert!(
                    miss.norm() < 1e-12 && missed.norm() < 1e-12,
                    "{size} {band} {value}"
                );
            }
        }
        // [[1, 1e6], [0, 2]] has y = (1, −1e6)ᵀ/1e6 and x = (1, 0)ᵀ for the eigenvalue 1.
        let far = DMatrix::from_row_slice(2, 2, &[1.0, 1e6, 0.0, 2.0]);
        let condition = Shifted::new(&far, 1, Complex64::ONE).condition().unwrap();
        assert!((condition / 1e6 - 1.0).abs() < 1e-3, "{condition}");
    }
}
