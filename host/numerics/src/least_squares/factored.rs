//! The pivoted QR decomposition of a matrix with scaled columns, for one or more right sides.

use nalgebra::{ColPivQR, DMatrix, DVector, Dyn};

use super::LeastSquaresError;

/// Absolute value of a pivot of the QR decomposition, relative to the first pivot, up to which it counts as zero, so
/// that the data do not determine its parameter. Rounding errors of 2e-16 in some thousand rows of scaled columns give
/// pivots below 1e-12.
const RANK_TOLERANCE: f64 = 1e-12;

/// Decomposition A D P = Q R of a matrix A, where D scales each column to length 1 and P orders the columns by their
/// pivots.
#[derive(Clone, Debug)]
pub(super) struct Factored {
    decomposed: ColPivQR<f64, Dyn, Dyn>,
    triangle: DMatrix<f64>,
    /// Lengths of the columns of A, the inverse of the diagonal of D.
    lengths: DVector<f64>,
    /// Indices of the columns of A in the order of their pivots.
    order: Vec<usize>,
}

impl Factored {
    /// Decomposes a matrix of m × n finite entries with n > 0.
    ///
    /// # Errors
    /// The rank of the matrix, as determined with [`RANK_TOLERANCE`], is below n.
    pub(super) fn new(mut matrix: DMatrix<f64>) -> Result<Self, LeastSquaresError> {
        let (rows, parameters) = matrix.shape();
        let lengths = DVector::from_iterator(parameters, matrix.column_iter().map(|column| column.norm()));
        let empty: Vec<usize> = (0..parameters).filter(|&j| lengths[j] <= 0.0).collect();
        if !empty.is_empty() || rows < parameters {
            return Err(LeastSquaresError::RankDeficient {
                rank: rows.min(parameters - empty.len()),
                parameters,
                undetermined: empty,
            });
        }
        for (mut column, length) in matrix.column_iter_mut().zip(lengths.iter()) {
            column /= *length;
        }
        let decomposed = ColPivQR::new(matrix);
        let triangle = decomposed.r();
        let mut order = nalgebra::RowDVector::from_fn(parameters, |_, j| j);
        decomposed.p().permute_columns(&mut order);
        let order: Vec<usize> = order.iter().copied().collect();
        let pivots = triangle.diagonal().abs();
        let rank = pivots
            .iter()
            .take_while(|pivot| **pivot > RANK_TOLERANCE * pivots[0])
            .count();
        if rank < parameters {
            return Err(LeastSquaresError::RankDeficient {
                rank,
                parameters,
                undetermined: order[rank..].to_vec(),
            });
        }
        Ok(Self {
            decomposed,
            triangle,
            lengths,
            order,
        })
    }

    /// Solution x with the least ‖A x − b‖² for b = `right`.
    pub(super) fn solve(&self, mut right: DVector<f64>) -> DVector<f64> {
        let parameters = self.order.len();
        self.decomposed.q_tr_mul(&mut right);
        let mut head = right.rows(0, parameters).into_owned();
        // The triangle R is regular: no pivot is zero, since `new` has checked the rank.
        self.triangle.solve_upper_triangular_mut(&mut head);
        let mut x = DVector::zeros(parameters);
        for (value, &index) in head.iter().zip(&self.order) {
            x[index] = value / self.lengths[index];
        }
        x
    }

    /// Covariance of the solution x for independent noise of variance 1 in b: (AᵀA)⁻¹ = D P R⁻¹ R⁻ᵀ Pᵀ D.
    pub(super) fn covariance(&self) -> DMatrix<f64> {
        let parameters = self.order.len();
        let mut inverse = DMatrix::identity(parameters, parameters);
        self.triangle.solve_upper_triangular_mut(&mut inverse);
        let permuted = &inverse * inverse.transpose();
        let mut covariance = DMatrix::zeros(parameters, parameters);
        for (i, &row) in self.order.iter().enumerate() {
            for (j, &column) in self.order.iter().enumerate() {
                covariance[(row, column)] = permuted[(i, j)] / (self.lengths[row] * self.lengths[column]);
            }
        }
        covariance
    }

    /// Absolute value of the first pivot of the QR decomposition divided by that of the last one, an estimate of the
    /// condition number of A with columns of length 1.
    pub(super) fn condition(&self) -> f64 {
        let last = self.order.len() - 1;
        (self.triangle[(0, 0)] / self.triangle[(last, last)]).abs()
    }
}
