//! Standard deviations of a least-squares solution, from the scatter of the solutions without one block of the rows.

use nalgebra::{DMatrix, DVector};
use quietcut_numerics::least_squares::invert_normal_equations;

/// Standard deviations of the least-squares solution θ of X·θ = y with X = `matrix` and the residual `left`, by the
/// delete-a-block jackknife (Shao and Wu, Annals of Statistics 17 (1989) 1176): s² = (g − 1)/g Σ (θ₋ⱼ − θ̄)², with the
/// solution θ₋ⱼ without block j of g contiguous blocks of rows, and the mean θ̄ of the θ₋ⱼ. g is at most `blocks`.
///
/// The residual may be correlated within a block, and may grow with the motion. The scatter contains an error of the
/// model that differs between the blocks. The blocks have about equal sums of the leverages xᵢ(XᵀX)⁻¹xᵢᵀ, so that each
/// holds the same share of the information: the first block of a free decay is short.
///
/// `None` if all rows, or all rows without one of the blocks, do not determine the solution.
pub(super) fn deviations(matrix: &DMatrix<f64>, left: &DVector<f64>, blocks: usize) -> Option<DVector<f64>> {
    let normal = matrix.tr_mul(matrix);
    let half = matrix * invert_normal_equations(&normal)?;
    let leverage: Vec<f64> = (0..matrix.nrows())
        .map(|row| half.row(row).dot(&matrix.row(row)))
        .collect();
    let share = leverage.iter().sum::<f64>() / blocks as f64;
    let (mut from, mut sum) = (0, 0.0);
    let mut changes: Vec<DVector<f64>> = Vec::new();
    for (row, leverage) in leverage.iter().enumerate() {
        sum += leverage;
        let is_last = row + 1 == matrix.nrows();
        let is_full = sum >= share * (changes.len() + 1) as f64 && changes.len() + 1 < blocks;
        if is_last || is_full {
            let part = matrix.rows(from, row + 1 - from);
            let gradient = part.tr_mul(&left.rows(from, row + 1 - from));
            // At θ the gradient of all rows is zero, so that the gradient of the other rows is the negative of that of
            // the block.
            let others = invert_normal_equations(&(&normal - part.tr_mul(&part)))?;
            changes.push(-(others * gradient));
            from = row + 1;
        }
    }
    let count = changes.len() as f64;
    let zero = DVector::zeros(matrix.ncols());
    let mean = changes.iter().fold(zero.clone(), |sum, change| sum + change) / count;
    let squares = changes
        .iter()
        .fold(zero, |sum, change| sum + (change - &mean).map(|x| x * x));
    Some(squares.map(|square| ((count - 1.0) / count * square).sqrt()))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// For a mean with blocks of one row each the jackknife is the textbook s/√n.
    #[test]
    fn of_a_mean_it_is_the_standard_error() {
        let values = [1.0, 4.0, 2.0, 8.0, 5.0, 7.0];
        let matrix = DMatrix::from_element(6, 1, 1.0);
        let mean = values.iter().sum::<f64>() / 6.0;
        let left = DVector::from_iterator(6, values.iter().map(|x| x - mean));
        let found = deviations(&matrix, &left, 6).unwrap()[0];
        let textbook = (left.norm_squared() / 5.0 / 6.0).sqrt();
        // Rounding.
        assert!((found / textbook - 1.0).abs() < 1e-12, "{found} {textbook}");
    }
}
