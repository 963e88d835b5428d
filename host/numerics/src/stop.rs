//! The reason for which an iteration stopped.

/// The reason for which an iteration stopped; only [`Stop::Converged`] is a solution to the tolerance.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Stop {
    /// The step is below the tolerance.
    Converged,
    /// No step, however short, is an improvement.
    Stagnated,
    /// The linear equations of a step are singular.
    Singular,
    /// The model does not hold, or is not finite, where the iteration is.
    LeftDomain,
    /// The caller gave up.
    GivenUp,
    /// The bound of the iterations is reached.
    Iterations,
}
