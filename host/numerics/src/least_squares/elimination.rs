//! Elimination of the parameters that are not wanted from a linear least-squares problem.

use nalgebra::DMatrix;

/// The equations of the last columns once the first `count` columns are eliminated: the block below and right of them in the
/// triangle R of A = Q R.
///
/// The first columns may have any units. The solution for the last columns is that of the whole problem, and so is its residual:
/// several problems that share parameters are solved together from their eliminated rows (Golub and Pereyra, SIAM J. Numer. Anal. 10
/// (1973) 413).
pub fn eliminated(mut matrix: DMatrix<f64>, count: usize) -> DMatrix<f64> {
    for mut column in matrix.column_iter_mut().take(count) {
        let length = column.norm();
        if length > 0.0 {
            column /= length;
        }
    }
    let triangle = matrix.qr().r();
    let first = count.min(triangle.nrows());
    triangle
        .view(
            (first, count),
            (triangle.nrows() - first, triangle.ncols() - count),
        )
        .into_owned()
}
