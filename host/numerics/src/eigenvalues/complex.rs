//! Eigenvalues of complex matrices: all eigenvalues, or only the largest of a large matrix.

use nalgebra::{DMatrix, DVector};
use num_complex::Complex64;

use super::error::{EigenvalueError, size_of};

/// Largest number of QR iterations on a complex matrix until the next eigenvalue is split off; more end the computation
/// with an error. Two or three are usual; an exceptional shift in every tenth iteration breaks cycles.
const ITERATIONS_MAX: usize = 90;

/// Largest number of rows of a complex matrix whose eigenvalues are all computed, although only the largest are wanted;
/// larger matrices are projected on a Krylov space. A choice.
const WHOLE: usize = 20;

/// Relative change of an eigenvalue of the projected matrix, while the Krylov space grows by four dimensions, up to
/// which the eigenvalue counts as converged. A choice.
const SETTLED: f64 = 1e-11;

/// All eigenvalues of a complex matrix, unordered.
///
/// # Errors
/// The matrix is not square, has an entry that is not finite, or the QR iteration exceeds its bound.
pub fn of_complex(matrix: DMatrix<Complex64>) -> Result<Vec<Complex64>, EigenvalueError> {
    match size_of(&matrix)? {
        0 => Ok(Vec::new()),
        1 => Ok(vec![matrix[(0, 0)]]),
        2 => Ok(pair(&matrix, 0).to_vec()),
        _ => of_hessenberg(matrix.hessenberg().unpack_h()),
    }
}

/// Eigenvalues of `matrix` with an absolute value of `floor` and above, and possibly smaller ones, in descending order
/// of the absolute value.
///
/// For a matrix with up to 20 rows, all eigenvalues are computed. For a larger one, a Krylov space grows until the
/// eigenvalues from `floor` on, and the largest one, of the matrix projected on this space no longer change, at most until
/// the space is invariant or the whole space. An eigenvalue with several eigenvectors is then found once, unless rounding repeats
/// it.
///
/// # Errors
/// The matrix is not square, an entry of it or of a product with a vector is not finite, or the QR iteration exceeds
/// its bound.
pub fn dominant(matrix: &DMatrix<Complex64>, floor: f64) -> Result<Vec<Complex64>, EigenvalueError> {
    let size = size_of(matrix)?;
    if size <= WHOLE {
        return of_complex(matrix.clone()).map(sorted);
    }
    let mut krylov = Krylov::new(size);
    let mut last: Vec<Complex64> = Vec::new();
    for dimension in 1..=size {
        let is_complete = krylov.extend(matrix).ok_or(EigenvalueError::NotFinite { size })?;
        if is_complete || dimension == size {
            return of_hessenberg(krylov.projected()).map(sorted);
        }
        if dimension < 12 || dimension % 4 != 0 {
            continue;
        }
        let mut found = sorted(of_hessenberg(krylov.projected())?);
        // The largest one counts also below `floor`: in a growing space it grows towards that of the matrix.
        let least = found.first().map_or(floor, |largest| floor.min(largest.norm()));
        found.retain(|value| value.norm() >= least);
        let settled = found.len() == last.len()
            && found.iter().all(|value| {
                last.iter()
                    .any(|before| (value - before).norm() <= SETTLED * value.norm())
            });
        if settled {
            return Ok(found);
        }
        last = found;
    }
    of_complex(matrix.clone()).map(sorted)
}

fn sorted(mut values: Vec<Complex64>) -> Vec<Complex64> {
    values.sort_by(|p, q| q.norm().total_cmp(&p.norm()).then(q.im.total_cmp(&p.im)));
    values
}

/// Orthonormal basis of a Krylov space, and the matrix projected on it (Arnoldi process).
struct Krylov {
    basis: Vec<DVector<Complex64>>,
    /// Columns of the projected matrix: column j has the coefficients of M q_j in the basis vectors q_0 to q_(j+1),
    /// with the matrix M that is projected.
    columns: Vec<Vec<Complex64>>,
}

impl Krylov {
    fn new(size: usize) -> Self {
        // The start vector has a different component in each direction, so that it is unlikely to lie in an invariant
        // subspace.
        let start = DVector::from_fn(size, |i, _| Complex64::cis(1.0 + 2.399_963 * (i * i) as f64));
        let norm = start.norm();
        Self {
            basis: vec![start.unscale(norm)],
            columns: Vec::new(),
        }
    }

    /// Extends the Krylov space by one dimension and the projected matrix by one column; true if the space is
    /// invariant, except for rounding, and gets no new basis vector. `None` if the norm of the new vector is not
    /// finite.
    fn extend(&mut self, matrix: &DMatrix<Complex64>) -> Option<bool> {
        let mut next = matrix * self.basis.last()?;
        let size = next.norm();
        let mut column = vec![Complex64::ZERO; self.basis.len()];
        // Orthogonalization is done twice, since rounding after a single pass causes spurious copies of eigenvalues.
        for _ in 0..2 {
            for (vector, coefficient) in self.basis.iter().zip(&mut column) {
                let part = vector.dotc(&next);
                *coefficient += part;
                next.axpy(-part, vector, Complex64::ONE);
            }
        }
        let rest = next.norm();
        if !rest.is_finite() {
            return None;
        }
        column.push(Complex64::from(rest));
        self.columns.push(column);
        let is_complete = rest <= 1e-15 * size;
        if !is_complete {
            self.basis.push(next.unscale(rest));
        }
        Some(is_complete)
    }

    /// The matrix projected on the Krylov space, a Hessenberg matrix.
    fn projected(&self) -> DMatrix<Complex64> {
        let size = self.columns.len();
        DMatrix::from_fn(size, size, |i, j| {
            self.columns[j].get(i).copied().unwrap_or(Complex64::ZERO)
        })
    }
}

/// Both eigenvalues of the 2 × 2 diagonal block of `m` that starts at row and column `first`.
fn pair(m: &DMatrix<Complex64>, first: usize) -> [Complex64; 2] {
    let (a, b) = (m[(first, first)], m[(first, first + 1)]);
    let (c, d) = (m[(first + 1, first)], m[(first + 1, first + 1)]);
    let (mean, half) = ((a + d) * 0.5, (a - d) * 0.5);
    let root = (half * half + b * c).sqrt();
    // The larger eigenvalue of the block is mean ± root with the sign at which the two do not cancel; the smaller one
    // follows from the determinant.
    let large = if (mean.conj() * root).re >= 0.0 {
        mean + root
    } else {
        mean - root
    };
    let small = if large == Complex64::ZERO {
        Complex64::ZERO
    } else {
        (a * d - b * c) / large
    };
    [large, small]
}

/// Eigenvalues of a complex Hessenberg matrix by QR iteration with single shifts; converged eigenvalues are split off
/// from the last row on.
fn of_hessenberg(mut m: DMatrix<Complex64>) -> Result<Vec<Complex64>, EigenvalueError> {
    let mut found = Vec::with_capacity(m.nrows());
    let norm = m.norm();
    let mut active = m.nrows();
    let mut iterations = 0;
    while active > 0 {
        let last = active - 1;
        let first = (1..=last)
            .rev()
            .find(|&i| {
                let beside = m[(i, i)].l1_norm() + m[(i - 1, i - 1)].l1_norm();
                let scale = if beside > 0.0 { beside } else { norm };
                m[(i, i - 1)].l1_norm() <= f64::EPSILON * scale
            })
            .unwrap_or(0);
        if first == last {
            found.push(m[(last, last)]);
            active -= 1;
            iterations = 0;
            continue;
        }
        if iterations == ITERATIONS_MAX {
            let size = m.nrows();
            return Err(EigenvalueError::NotConverged { size, iterations });
        }
        let shift = if iterations % 10 == 9 {
            m[(last, last)] + m[(last, last - 1)].norm()
        } else {
            let corner = m[(last, last)];
            let [p, q] = pair(&m, last - 1);
            if (p - corner).norm() < (q - corner).norm() {
                p
            } else {
                q
            }
        };
        sweep(&mut m, first, last, shift);
        iterations += 1;
    }
    Ok(found)
}

/// One QR step with a shift on the diagonal block of rows and columns `first..=last` of a Hessenberg matrix: this block
/// minus the shift, = Q R, is replaced by R Q + shift. Entries outside the block stay as they are, since only
/// eigenvalues are wanted.
fn sweep(m: &mut DMatrix<Complex64>, first: usize, last: usize, shift: Complex64) {
    for i in first..=last {
        m[(i, i)] -= shift;
    }
    let mut rotations = Vec::with_capacity(last - first);
    for k in first..last {
        let (a, b) = (m[(k, k)], m[(k + 1, k)]);
        let size = a.norm().hypot(b.norm());
        let (c, s) = if size > 0.0 {
            (a / size, b / size)
        } else {
            (Complex64::ONE, Complex64::ZERO)
        };
        for j in k..=last {
            let (x, y) = (m[(k, j)], m[(k + 1, j)]);
            m[(k, j)] = c.conj() * x + s.conj() * y;
            m[(k + 1, j)] = c * y - s * x;
        }
        rotations.push((c, s));
    }
    for (k, (c, s)) in (first..last).zip(rotations) {
        for i in first..=(k + 1).min(last) {
            let (x, y) = (m[(i, k)], m[(i, k + 1)]);
            m[(i, k)] = x * c + y * s;
            m[(i, k + 1)] = y * c.conj() - x * s.conj();
        }
    }
    for i in first..=last {
        m[(i, i)] += shift;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A matrix with known eigenvalues: a triangular one in another basis.
    fn known(values: &[Complex64]) -> DMatrix<Complex64> {
        let size = values.len();
        let triangular = DMatrix::from_fn(size, size, |i, j| {
            if i == j {
                values[i]
            } else if i < j {
                Complex64::new(0.1, 0.05) * values[j].norm()
            } else {
                Complex64::ZERO
            }
        });
        let basis = DMatrix::from_fn(size, size, |i, j| {
            Complex64::cis((i * j) as f64 * 2.0 * std::f64::consts::PI / size as f64)
        })
        .unscale((size as f64).sqrt());
        &basis * triangular * basis.adjoint()
    }

    fn worst(found: &[Complex64], expected: &[Complex64]) -> f64 {
        expected
            .iter()
            .map(|value| {
                found
                    .iter()
                    .map(|other| (other - value).norm())
                    .fold(f64::INFINITY, f64::min)
            })
            .fold(0.0, f64::max)
    }

    #[test]
    fn all_eigenvalues_of_small_matrices() {
        for size in 1..=12 {
            let values: Vec<_> = (0..size)
                .map(|i| Complex64::from_polar(1.0 + i as f64, 2.4 * i as f64))
                .collect();
            let found = of_complex(known(&values)).unwrap();
            assert_eq!(found.len(), size);
            // Condition of the eigenvalues: a few times the off-diagonal part.
            assert!(worst(&found, &values) < 1e-12 * size as f64, "{size}");
        }
    }

    #[test]
    fn a_cyclic_permutation_and_a_double_eigenvalue() {
        let cyclic = DMatrix::from_fn(5, 5, |i, j| Complex64::from(f64::from((i + 1) % 5 == j)));
        let roots: Vec<_> = (0..5)
            .map(|k| Complex64::cis(f64::from(k) * std::f64::consts::TAU / 5.0))
            .collect();
        assert!(worst(&of_complex(cyclic).unwrap(), &roots) < 1e-13);
        let zero = DMatrix::<Complex64>::zeros(4, 4);
        assert_eq!(of_complex(zero).unwrap(), vec![Complex64::ZERO; 4]);
        let mut infinite = DMatrix::<Complex64>::zeros(4, 4);
        infinite[(1, 2)].im = f64::INFINITY;
        assert!(of_complex(infinite).is_err());
    }

    #[test]
    fn the_largest_of_a_large_matrix() {
        // Falling as those of a loop over harmonics do, in pairs of nearly equal size.
        let values: Vec<_> = (0..90)
            .map(|i| Complex64::from_polar(1.0 / (1.0 + f64::from(i / 2)).powi(2), 1.1 * f64::from(i)))
            .collect();
        let floor = 1e-2;
        let found = dominant(&known(&values), floor).unwrap();
        let expected: Vec<_> = values.into_iter().filter(|value| value.norm() >= floor).collect();
        // A floor just below the largest: in a small Krylov space no eigenvalue reaches it.
        let slow: Vec<_> = (0..60)
            .map(|i| Complex64::from_polar(0.98_f64.powi(i), 2.4 * f64::from(i)))
            .collect();
        let largest = dominant(&known(&slow), 0.9999).unwrap();
        // The eigenvectors are about as far from orthogonal as those above.
        assert!(worst(&largest, &slow[..1]) < 1e-10, "{largest:?}");
        let relevant = found.iter().filter(|value| value.norm() >= floor).count();
        assert_eq!(relevant, expected.len());
        assert!(worst(&found, &expected) < 1e-10);
    }
}
