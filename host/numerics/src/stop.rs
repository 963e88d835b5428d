//! The reason for which an iteration stopped.

/// The reason for which an iteration stopped; only [`Stop::Converged`] means that a solution is found.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Stop {
    /// The last step is below the tolerance.
    Converged,
    /// No step improves the solution, however short it is.
    Stagnated,
    /// The linear equations of a step are singular.
    Singular,
    /// The iteration has reached a point where the model is not valid or not finite.
    LeftDomain,
    /// The caller has given up the iteration.
    GivenUp,
    /// The largest number of iterations is reached.
    Iterations,
}
