//! Least squares: linear, from normal equations, and nonlinear.
//!
//! | problem | entry | method |
//! |---|---|---|
//! | min ‖√W (A x − b)‖² + ‖√P (x − x₀)‖² | [`LinearProblem`] | column scaling, Householder QR with column pivoting |
//! | min ‖x‖ of all x of least ‖A x − b‖ | [`MinimumNorm`] | singular value decomposition |
//! | min ‖A x + B y − b‖² without x | [`eliminated`] | column scaling, Householder QR |
//! | AᴴA x = Aᴴb that was summed | [`NormalEquations`] | diagonal scaling, Cholesky |
//! | min ‖r(θ)‖² | [`LevenbergMarquardt`] | Levenberg–Marquardt with the reason to stop |
//!
//! The columns of the matrix are scaled to length 1 first, since the parameters of one fit differ by many powers of
//! ten. The rank is therefore independent of the units of the parameters. [`MinimumNorm`], and [`eliminated`] for y,
//! take the columns as they are.

mod elimination;
mod factored;
mod levenberg_marquardt;
mod linear;
mod minimum_norm;
mod normal_equations;

pub use elimination::eliminated;
pub use levenberg_marquardt::{Damping, LevenbergMarquardt, Minimum, NormalSums, Objective};
pub use linear::{LinearFit, LinearProblem};
pub use minimum_norm::{MinimumNorm, Tolerance};
pub use normal_equations::{Idle, NormalEquations, invert_normal_equations, solve_normal_equations};

/// Error of a least-squares problem.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum LeastSquaresError {
    /// The number of entries of the right side, the weights or the prior does not fit the matrix.
    #[error("{what} has {found} entries instead of {expected}")]
    Shape {
        /// Name of the vector with the wrong number of entries.
        what: &'static str,
        /// Number of entries that the vector has.
        found: usize,
        /// Number of entries that the vector should have.
        expected: usize,
    },
    /// An entry of the matrix or of a vector is infinite or not a number, or a weight or an inverse variance of the
    /// prior is negative.
    #[error("{what} has an entry that is not finite; check the data for gaps, overflow and division by zero")]
    NotFinite {
        /// Name of the vector or matrix with the entry.
        what: &'static str,
    },
    /// The data do not determine all parameters.
    #[error(
        "the data determine {rank} of {parameters} parameters; record data of another kind, or leave out the parameters with the indices {undetermined:?}"
    )]
    RankDeficient {
        /// Number of linearly independent columns; an upper bound if a column is zero or the rows are fewer than the
        /// columns.
        rank: usize,
        /// Number of columns.
        parameters: usize,
        /// Indices, from 0, of the columns that are zero; without such, of those that depend linearly on the others, as
        /// column pivoting selects them. Empty if the rows are fewer than the columns and no column is zero.
        undetermined: Vec<usize>,
    },
}

#[cfg(test)]
mod tests;
