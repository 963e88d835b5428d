//! The reason for which an iterative solver stopped.

/// The reason for which an iterative solver stopped; only [`Stop::Converged`] means that the criterion of convergence
/// is met.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Stop {
    /// The iteration has converged: its last step meets the criterion of convergence.
    Converged,
    /// None of the dampings that were tried from the last arguments gives a step that is accepted.
    Stagnated,
    /// The linear equations of a step are singular, or their solution is not finite.
    Singular,
    /// The iteration has reached arguments outside the allowed range, or at which the function or the step cannot be
    /// computed or is not finite.
    LeftDomain,
    /// The caller has given up the iteration before its end.
    GivenUp,
    /// The largest allowed number of iterations is reached without convergence.
    Iterations,
}
