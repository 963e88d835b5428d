//! Stability of the cut: multipliers, limits, charts, lobe tables.
//!
//! Sign of the regenerative force: F = w K_tc α (u − u_τ), with α as in eq. 6.7, is stable at small depth w.

mod characteristic;
mod chart;
pub(crate) mod collocation;
mod eigenmotion;
mod element;
mod exponential;
mod frequency;
pub(crate) mod gauss;
mod line;
mod lobe_table;
mod method;
pub(crate) mod multiplier;
pub(crate) mod period;
mod point;
mod problem;
mod sensitivity;
mod spectrum;

pub use chart::{Chart, Refinement, chart, method_in_words};
pub use collocation::Collocation;
pub use frequency::{FrequencyProblem, ModeCoupling, MultiFrequency, Nyquist, Zoa};
pub use line::{Limit, SpeedLine, Switch, line};
pub use lobe_table::{BuildError, TableRequest, build_table};
pub use method::Method;
pub use multiplier::{Kind, Verdict};
pub use point::{LEAST_ERROR, Point, point};
pub use problem::{CubicTerms, Problem, StabilityError};
pub use sensitivity::{Sensitivity, Slope, Tangent};

#[cfg(test)]
mod sensitivity_tests;
#[cfg(test)]
mod tests;
