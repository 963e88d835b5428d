//! Anderson acceleration of a fixed-point iteration z → G(z).
//!
//! The next z is Σ α_i G(z_i) over the last iterations, with Σ α_i = 1 and ‖Σ α_i (G(z_i) − z_i)‖ minimal. D. G.
//! Anderson, J. ACM 12 (1965) 547; H. F. Walker and P. Ni, SIAM J. Numer. Anal. 49 (2011) 1715.

use std::collections::VecDeque;

use nalgebra::{DMatrix, DVector};
use quietcut_numerics::least_squares::{MinimumNorm, Tolerance};

/// Singular values of the matrix of differences of residuals G(z) − z below this share of the largest are dropped as
/// rounding.
const RANK: f64 = 1e-10;

/// Last iterations of a fixed-point iteration, from which the next iterate is accelerated.
pub(super) struct Anderson {
    depth: usize,
    /// Residual G(z) − z and image G(z) of the last iterates z.
    rounds: VecDeque<(DVector<f64>, DVector<f64>)>,
}

impl Anderson {
    /// Acceleration from the last iteration and up to `depth` earlier ones.
    pub(super) fn new(depth: usize) -> Self {
        Self {
            depth,
            rounds: VecDeque::with_capacity(depth + 1),
        }
    }

    /// Next iterate z from the last iterate `at` and its image G(`at`) = `to`.
    pub(super) fn next(&mut self, at: &DVector<f64>, to: &DVector<f64>) -> DVector<f64> {
        let residual = to - at;
        self.rounds.push_back((residual.clone(), to.clone()));
        if self.rounds.len() > self.depth + 1 {
            self.rounds.pop_front();
        }
        let before = self.rounds.len() - 1;
        // The first step of the fixed-point iteration is halved, since some of the maps oscillate about their fixed
        // point.
        if before == 0 {
            return at + &residual * 0.5;
        }
        let differences = DMatrix::from_fn(residual.len(), before, |row, column| {
            residual[row] - self.rounds[column].0[row]
        });
        let Ok(equations) = MinimumNorm::new(differences, Tolerance::Relative(RANK)) else {
            return at + &residual * 0.5;
        };
        let mut next = to.clone();
        for (share, (_, earlier)) in equations.solve(&residual).iter().zip(&self.rounds) {
            next -= (to - earlier) * *share;
        }
        next
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_linear_map_that_diverges_by_itself_is_solved() {
        // Linear map z → A z + b with an eigenvalue of −1.5, which diverges without acceleration.
        let a = DMatrix::from_row_slice(3, 3, &[-1.5, 0.2, 0.0, 0.1, 0.4, 0.3, 0.0, 0.0, 0.9]);
        let b = DVector::from_vec(vec![1.0, -2.0, 0.5]);
        let exact = (DMatrix::identity(3, 3) - &a).lu().solve(&b).unwrap();
        let mut mixing = Anderson::new(5);
        let mut z = DVector::zeros(3);
        for _ in 0..8 {
            let to = &a * &z + &b;
            z = mixing.next(&z, &to);
        }
        assert!((z - exact).amax() < 1e-9);
    }
}
