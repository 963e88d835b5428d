//! The reason for which an iterative solver stopped.

/// The reason for which an iterative solver stopped; only [`Stop::Converged`] means that a solution is found.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Stop {
    /// The iteration has converged: its last step meets the criterion of convergence.
    Converged,
    /// No step that was tried from the last arguments, each with more damping, is accepted.
    Stagnated,
    /// The linear equations of a step are singular.
    Singular,
    /// The iteration has reached arguments for which the function is not valid or not finite.
    LeftDomain,
    /// The caller has given up the iteration before its end.
    GivenUp,
    /// The largest allowed number of iterations is reached without convergence.
    Iterations,
}
