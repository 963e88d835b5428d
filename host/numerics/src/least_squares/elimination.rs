//! Elimination of some parameters from a linear least-squares problem.

use nalgebra::DMatrix;

/// Least-squares equations for the parameters of the last columns of A = `matrix`, after elimination of the parameters
/// of its first `count` columns: the lower right block of the triangle R of A = Q R. The right side of the problem may
/// be one of the last columns.
///
/// The parameters of the first columns may have any units. If these columns are linearly independent, the remaining
/// equations have the same solution for the other parameters, and the same sum of squared residuals, as the whole
/// problem. Several problems whose other parameters are common can therefore be solved together from their remaining
/// equations (Golub and Pereyra, SIAM J. Numer. Anal. 10 (1973) 413).
pub fn eliminated(mut matrix: DMatrix<f64>, count: usize) -> DMatrix<f64> {
    let count = count.min(matrix.ncols());
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
