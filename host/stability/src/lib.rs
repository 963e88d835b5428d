//! Linear stability of milling: Floquet multipliers, stability limits, forced periodic orbits, lobe tables.
//!
//! A cut is stable where all Floquet multipliers (characteristic multipliers) μ of the delay equation
//!
//!   ẋ = A x + B F,   u = C x,   F = w K α(φ)(u − u_τ) − β(φ) u
//!
//! lie inside the unit circle. Here x are the states of the structure, F the cutting force, u the displacement of the
//! tool, w the axial depth, K the cutting coefficient K_tc, α the directional coefficients, φ the immersion angle, β
//! the coefficients of edge and feed forces under axial-depth modulation, and τ the tooth period. Without β a cut is
//! stable at a sufficiently small w if the structure is damped. Equation numbers in this crate are those of the thesis
//! *Chatter Vibrations in Robotic Milling Considering Structural Nonlinearity* (University of Victoria), from which the
//! cases `kuka-*` and `staubli-*` come. The default method collocates this equation over one tooth period, or over the
//! revolution for unequal pitch. All methods share the interface [`Method`].
//!
//! Main types: [`Problem`] is the linear delay equation of a case. A [`Method`] computes from it the stability of one
//! cut ([`CutStability`]) or all limits at one spindle speed ([`SpeedLine`]). [`chart()`] computes the limits at many
//! speeds, and [`lobe_table::build_table`] writes the table of the device.
//!
//! ```
//! use quietcut_model::case::Case;
//! use quietcut_stability::{Collocation, CubicTerms, Method, Problem, Verdict};
//!
//! let text = r#"
//! name = "one mode"
//!
//! [structure]
//! kind = "matrices"
//! directions = ["x"]
//! mass = [[0.0399]]
//! damping = [[5.516]]
//! stiffness = [[1.348e6]]
//!
//! [tool]
//! teeth = 2
//! edge_angle_deg = 90.0
//!
//! [material]
//! ktc_mpa = 600.0
//! krc_mpa = 200.0
//! kac_mpa = 0.0
//! kte_n_per_mm = 0.0
//! kre_n_per_mm = 0.0
//! kae_n_per_mm = 0.0
//!
//! [cut]
//! start_deg = 90.0
//! exit_deg = 180.0
//! feed_per_tooth_mm = 0.1
//! "#;
//! let case = Case::parse("one-mode.toml".as_ref(), text)?;
//! let method = Collocation {
//!     problem: Problem::new(&case, CubicTerms::Refuse)?,
//! };
//! let line = method.line(10_000.0, 5.0, 40)?;
//! let limit = line.first_limit.ok_or("stable up to 5 mm")?;
//! let below = method.point(10_000.0, 0.9 * limit.depth_mm)?;
//! assert_eq!(below.verdict, Verdict::Stable);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! Rooms, each of which uses only those above it:
//!
//! | room | content |
//! |---|---|
//! | `criteria`, `error` | thresholds of decisions; why stability cannot be computed |
//! | `process` | extensions of the case in the stability problem |
//! | `problem` | the linear delay problem: equation, tooth passages, meshes |
//! | `spectrum` | Floquet multipliers of a period map: Krylov, characteristic matrix, winding number, Floquet modes |
//! | `limits` | one cut, one speed, charts, cells, derivatives, spread; the interface [`Method`] |
//! | `frequency` | loops of receptances: characteristic loci, Nyquist counts |
//! | `methods` | one file per method |
//! | [`orbit`] | forced periodic orbits and their branches |
//! | [`cut_orbit`] | forced periodic orbits with loss of contact, and their derivatives |
//! | [`lobe_table`] | the table of the device |
//! | [`trial_cuts`] | predictions against tried cuts |
//! | [`rescaling`] | natural frequencies from the chatter frequencies of check cuts |
//!
//! `methods` uses `limits`, since [`Method`] returns limits; `frequency` is the mathematics that four methods share.
//! Tests across rooms, with a test oracle of Taylor series that shares no code with them, are in `tests`.
//!
//! This crate must not use recordings of vibration, simulation in time, identification or the command line. The only
//! file that it reads is a table of trial cuts.

mod criteria;
pub mod cut_orbit;
mod error;
mod frequency;
mod limits;
pub mod lobe_table;
mod methods;
pub mod orbit;
mod problem;
mod process;
pub mod rescaling;
mod spectrum;
pub mod trial_cuts;

pub use criteria::LEAST_ERROR;
pub use error::StabilityError;
pub use frequency::problem::FrequencyProblem;
pub use limits::cell::Cell;
pub use limits::cell_chart::{CellChart, CellLine, cell_chart};
pub use limits::chart::{Chart, Refinement, chart, counted_chart, first_limits};
pub use limits::line::line;
pub use limits::method::{Label, Method};
pub use limits::plane::{Linearized, Plane};
pub use limits::point::{CutStability, point};
pub use limits::resolution::Resolution;
pub use limits::sampling::{Basis, Variable};
pub use limits::sensitivity::{Sensitivity, Slope, Tangent};
pub use limits::speed_line::{Limit, SpeedLine, Switch};
pub use limits::speeds::{default_speeds, spaced};
pub use limits::spread::{LimitSpread, Percentile, Percentiles};
pub use limits::uncertainty::{MethodOfCase, Uncertainty};
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
pub use process::speed_dependence::depends_on_speed;
pub use process::treatment::needs_orbit;
pub use process::wear_and_drift::after;
pub use spectrum::stability_loss::StabilityLoss;
pub use spectrum::verdict::Verdict;

#[cfg(test)]
mod tests;
