//! LU factors of a large dense matrix with partial pivoting, by recursion over its columns.
//!
//! Half of the columns are factored, the other half is reduced by a triangular solution and a product of matrices, and
//! factored in turn (Toledo, SIAM J. Matrix Anal. Appl. 18 (1997) 1065). Nearly all of the work are products of
//! matrices, which a processor does several times as fast as the updates by one column that nalgebra's `LU` consists of:
//! `benches/linear_algebra.rs`.

use nalgebra::{DMatrix, DMatrixView, DMatrixViewMut, Dyn, U1};

/// Columns of a block that is factored, and rows of a triangle that is solved, one by one.
const BLOCK: usize = 16;

type View<'a> = DMatrixViewMut<'a, f64, U1, Dyn>;

/// Factors P A = L U of a square matrix A, with the rows P exchanged so that no entry of L exceeds 1.
#[derive(Clone, Debug)]
pub struct Lu {
    /// L below the diagonal, whose own is 1, and U.
    factors: DMatrix<f64>,
    /// Row with which each row was exchanged, in turn.
    exchanged: Vec<usize>,
}

impl Lu {
    /// Factors a square matrix.
    ///
    /// # Panics
    /// The matrix is not square.
    pub fn new(matrix: DMatrix<f64>) -> Self {
        assert!(matrix.is_square(), "LU factors of a matrix that is not square");
        let mut factors = matrix;
        let mut exchanged = vec![0; factors.ncols()];
        factor(factors.as_view_mut(), &mut exchanged);
        Self { factors, exchanged }
    }

    /// True if no pivot is zero or not finite.
    pub fn is_regular(&self) -> bool {
        (0..self.factors.ncols()).all(|index| {
            let pivot = self.factors[(index, index)];
            pivot.is_finite() && pivot != 0.0
        })
    }

    /// Replaces the right-hand sides B, one in each column, by the solutions X of A X = B; false, with B lost, if the
    /// matrix is singular.
    pub fn solve_mut(&self, right: &mut DMatrix<f64>) -> bool {
        exchange(&mut right.as_view_mut(), &self.exchanged);
        lower(&self.factors.as_view(), right.as_view_mut());
        self.factors.solve_upper_triangular_mut(right)
    }
}

/// Applies exchanges of rows, in turn.
fn exchange(matrix: &mut View<'_>, exchanged: &[usize]) {
    for (row, other) in exchanged.iter().enumerate() {
        if row != *other {
            matrix.swap_rows(row, *other);
        }
    }
}

/// Factors a matrix with at least as many rows as columns; `exchanged` holds a place for each column.
fn factor(mut matrix: View<'_>, exchanged: &mut [usize]) {
    let count = matrix.ncols();
    if count <= BLOCK {
        return factor_one_by_one(matrix, exchanged);
    }
    let half = count / 2;
    let (first, last) = exchanged.split_at_mut(half);
    let (mut left, mut right) = matrix.columns_range_pair_mut(..half, half..);
    factor(left.as_view_mut(), first);
    exchange(&mut right, first);
    let (upper, mut below) = right.rows_range_pair_mut(..half, half..);
    let mut upper: View<'_> = upper;
    lower(&left.rows(0, half), upper.as_view_mut());
    below.gemm(-1.0, &left.rows_range(half..), &upper, 1.0);
    factor(below.as_view_mut(), last);
    exchange(&mut left.rows_range_mut(half..), last);
    for row in last {
        *row += half;
    }
}

fn factor_one_by_one(mut matrix: View<'_>, exchanged: &mut [usize]) {
    let count = matrix.ncols();
    for column in 0..count {
        let pivot = column + matrix.column(column).rows_range(column..).iamax();
        exchanged[column] = pivot;
        if pivot != column {
            matrix.swap_rows(column, pivot);
        }
        let diagonal = matrix[(column, column)];
        if diagonal == 0.0 {
            continue;
        }
        let (mut own, mut later) = matrix.columns_range_pair_mut(column, column + 1..);
        let mut below = own.rows_range_mut(column + 1..);
        below /= diagonal;
        for mut other in later.column_iter_mut() {
            let factor = other[column];
            if factor != 0.0 {
                other.rows_range_mut(column + 1..).axpy(-factor, &below, 1.0);
            }
        }
    }
}

/// Replaces B by L⁻¹ B, with the lower triangle L of `triangle`, whose diagonal is 1.
fn lower(triangle: &DMatrixView<'_, f64, U1, Dyn>, mut right: View<'_>) {
    let count = triangle.nrows();
    if count <= BLOCK {
        for mut column in right.column_iter_mut() {
            for row in 0..count {
                let value = column[row];
                if value != 0.0 {
                    let below = triangle.column(row);
                    column
                        .rows_range_mut(row + 1..)
                        .axpy(-value, &below.rows_range(row + 1..), 1.0);
                }
            }
        }
        return;
    }
    let half = count / 2;
    let (mut first, mut last) = right.rows_range_pair_mut(..half, half..);
    lower(&triangle.view((0, 0), (half, half)), first.as_view_mut());
    last.gemm(-1.0, &triangle.view((half, 0), (count - half, half)), &first, 1.0);
    lower(
        &triangle.view((half, half), (count - half, count - half)),
        last.as_view_mut(),
    );
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{RngExt, SeedableRng};

    #[test]
    fn solutions_are_those_of_nalgebra() {
        let seed = 11;
        let mut random = rand_chacha::ChaCha8Rng::seed_from_u64(seed);
        for size in [1, 2, 15, 16, 17, 40, 129, 300] {
            let mut matrix = DMatrix::from_fn(size, size, |_, _| random.random_range(-1.0..1.0));
            // Rows of very different size, a zero pivot to begin with.
            matrix.row_mut(size / 2).scale_mut(1e6);
            matrix[(0, 0)] = 0.0;
            if size == 1 {
                matrix[(0, 0)] = -3.0;
            }
            let right = DMatrix::from_fn(size, 3, |_, _| random.random_range(-1.0..1.0));
            let mut found = right.clone();
            let lu = Lu::new(matrix.clone());
            assert!(lu.is_regular(), "{size}");
            assert!(lu.solve_mut(&mut found));
            let exact = matrix.clone().lu().solve(&right).unwrap();
            let apart = (&found - &exact).amax() / exact.amax();
            assert!(apart < 1e-9, "size {size}, seed {seed}: {apart:.1e}");
            let left = (matrix * found - right).amax();
            assert!(left < 1e-7, "size {size}, seed {seed}: {left:.1e}");
        }
    }

    #[test]
    fn a_singular_matrix_is_seen() {
        let mut matrix = DMatrix::from_fn(40, 40, |row, column| ((row * 7 + column * 3) % 11) as f64);
        matrix.column_mut(17).fill(0.0);
        let lu = Lu::new(matrix);
        assert!(!lu.is_regular());
        assert!(!lu.solve_mut(&mut DMatrix::from_element(40, 1, 1.0)));
    }
}
