//! Largest eigenvalues of a linear map that is given by its action on vectors (block Arnoldi).
//!
//! Period maps of delay equations are compact: all but a few eigenvalues lie close to zero, and block Arnoldi finds
//! those few in a space of some dozens of vectors. Blocks also resolve repeated eigenvalues of structures with equal
//! modes; a single starting vector would find only one of them.

use nalgebra::{DMatrix, DVector};
use num_complex::Complex64;

use super::hessenberg::Shifted;
use crate::criteria::{CROWD, KRYLOV_ANY};
use crate::error::Breakdown;
use quietcut_numerics::eigenvalues::{self, EigenvalueError, eigenvector};

/// Number of vectors in a block: repeated eigenvalues are found up to this multiplicity, one for each direction in
/// space.
const BLOCK: usize = 3;

/// Largest dimension of a map for which all eigenvalues are computed from its matrix without trying block Arnoldi,
/// which is not faster there.
const WHOLE: usize = 90;

/// Number of blocks after which eigenvalues are computed for the first time, unless the space is full before. They are
/// computed again whenever the space has grown by a third, and at least by this number of blocks. A choice.
const BLOCKS_BEFORE_EIGENVALUES: usize = 10;

/// Residual ‖M v − μ v‖ with ‖v‖ = 1, relative to max(1, |μ|), below which an eigenvalue is accepted: rounding of a map
/// of some hundred steps.
const RESIDUAL: f64 = 1e-11;

/// Residual ‖M v − μ v‖ with ‖v‖ = 1, relative to max(1, |μ|), below which an eigenvalue is accepted as a starting
/// value of Newton's method.
const ROUGH: f64 = 1e-7;

/// Largest number of vectors of a Krylov space. One eigenvalue computation then takes one or two seconds; maps that
/// need more have many eigenvalues of nearly one size.
const SPACE_MAX: usize = 480;

/// Largest number of vectors of a Krylov space where the search by winding number replaces block Arnoldi if that does
/// not converge.
const ROUGH_SPACE_MAX: usize = 240;

/// Largest dimension n of a map of which all eigenvalues are computed: about 10 n³ operations, some ten seconds.
pub(crate) const WHOLE_MAX: usize = 1200;

/// Norm of a vector after orthogonalization, relative to the norm of its block before, up to which it counts as
/// linearly dependent: rounding of a map of some hundred steps, far below any residual used.
const DEPENDENT: f64 = 1e-14;

/// Linear map of ℝⁿ, given by its action on vectors.
pub(crate) trait LinearMap {
    /// Dimension n.
    fn size(&self) -> usize;

    /// Image of each column, n × columns; `None` if the equations have no solution or the image is not finite.
    fn apply(&self, columns: &DMatrix<f64>) -> Option<DMatrix<f64>>;
}

/// Selected largest eigenvalues of a linear map, largest first, with a subspace that contains their eigenvectors.
#[derive(Clone, Debug)]
pub(crate) struct Dominant {
    /// Eigenvalues of the map; complex ones in exact conjugate pairs, unless [`CROWD`] cuts off the lower one of the
    /// last pair.
    pub(crate) eigenvalues: Vec<Complex64>,
    /// Orthonormal basis of the subspace, by columns; `None` for the whole space.
    basis: Option<DMatrix<f64>>,
    /// Matrix of the linear map projected on the subspace.
    projected: DMatrix<f64>,
}

impl Dominant {
    /// All eigenvalues of a linear map with |μ| larger than `least`.
    ///
    /// # Errors
    /// The map gives no image, a result is not finite, the eigenvalues cannot be computed, or the map is large and
    /// block Arnoldi does not converge.
    pub(crate) fn of(map: &impl LinearMap, least: f64) -> Result<Self, Breakdown> {
        Self::kept(map, &|values| values.retain(|value| value.norm() > least))
    }

    /// All eigenvalues of a linear map with |μ| larger than [`KRYLOV_ANY`]. If there is none, those of at least half
    /// the size of the largest, at most [`CROWD`] of them.
    ///
    /// # Errors
    /// As [`of`](Self::of).
    pub(crate) fn any(map: &impl LinearMap) -> Result<Self, Breakdown> {
        Self::kept(map, &|values| {
            let largest = values.first().map_or(0.0, |value| value.norm());
            if largest > KRYLOV_ANY {
                values.retain(|value| value.norm() > KRYLOV_ANY);
            } else {
                values.retain(|value| value.norm() >= 0.5 * largest);
                values.truncate(CROWD);
            }
        })
    }

    fn kept(map: &impl LinearMap, keep: &dyn Fn(&mut Vec<Complex64>)) -> Result<Self, Breakdown> {
        // A Krylov space of more than half the map's dimension costs more than all eigenvalues of the map's matrix.
        let most = (map.size() / 2).min(SPACE_MAX);
        if map.size() > WHOLE
            && let Ok(found) = arnoldi(map, most, RESIDUAL, keep)
            && found.is_settled
        {
            return Ok(found.dominant);
        }
        if map.size() > WHOLE_MAX {
            return Err(Breakdown::TooManyMultipliers);
        }
        let projected = map
            .apply(&DMatrix::identity(map.size(), map.size()))
            .ok_or(Breakdown::NoSolution)?;
        let mut eigenvalues = larger(&projected, 0.0)?;
        keep(&mut eigenvalues);
        Ok(Self {
            eigenvalues,
            basis: None,
            projected,
        })
    }

    /// Right eigenvector, of length 1, that belongs to one of the eigenvalues; `None` if it cannot be computed.
    pub(crate) fn vector(&self, eigenvalue: Complex64) -> Option<DVector<Complex64>> {
        let within = eigenvector(&self.projected.map(Complex64::from), eigenvalue)?;
        Some(match &self.basis {
            Some(basis) => basis.map(Complex64::from) * within,
            None => within,
        })
    }
}

/// Approximate largest eigenvalues of a linear map, largest first, as starting values of Newton's method.
#[derive(Clone, Debug)]
pub(crate) struct Largest {
    /// Eigenvalues of the map, with a residual of about 1e-7 if they have converged.
    pub(crate) eigenvalues: Vec<Complex64>,
    /// False if block Arnoldi did not converge, so that larger eigenvalues may be missing.
    pub(crate) is_settled: bool,
    /// Largest entry of the map's projection on the Krylov space.
    pub(crate) norm: f64,
}

/// Eigenvalues of a linear map of at least `share` times the size of the largest, at most [`CROWD`] of them.
///
/// # Errors
/// The map gives no image, a result is not finite, or the eigenvalues cannot be computed.
pub(crate) fn largest(map: &impl LinearMap, share: f64) -> Result<Largest, Breakdown> {
    let most = (map.size() / 2).min(ROUGH_SPACE_MAX);
    let found = arnoldi(map, most, ROUGH, &|values| {
        let largest = values.first().map_or(0.0, |value| value.norm());
        values.retain(|value| value.norm() >= share * largest);
        values.truncate(CROWD);
    })?;
    Ok(Largest {
        norm: found.dominant.projected.amax(),
        eigenvalues: found.dominant.eigenvalues,
        is_settled: found.is_settled,
    })
}

/// Eigenvalues of a linear map larger than `least`, or larger than `share` times the largest if that is less; largest
/// first, with a relative residual of about 1e-7.
///
/// `None` if block Arnoldi does not converge in a space of half the dimension or of [`SPACE_MAX`] vectors, or if it
/// fails.
pub(crate) fn larger_than(map: &impl LinearMap, least: f64, share: f64) -> Option<Vec<Complex64>> {
    let most = (map.size() / 2).min(SPACE_MAX);
    let found = arnoldi(map, most, ROUGH, &|values| {
        let largest = values.first().map_or(0.0, |value| value.norm());
        values.retain(|value| value.norm() > least.min(share * largest));
    })
    .ok()?;
    found.is_settled.then_some(found.dominant.eigenvalues)
}

/// Eigenvalues and Krylov space from block Arnoldi; `is_settled` is false if the eigenvalues have not converged.
struct ArnoldiResult {
    dominant: Dominant,
    is_settled: bool,
}

/// Block Arnoldi with full orthogonalization. It stops once the eigenvalues selected by `keep` (from all, largest
/// first) have converged, once the map gives no new direction, or once the space would exceed `most` vectors.
///
/// # Errors
/// The map gives no image, a result is not finite, or the eigenvalues cannot be computed.
fn arnoldi(
    map: &impl LinearMap,
    most: usize,
    residual: f64,
    keep: &dyn Fn(&mut Vec<Complex64>),
) -> Result<ArnoldiResult, Breakdown> {
    let size = map.size();
    // Arnoldi relation M V = V H + W K: V the blocks so far, W the next block, K in the lower rows of H.
    let mut room = most.min(4 * BLOCKS_BEFORE_EIGENVALUES * BLOCK);
    let mut basis = DMatrix::zeros(size, room + BLOCK);
    let mut projected = DMatrix::zeros(room + BLOCK, room);
    let first = start(size);
    let scale = first.norm();
    let (first, _) = orthonormal(first, scale);
    basis.columns_mut(0, first.ncols()).copy_from(&first);
    let (mut done, mut width) = (0, first.ncols());
    let mut next_eigenvalues = BLOCKS_BEFORE_EIGENVALUES;
    for count in 1.. {
        if done + width > room {
            // Storage of the Krylov space grows by doubling. Filling the largest storage at once would take longer than
            // most maps need in all.
            room = most.min(2 * room);
            basis = basis.resize_horizontally(room + BLOCK, 0.0);
            projected = projected.resize(room + BLOCK, room, 0.0);
        }
        let mut image = map
            .apply(&basis.columns(done, width).into_owned())
            .ok_or(Breakdown::NoSolution)?;
        let scale = image.norm();
        let known = basis.columns(0, done + width);
        // Two passes of orthogonalization suffice: after the first only rounding of the image lies in the space.
        for _ in 0..2 {
            let part = known.tr_mul(&image);
            image -= known * &part;
            let mut sum = projected.view_mut((0, done), (done + width, width));
            sum += part;
        }
        let (next, coupling) = orthonormal(image, scale);
        let end = done + width;
        projected
            .view_mut((end, done), (next.ncols(), width))
            .copy_from(&coupling);
        basis.columns_mut(end, next.ncols()).copy_from(&next);
        let is_full = next.ncols() == 0 || end + next.ncols() > most;
        if is_full || count == next_eigenvalues {
            next_eigenvalues += BLOCKS_BEFORE_EIGENVALUES.max(next_eigenvalues / 3);
            let within = projected.view((0, 0), (end, end)).into_owned();
            let mut eigenvalues = larger(&within, 0.0)?;
            keep(&mut eigenvalues);
            let is_settled = are_settled(&within, &coupling, &eigenvalues, residual);
            if is_settled || is_full {
                let dominant = Dominant {
                    eigenvalues,
                    basis: Some(basis.columns(0, end).into_owned()),
                    projected: within,
                };
                return Ok(ArnoldiResult { dominant, is_settled });
            }
        }
        (done, width) = (end, next.ncols());
    }
    Err(Breakdown::NoSolution)
}

/// True if every one of the `eigenvalues` μ has a small residual ‖M v − μ v‖ = ‖K y‖, with K the coupling to the next
/// block and y the last block of the eigenvector of the projected matrix.
///
/// Eigenvalues not larger than the allowed `residual` count as converged: compact maps have many of them near zero.
fn are_settled(
    projected: &DMatrix<f64>,
    coupling: &DMatrix<f64>,
    eigenvalues: &[Complex64],
    residual: f64,
) -> bool {
    let coupling = coupling.map(Complex64::from);
    let width = coupling.ncols();
    let mut of_interest = eigenvalues
        .iter()
        .filter(|value| value.im >= 0.0 && value.norm() > residual);
    of_interest.all(|&value| {
        // The blocks below the diagonal are triangular: the matrix has `BLOCK` diagonals below the main one.
        Shifted::new(projected, BLOCK, value)
            .right()
            .is_some_and(|vector| {
                let last = vector.rows(vector.len() - width, width);
                (&coupling * last).norm() < residual * value.norm().max(1.0)
            })
    })
}

/// Eigenvalues of a matrix with absolute value above `least`, largest first; of a conjugate pair the upper one first.
fn larger(matrix: &DMatrix<f64>, least: f64) -> Result<Vec<Complex64>, EigenvalueError> {
    let mut values = eigenvalues::of_real(matrix.clone())?;
    values.retain(|value| value.norm() > least);
    values.sort_by(|p, q| q.norm().total_cmp(&p.norm()).then(q.im.total_cmp(&p.im)));
    Ok(values)
}

/// Starting block of block Arnoldi: the same at every call, with components along all directions.
fn start(size: usize) -> DMatrix<f64> {
    // Entries are Weyl sequences, multiples of irrational numbers modulo one, which are spread evenly.
    let irrational = [2.0_f64.sqrt(), 3.0_f64.sqrt(), 5.0_f64.sqrt()];
    DMatrix::from_fn(size, BLOCK, |i, j| ((i + 1) as f64 * irrational[j]).fract() - 0.5)
}

/// QR factors of a block; Q omits columns that depend on those before. `scale` is the norm of the block before
/// orthogonalization: columns that orthogonalization reduces below its rounding count as zero.
fn orthonormal(block: DMatrix<f64>, scale: f64) -> (DMatrix<f64>, DMatrix<f64>) {
    let columns = block.ncols();
    let mut kept: Vec<DVector<f64>> = Vec::with_capacity(columns);
    let mut factor = DMatrix::zeros(columns, columns);
    for j in 0..columns {
        let mut column = block.column(j).into_owned();
        for _ in 0..2 {
            for (i, earlier) in kept.iter().enumerate() {
                let part = earlier.dot(&column);
                factor[(i, j)] += part;
                column.axpy(-part, earlier, 1.0);
            }
        }
        let norm = column.norm();
        if norm > DEPENDENT * scale {
            factor[(kept.len(), j)] = norm;
            kept.push(column / norm);
        }
    }
    let rank = kept.len();
    let basis = if kept.is_empty() {
        DMatrix::zeros(block.nrows(), 0)
    } else {
        DMatrix::from_columns(&kept)
    };
    (basis, factor.rows(0, rank).into_owned())
}

#[cfg(test)]
mod tests {
    use super::*;

    struct Matrix(DMatrix<f64>);

    impl LinearMap for Matrix {
        fn size(&self) -> usize {
            self.0.nrows()
        }

        fn apply(&self, columns: &DMatrix<f64>) -> Option<DMatrix<f64>> {
            Some(&self.0 * columns)
        }
    }

    /// Test matrix with a conjugate pair, a double and a negative eigenvalue outside a cluster of small ones, in
    /// rotated axes.
    fn matrix(size: usize) -> Matrix {
        let mut matrix = DMatrix::from_fn(size, size, |i, j| {
            if i == j {
                0.2 * ((i + 1) as f64 * 0.618).fract()
            } else {
                0.0
            }
        });
        for (index, value) in [(0, 0.5), (1, 0.5), (2, 0.9), (3, 0.9), (4, -1.1)] {
            matrix[(index, index)] = value;
        }
        (matrix[(0, 1)], matrix[(1, 0)]) = (0.8, -0.8);
        for k in 1..4_u32 {
            let normal =
                DVector::from_fn(size, |i, _| ((i + 1) as f64 * f64::from(k).sqrt()).sin()).normalize();
            let reflection = DMatrix::identity(size, size) - &normal * normal.transpose() * 2.0;
            matrix = &reflection * matrix * &reflection;
        }
        Matrix(matrix)
    }

    #[test]
    fn few_large_eigenvalues_are_found_with_their_vectors_in_small_and_large_maps() {
        for size in [40, 300] {
            let map = matrix(size);
            let found = Dominant::of(&map, 0.3).unwrap();
            assert_eq!(found.basis.is_some(), size == 300);
            let expected = [(-1.1, 0.0), (0.5, 0.8), (0.5, -0.8), (0.9, 0.0), (0.9, 0.0)];
            assert_eq!(found.eigenvalues.len(), expected.len());
            for (value, (re, im)) in found.eigenvalues.iter().zip(expected) {
                // Tolerance: the matrix is normal, so that eigenvalues are as accurate as the residual 1e-11.
                assert!((value - Complex64::new(re, im)).norm() < 1e-10, "{found:?}");
                let vector = found.vector(*value).unwrap();
                let miss = map.0.map(Complex64::from) * &vector - &vector * *value;
                assert!(miss.norm() < 1e-9 && (vector.norm() - 1.0).abs() < 1e-12);
            }
        }
    }
    /// Map of rank 4, like that of a structure in free flight, which counts the vectors it is applied to.
    struct Thin {
        within: DMatrix<f64>,
        directions: DMatrix<f64>,
        applied: std::cell::Cell<usize>,
    }

    impl LinearMap for Thin {
        fn size(&self) -> usize {
            self.directions.nrows()
        }

        fn apply(&self, columns: &DMatrix<f64>) -> Option<DMatrix<f64>> {
            self.applied.set(self.applied.get() + columns.ncols());
            Some(&self.directions * (&self.within * self.directions.tr_mul(columns)))
        }
    }

    #[test]
    fn the_space_of_a_map_of_low_rank_closes_early() {
        let size = 1000;
        let (directions, _) = orthonormal(
            DMatrix::from_fn(size, 4, |i, j| ((i + 1) as f64 * (j as f64 + 2.3).sqrt()).sin()),
            size as f64,
        );
        // A double conjugate pair: two equal modes.
        let (re, im) = (0.6, -0.3);
        let within = DMatrix::from_row_slice(
            4,
            4,
            &[
                re, im, 0.0, 0.0, -im, re, 0.0, 0.0, 0.0, 0.0, re, im, 0.0, 0.0, -im, re,
            ],
        );
        let map = Thin {
            within,
            directions,
            applied: std::cell::Cell::new(0),
        };
        let found = Dominant::of(&map, 0.3).unwrap();
        // Cost: the first block, plus the images needed to fill four dimensions.
        assert!(map.applied.get() <= 3 * BLOCK, "{}", map.applied.get());
        assert_eq!(found.eigenvalues.len(), 4);
        for value in &found.eigenvalues {
            let error = (value - Complex64::new(re, im.abs().copysign(value.im))).norm();
            assert!(error < 1e-12, "{found:?}");
            let vector = found.vector(*value).unwrap();
            let miss = map.apply(&DMatrix::from_columns(&[
                vector.map(|v| v.re),
                vector.map(|v| v.im),
            ]));
            let miss = miss.unwrap();
            let complex =
                miss.column(0).map(Complex64::from) + miss.column(1).map(|v| Complex64::new(0.0, v));
            assert!((complex - vector * *value).norm() < 1e-9);
        }
    }
}
