//! Stability of the cut: multipliers, limits, their derivatives and spread, charts.
//!
//! Sign of the regenerative force: F = w K_tc α (u − u_τ), with α as in eq. 6.7, is stable at small depth w.

mod cells;
mod characteristic;
mod chart;
pub(crate) mod collocation;
pub mod continuation;
mod discretized;
mod eigenmotion;
mod element;
mod exponential;
pub(crate) mod extension;
mod fdm;
mod frequency;
pub(crate) mod gauss;
mod hessenberg;
mod krylov;
pub(crate) mod line;
pub mod lobe_table;
mod method;
pub(crate) mod multiplier;
mod one_period;
pub(crate) mod passages;
pub(crate) mod period;
pub(crate) mod period_map;
mod pitched;
mod plane;
pub(crate) mod point;
mod problem;
mod range;
mod revolution;
mod revolution_map;
pub(crate) mod revolution_mesh;
mod root;
pub mod sampling;
mod sdm;
mod sensitivity;
mod spectrum;
mod stepped;
pub mod test_cuts;
mod uncertainty;
mod variable_pitch;
mod winding;

pub use cells::{Cell, CellChart, CellLine, cell_chart};
pub use chart::{Chart, Refinement, chart};
pub use collocation::Collocation;
pub use extension::{after, needs_orbit};
pub use fdm::{Fdm, FullDiscretization};
pub use frequency::{FrequencyProblem, ModeCoupling, MultiFrequency, Nyquist, Zoa};
pub use line::{Limit, SpeedLine, Switch, line};
pub use method::{Label, Method};
pub use multiplier::{Kind, Verdict};
pub use pitched::Pitched;
pub use plane::{Linearized, Plane};
pub use point::{LEAST_ERROR, Point, point};
pub use problem::{CubicTerms, Problem, StabilityError};
pub use range::{default_speeds, spaced};
pub use sampling::Variable;
pub use sdm::{Sdm, SdmOrder, SemiDiscretization};
pub use sensitivity::{Sensitivity, Slope, Tangent};
pub use uncertainty::{LimitSpread, Maker, Percentile, Percentiles, Uncertainty};
pub use variable_pitch::RevolutionCollocation;

#[cfg(test)]
mod agreement;
#[cfg(test)]
mod cells_tests;
#[cfg(test)]
mod line_tests;
#[cfg(test)]
mod properties;
#[cfg(test)]
mod random_tests;
#[cfg(test)]
mod sensitivity_tests;
#[cfg(test)]
mod taylor;
#[cfg(test)]
mod tests;
#[cfg(test)]
mod uncertainty_tests;
#[cfg(test)]
mod variable_pitch_tests;
