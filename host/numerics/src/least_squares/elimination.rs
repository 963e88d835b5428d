//! Elimination of some parameters from a linear least-squares problem.

use nalgebra::DMatrix;

/// Least-squares equations for the parameters of the last columns of A = `matrix`, after elimination of the parameters
/// of its first `count` columns: the lower right block of the triangle R of A = Q R.
///
/// The parameters of the first columns may have any units. The remaining equations have the same solution and residual
/// as the whole problem. Several problems with common parameters are therefore solved together from their remaining
/// equations (Golub and Pereyra, SIAM J. Numer. Anal. 10 (1973) 413).
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
