//! Reasons why a curve of stability losses is not followed.

use super::super::parameter::Parameter;
use crate::spectrum::stability_loss::StabilityLoss;

/// Reason why a curve is not followed.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum CurveError {
    /// The problem has a feature that the extended system does not cover.
    #[error("curves over two parameters do not cover {what}")]
    NotCovered {
        /// The feature, and what to do instead.
        what: &'static str,
    },
    /// Both parameters of the plane are the same.
    #[error("both parameters of the plane are {}; two different ones are needed", .parameter.name())]
    SameParameter {
        /// The parameter.
        parameter: Parameter,
    },
    /// The stability loss at which the curve is to begin does not satisfy the extended system.
    #[error(
        "the {} at {value} is no regular point of a curve in this plane; begin at another value of the second parameter", .kind.name()
    )]
    NoStart {
        /// Kind of the stability loss.
        kind: StabilityLoss,
        /// Value of the first parameter there, in the unit of results.
        value: f64,
    },
    /// The orbits of the curve cannot be recorded.
    #[error("the orbits of the curve cannot be recorded: {reason}")]
    Journal {
        /// Reason from the journal.
        reason: String,
    },
}
