//! Stability of the cut: multipliers, limits, their derivatives and spread, charts.
//!
//! Sign of the regenerative force: F = w K_tc α (u − u_τ), with α as in eq. 6.7, is stable at small depth w.
//!
//! Rooms, each of which uses only those above it: `criteria` and `error`; `process` (extensions of the case); `problem`
//! (equation and meshes); `spectrum` (multipliers of a period map); `limits` (one speed, charts, derivatives, spread);
//! `frequency` (loops of receptances); `methods` (one file per method); [`orbit`] (forced periodic orbits);
//! [`lobe_table`]; [`trial_cuts`]. Tests across rooms are in `tests`.

mod criteria;
mod error;
mod frequency;
mod limits;
pub mod lobe_table;
mod methods;
pub mod orbit;
mod problem;
mod process;
mod spectrum;
pub mod trial_cuts;

pub use criteria::LEAST_ERROR;
pub use error::StabilityError;
pub use frequency::problem::FrequencyProblem;
pub use limits::cell::Cell;
pub use limits::cell_chart::{CellChart, CellLine, cell_chart};
pub use limits::chart::{Chart, Refinement, chart};
pub use limits::line::line;
pub use limits::method::{Label, Method};
pub use limits::plane::{Linearized, Plane};
pub use limits::point::{CutStability, point};
pub use limits::sampling::{Basis, Variable};
pub use limits::sensitivity::{Sensitivity, Slope, Tangent};
pub use limits::speed_line::{Limit, SpeedLine, Switch};
pub use limits::speeds::{default_speeds, spaced};
pub use limits::spread::{LimitSpread, Percentile, Percentiles};
pub use limits::uncertainty::{Maker, Uncertainty};
pub use methods::collocation::Collocation;
pub use methods::fdm::{Fdm, FullDiscretization};
pub use methods::mode_coupling::ModeCoupling;
pub use methods::multi_frequency::MultiFrequency;
pub use methods::nyquist::Nyquist;
pub use methods::revolution_collocation::RevolutionCollocation;
pub use methods::sdm::{Sdm, SdmOrder, SemiDiscretization};
pub use methods::zoa::Zoa;
pub use problem::linear::{CubicTerms, Problem};
pub use problem::pitched::Pitched;
pub use process::treatment::needs_orbit;
pub use process::wear_and_drift::after;
pub use spectrum::stability_loss::StabilityLoss;
pub use spectrum::verdict::Verdict;

#[cfg(test)]
mod tests;
