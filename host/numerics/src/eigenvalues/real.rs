//! Eigenvalues of a real matrix by the Francis double-shift QR iteration.
//!
//! The QR iteration of nalgebra has no exceptional shifts and does not end for some matrices of period maps. Method:
//! balancing by nalgebra, then Wilkinson & Reinsch, Handbook for Automatic Computation II, procedures orthes and hqr.

use nalgebra::DMatrix;
use nalgebra::linalg::balancing::balance_parlett_reinsch;
use num_complex::Complex64;

use super::error::{EigenvalueError, size_of};

/// Largest number of QR iterations on a real matrix until the next eigenvalue or pair is split off; more end the
/// computation with an error. Three are usual; an exceptional shift after every ten iterations breaks cycles.
const ITERATIONS_MAX: usize = 90;

/// All eigenvalues of a real matrix, unordered: complex ones in exact conjugate pairs, real ones with the imaginary
/// part zero.
///
/// The method is backward stable: the error is that of a change of the balanced matrix by a few rounding errors of its
/// norm.
///
/// # Errors
/// The matrix is not square, has an entry that is not finite, or the iteration exceeds its bound.
pub fn of_real(mut matrix: DMatrix<f64>) -> Result<Vec<Complex64>, EigenvalueError> {
    size_of(&matrix)?;
    let unit = unit(matrix.amax());
    matrix /= unit;
    balance_parlett_reinsch(&mut matrix);
    let size = matrix.nrows();
    let mut rows = Rows {
        size,
        entries: matrix.transpose().as_slice().to_vec(),
    };
    rows.reduce_to_hessenberg();
    let mut found = rows.iterate()?;
    for value in &mut found {
        *value *= unit;
    }
    Ok(found)
}

/// Divisor by which a matrix with the largest absolute entry `largest` is scaled before balancing: a power of two near
/// `largest` if squares of entries might overflow or underflow, otherwise 1. Overflow would keep balancing from ending.
fn unit(largest: f64) -> f64 {
    if (1e-100..1e100).contains(&largest) || largest == 0.0 {
        1.0
    } else {
        largest.log2().floor().exp2()
    }
}

/// A square matrix by rows.
struct Rows {
    size: usize,
    entries: Vec<f64>,
}

impl Rows {
    fn at(&self, i: usize, j: usize) -> f64 {
        self.entries[i * self.size + j]
    }

    fn set(&mut self, i: usize, j: usize, value: f64) {
        self.entries[i * self.size + j] = value;
    }

    /// Reduces the matrix to Hessenberg form, with zeros below the first subdiagonal, by Householder reflections from
    /// both sides.
    fn reduce_to_hessenberg(&mut self) {
        let n = self.size;
        let mut vector = vec![0.0; n];
        for column in 0..n.saturating_sub(2) {
            let norm = (column + 1..n)
                .map(|i| self.at(i, column).powi(2))
                .sum::<f64>()
                .sqrt();
            if norm == 0.0 {
                continue;
            }
            for (i, entry) in vector.iter_mut().enumerate().skip(column + 1) {
                *entry = self.entries[i * n + column];
            }
            let head = vector[column + 1];
            vector[column + 1] += norm.copysign(head);
            // 2/vᵀv
            let factor = 1.0 / (norm * (norm + head.abs()));
            let v = &vector[column + 1..];
            let mut sums = vec![0.0; n];
            for (row, v) in self.entries.chunks_exact(n).skip(column + 1).zip(v) {
                for (sum, entry) in sums.iter_mut().zip(row) {
                    *sum += v * entry;
                }
            }
            for (row, v) in self.entries.chunks_exact_mut(n).skip(column + 1).zip(v) {
                for (entry, sum) in row.iter_mut().zip(&sums) {
                    *entry -= factor * v * sum;
                }
            }
            for row in self.entries.chunks_exact_mut(n) {
                let tail = &mut row[column + 1..];
                let sum: f64 = tail.iter().zip(v).map(|(entry, v)| entry * v).sum();
                for (entry, v) in tail.iter_mut().zip(v) {
                    *entry -= factor * sum * v;
                }
            }
            for i in column + 2..n {
                self.set(i, column, 0.0);
            }
        }
    }

    /// Eigenvalues of this Hessenberg matrix by QR iteration with double shifts; converged eigenvalues are split off
    /// from the last row upwards.
    fn iterate(mut self) -> Result<Vec<Complex64>, EigenvalueError> {
        let n = self.size;
        let norm: f64 = self.entries.iter().map(|entry| entry.abs()).sum();
        let mut found = Vec::with_capacity(n);
        let mut active = n;
        let mut shifted = 0.0;
        let mut iterations = 0;
        while active > 0 {
            let last = active - 1;
            let first = self.split(last, norm);
            if first == last {
                found.push(Complex64::from(self.at(last, last) + shifted));
                active -= 1;
                iterations = 0;
                continue;
            }
            if first + 1 == last {
                found.extend(self.pair(last, shifted));
                active -= 2;
                iterations = 0;
                continue;
            }
            if iterations == ITERATIONS_MAX {
                return Err(EigenvalueError::NotConverged { size: n, iterations });
            }
            let corner = self.at(last, last);
            let mut shift = Shift {
                x: corner,
                y: self.at(last - 1, last - 1),
                w: self.at(last, last - 1) * self.at(last - 1, last),
            };
            if iterations > 0 && iterations % 10 == 0 {
                shifted += corner;
                for i in 0..active {
                    self.entries[i * n + i] -= corner;
                }
                let s = self.at(last, last - 1).abs() + self.at(last - 1, last - 2).abs();
                shift = Shift {
                    x: 0.75 * s,
                    y: 0.75 * s,
                    w: -0.4375 * s * s,
                };
            }
            iterations += 1;
            self.sweep(first, last, shift);
        }
        Ok(found)
    }

    /// First row of the largest diagonal block that ends at row `last` and has no negligible entry on its subdiagonal;
    /// sets the negligible entry to the left of the block to zero.
    ///
    /// `norm`, the sum of all absolute entries before the iteration, is the scale of a subdiagonal entry if both
    /// neighbouring diagonal entries are zero.
    fn split(&mut self, last: usize, norm: f64) -> usize {
        let mut row = last;
        while row > 0 {
            let diagonal = self.at(row - 1, row - 1).abs() + self.at(row, row).abs();
            let scale = if diagonal == 0.0 { norm } else { diagonal };
            if self.at(row, row - 1).abs() <= f64::EPSILON * scale {
                self.set(row, row - 1, 0.0);
                break;
            }
            row -= 1;
        }
        row
    }

    /// Both eigenvalues of the 2 × 2 diagonal block that ends at row `last`, each plus `shifted`, the sum that
    /// exceptional shifts have subtracted from the diagonal so far.
    fn pair(&self, last: usize, shifted: f64) -> [Complex64; 2] {
        let x = self.at(last, last);
        let w = self.at(last, last - 1) * self.at(last - 1, last);
        let p = 0.5 * (self.at(last - 1, last - 1) - x);
        let q = p * p + w;
        let z = q.abs().sqrt();
        let x = x + shifted;
        if q >= 0.0 {
            let z = p + z.copysign(p);
            let other = if z == 0.0 { x } else { x - w / z };
            [Complex64::from(x + z), Complex64::from(other)]
        } else {
            [Complex64::new(x + p, z), Complex64::new(x + p, -z)]
        }
    }

    /// One Francis QR step with two shifts on the diagonal block from row `first` to row `last` of a Hessenberg matrix;
    /// entries outside the block are not updated. The step begins at the row of [`Self::start`].
    fn sweep(&mut self, first: usize, last: usize, shift: Shift) {
        let (start, mut vector) = self.start(first, last, shift);
        for i in start + 2..=last {
            self.set(i, i - 2, 0.0);
            if i > start + 2 {
                self.set(i, i - 3, 0.0);
            }
        }
        for k in start..last {
            let triple = k + 1 < last;
            let mut scale = 0.0;
            if k != start {
                vector = [
                    self.at(k, k - 1),
                    self.at(k + 1, k - 1),
                    if triple { self.at(k + 2, k - 1) } else { 0.0 },
                ];
                scale = vector.iter().map(|entry| entry.abs()).sum();
                if scale != 0.0 {
                    vector = vector.map(|entry| entry / scale);
                }
            }
            let [p, q, r] = vector;
            let s = (p * p + q * q + r * r).sqrt().copysign(p);
            if s == 0.0 {
                continue;
            }
            if k == start {
                if first != start {
                    self.set(k, k - 1, -self.at(k, k - 1));
                }
            } else {
                self.set(k, k - 1, -s * scale);
            }
            let p = p + s;
            let (x, y, z) = (p / s, q / s, r / s);
            let (q, r) = (q / p, r / p);
            self.reflect_rows(k, last, [q, r], [x, y, z]);
            self.reflect_columns(k, first..(last.min(k + 3) + 1), [q, r], [x, y, z], triple);
        }
    }

    /// Applies the Householder reflection I − (x, y, z)ᵀ(1, q, r) of a QR step from the left to rows k, k + 1 and, if
    /// it is not beyond `last`, k + 2, in columns k to `last`.
    fn reflect_rows(&mut self, k: usize, last: usize, [q, r]: [f64; 2], [x, y, z]: [f64; 3]) {
        let n = self.size;
        let (row_k, rest) = self.entries[k * n..].split_at_mut(n);
        let (row_1, rest) = rest.split_at_mut(n);
        let (row_k, row_1) = (&mut row_k[k..=last], &mut row_1[k..=last]);
        if k + 1 < last {
            let row_2 = &mut rest[k..=last];
            for ((a, b), c) in row_k.iter_mut().zip(row_1).zip(row_2) {
                let sum = *a + q * *b + r * *c;
                *a -= sum * x;
                *b -= sum * y;
                *c -= sum * z;
            }
        } else {
            for (a, b) in row_k.iter_mut().zip(row_1) {
                let sum = *a + q * *b;
                *a -= sum * x;
                *b -= sum * y;
            }
        }
    }

    /// Applies the Householder reflection I − (x, y, z)ᵀ(1, q, r) of a QR step from the right to columns k, k + 1 and,
    /// if `triple`, k + 2, in the given rows.
    fn reflect_columns(
        &mut self,
        k: usize,
        rows: std::ops::Range<usize>,
        [q, r]: [f64; 2],
        [x, y, z]: [f64; 3],
        triple: bool,
    ) {
        let n = self.size;
        let rows = self.entries[rows.start * n..rows.end * n].chunks_exact_mut(n);
        if triple {
            for row in rows {
                if let Some([a, b, c]) = row.get_mut(k..k + 3) {
                    let sum = x * *a + y * *b + z * *c;
                    *a -= sum;
                    *b -= sum * q;
                    *c -= sum * r;
                }
            }
        } else {
            for row in rows {
                if let Some([a, b]) = row.get_mut(k..k + 2) {
                    let sum = x * *a + y * *b;
                    *a -= sum;
                    *b -= sum * q;
                }
            }
        }
    }

    /// Row of the block at which the QR step with two shifts starts, and the vector that determines its first
    /// reflection. It is the last row where two successive small subdiagonal entries permit a start; without such
    /// entries, `first`.
    fn start(&self, first: usize, last: usize, shift: Shift) -> (usize, [f64; 3]) {
        let mut m = last - 2;
        loop {
            let z = self.at(m, m);
            let (r, s) = (shift.x - z, shift.y - z);
            let vector = [
                (r * s - shift.w) / self.at(m + 1, m) + self.at(m, m + 1),
                self.at(m + 1, m + 1) - z - r - s,
                self.at(m + 2, m + 1),
            ];
            let scale: f64 = vector.iter().map(|entry| entry.abs()).sum();
            let vector = if scale == 0.0 {
                vector
            } else {
                vector.map(|entry| entry / scale)
            };
            if m == first {
                return (m, vector);
            }
            let small = self.at(m, m - 1).abs() * (vector[1].abs() + vector[2].abs());
            let large =
                vector[0].abs() * (self.at(m - 1, m - 1).abs() + z.abs() + self.at(m + 1, m + 1).abs());
            if small <= f64::EPSILON * large {
                return (m, vector);
            }
            m -= 1;
        }
    }
}

/// The two shifts of a QR step: the eigenvalues of a 2 × 2 matrix with the diagonal entries x and y, and the product w
/// of the other two entries.
#[derive(Clone, Copy)]
struct Shift {
    x: f64,
    y: f64,
    w: f64,
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{RngExt, SeedableRng};

    fn sorted(mut values: Vec<Complex64>) -> Vec<Complex64> {
        values.sort_by(|a, b| a.re.total_cmp(&b.re).then(a.im.total_cmp(&b.im)));
        values
    }

    #[test]
    fn eigenvalues_of_random_matrices_are_those_of_nalgebra() {
        let seed = 7;
        println!("seed {seed}");
        let mut rng = rand_chacha::ChaCha8Rng::seed_from_u64(seed);
        for size in [1, 2, 3, 4, 5, 8, 13, 40] {
            for _ in 0..20 {
                let matrix = DMatrix::from_fn(size, size, |_, _| rng.random_range(-1.0..1.0));
                let ours = sorted(of_real(matrix.clone()).unwrap());
                let theirs = sorted(matrix.complex_eigenvalues().iter().copied().collect());
                for (a, b) in ours.iter().zip(&theirs) {
                    // Backward error 1e-15 times the norm, times the condition of the eigenvalues (seen: below 1e4).
                    assert!((a - b).norm() < 1e-10, "{size}: {a} {b}");
                }
            }
        }
    }

    #[test]
    fn cycles_are_broken_and_wide_scales_kept() {
        // A cyclic permutation: unshifted and doubly shifted QR stand still on it.
        let cyclic = DMatrix::from_fn(6, 6, |i, j| f64::from(u8::from(i == (j + 1) % 6)));
        for eigenvalue in of_real(cyclic).unwrap() {
            assert!((eigenvalue.norm() - 1.0).abs() < 1e-12);
        }
        // Triangular with entries of 1e8 beside eigenvalues from 1e-6 to 1: only balancing keeps the small ones.
        let wide = DMatrix::from_fn(4, 4, |i, j| match i.cmp(&j) {
            std::cmp::Ordering::Less => 1e8,
            std::cmp::Ordering::Equal => 0.01_f64.powi(i as i32),
            std::cmp::Ordering::Greater => 0.0,
        });
        let found = sorted(of_real(wide).unwrap());
        for (found, expected) in found.iter().zip([1e-6, 1e-4, 1e-2, 1.0]) {
            assert!((found - expected).norm() < 1e-9 * expected, "{found}");
        }
        // Squares of the entries are no numbers.
        for unit in [1e-250, 1e250] {
            let far = DMatrix::from_row_slice(2, 2, &[0.0, unit, -unit, unit * 1e-40]);
            for eigenvalue in of_real(far).unwrap() {
                assert!((eigenvalue.norm() / unit - 1.0).abs() < 1e-12);
            }
        }
        assert!(of_real(DMatrix::from_element(2, 2, f64::NAN)).is_err());
        assert!(
            of_real(DMatrix::zeros(3, 3))
                .unwrap()
                .iter()
                .all(|value| *value == Complex64::ZERO)
        );
    }
}
