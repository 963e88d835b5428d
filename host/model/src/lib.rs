//! The machine model: structure, tool, material and cut of one case, and the effects that may extend it.
//!
//! Main types: [`case::Case`] (the case file), [`structure::Structure`] (M, C, K matrices, complex modes or joints of a
//! robot), [`milling::Tool`], [`milling::Material`] and [`milling::Cut`], [`Dynamics`] (first-order equation of
//! motion, with cubic terms), [`Effects`] (deviations of machine, cut and sensors from the model of a case).
//!
//! "The thesis" in this crate is *Chatter Vibrations in Robotic Milling Considering Structural Nonlinearity*, a
//! doctoral thesis of the University of Victoria; its equation numbers are given as "thesis eq. 5.16".
//!
//! ```
//! use std::path::Path;
//!
//! use quietcut_model::case::Case;
//!
//! let text = r#"
//! [structure]
//! kind = "modes"
//! directions = ["y"]
//!
//! [[structure.mode]]
//! frequency_hz = 16.99
//! damping_ratio = 0.0285
//! left = [[-0.005147, 0.004861]]
//! right = [[-0.003921, 0.005505]]
//!
//! [tool]
//! teeth = 2
//! edge_angle_deg = 90.0
//!
//! [cut]
//! start_deg = 90.0
//! exit_deg = 180.0
//! feed_per_tooth_mm = 0.15
//! "#;
//! let case = Case::parse(Path::new("robot.toml"), text)?;
//! assert_eq!(case.name, "robot");
//! assert_eq!(case.tool()?.teeth, 2);
//! assert!(case.material().is_err(), "the case has no section [material]");
//! # Ok::<(), quietcut_model::case::CaseError>(())
//! ```
//!
//! This crate integrates no motion, computes no stability limit and estimates no parameter. The only files that it
//! reads are case files.

pub mod case;
mod criteria;
pub mod cutter;
pub mod cutting_load;
mod dynamics;
pub mod effects;
mod error;
mod force_law;
pub mod milling;
pub mod path;
pub mod restoring_force;
pub mod spindle;
pub mod structure;

pub use cutter::{Cutter, Tooth};
pub use cutting_load::CuttingLoad;
pub use dynamics::Dynamics;
pub use effects::{Effect, EffectError, Effects};
pub use error::ModelError;
pub use force_law::{ChipLaw, ForceLaw, ProcessDamping};
pub use milling::Immersion;
pub use restoring_force::{MotionState, Regime, RestoringForce, Slopes};
pub use spindle::{Fluctuation, Spindle};
