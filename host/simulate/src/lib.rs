//! Time-domain simulation: the delay differential equations of milling integrated in time, test rigs, and the sensors
//! that record them.
//!
//! The equations are those of thesis chapters 3 and 6. Entry and exit of the teeth are not smoothed: a tooth enters and
//! leaves exactly at its angles. In a [`VirtualCut`] the chip thickness follows from the surface that all earlier tooth
//! passings left (thesis eqs 6.20 to 6.27), and a tooth that does not reach the surface has no force.
//!
//! Main types: [`VirtualCut`] describes a cut of a case, [`Model`] is its equation of motion, [`DenseStep`] the motion
//! over one step with dense output, [`rig::Rig`] a test with shaker, hammer or free decay, [`Recorder`] the recording
//! of a cut.
//!
//! "The thesis" in this crate is *Chatter Vibrations in Robotic Milling Considering Structural Nonlinearity*, a
//! doctoral thesis of the University of Victoria; its equation numbers are given as "thesis eq. 5.16".
//!
//! ```
//! use std::path::Path;
//!
//! use quietcut_model::case::Case;
//! use quietcut_simulate::{Settings, VirtualCut, Workspace};
//!
//! let text = r#"
//! [structure]
//! kind = "modes"
//! directions = ["y"]
//! [[structure.mode]]
//! frequency_hz = 16.99
//! damping_ratio = 0.0285
//! left = [[-0.005147, 0.004861]]
//! right = [[-0.003921, 0.005505]]
//! [tool]
//! teeth = 2
//! edge_angle_deg = 90.0
//! diameter_mm = 12.7
//! [material]
//! ktc_mpa = 119.0
//! krc_mpa = 20.23
//! kac_mpa = 39.27
//! kte_n_per_mm = 0.0
//! kre_n_per_mm = 0.0
//! kae_n_per_mm = 0.0
//! [cut]
//! start_deg = 90.0
//! exit_deg = 180.0
//! feed_per_tooth_mm = 0.15
//! "#;
//! let case = Case::parse(Path::new("robot.toml"), text)?;
//! let model = VirtualCut::new(900.0, 1.0, 4.0).model(&case)?;
//! let mut workspace = Workspace::new(&model);
//! let mut largest_m: f64 = 0.0;
//! model.run(4.0, Settings::default(), |step| {
//!     let motion = step.motion(step.to_s(), &mut workspace);
//!     largest_m = largest_m.max(motion.displacement_m[1].abs());
//! })?;
//! assert!(largest_m > 1e-6 && largest_m < 1e-2);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! This crate computes no stability limit, estimates no parameter and uses no table of receptances.

mod anti_aliasing;
mod contact;
mod criteria;
mod cutting;
mod dense_step;
mod drive;
mod error;
mod integrator;
mod model;
mod pores;
mod reading;
mod record;
pub mod rig;
mod run;
mod section_filter;
mod sensor;
mod settings;
mod surface;
mod virtual_cut;
mod workpiece_traverse;

#[cfg(test)]
pub(crate) mod tests;

pub use quietcut_model::effects::{self as effect, Effect, EffectError, Effects};
pub use quietcut_model::{
    ChipLaw, Cutter, Dynamics, Fluctuation, ForceLaw, Immersion, ModelError, MotionState, ProcessDamping,
    Regime, RestoringForce, Slopes, Spindle, Tooth, path,
};

pub use cutting::{Cutting, Regeneration};
pub use dense_step::{DenseStep, Motion, Workspace};
pub use drive::Drive;
pub use error::SimulateError;
pub use integrator::Statistics;
pub use model::Model;
pub use pores::Pores;
pub use reading::Reading;
pub use record::Recorder;
pub use sensor::{Accelerometer, STANDARD_GRAVITY, Sampler, TachometerModel};
pub use settings::Settings;
pub use virtual_cut::{Entry, SensedCut, VirtualCut, VirtualCutError};
pub use workpiece_traverse::WorkpieceTraverse;
