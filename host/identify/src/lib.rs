//! System identification: parameters of structures, materials and robots from recordings, each with its standard
//! deviation or 90 % interval.
//!
//! | folder | parameters | tests |
//! |---|---|---|
//! | [`modes`] | complex modes with left and right shapes | receptances, whole recordings |
//! | [`nonlinear`] | nonlinear terms; linearity tests | step-sine dwells ([`dwells`]), multisines, any record |
//! | [`cutting`] | force coefficients, runout; modes from stability limits | cuts with measured force; trial cuts |
//! | [`robot`] | joint stiffness, damping and cubic terms, payload | receptances or dwells at several postures |
//! | [`ambient`] | modes from responses alone (stochastic subspace) | idle spindle, background vibration |
//! | [`plan`] | none: a cheap set of tests that narrows the limits of a lobe chart | |
//!
//! [`case_file`] writes what was identified as a case file.
//!
//! "The thesis" in this crate is *Chatter Vibrations in Robotic Milling Considering Structural Nonlinearity*, a
//! doctoral thesis of the University of Victoria; its equation numbers are given as "thesis eq. 5.16".
//!
//! ```
//! use std::path::Path;
//!
//! use num_complex::Complex64;
//! use quietcut_frf::{Frf, FrfTable};
//! use quietcut_identify::modes::{Options, Receptances, identify};
//! use quietcut_model::structure::Direction;
//!
//! // One mode of 20 Hz, 2 % damping and 1 MN/m.
//! let frequency_hz: Vec<f64> = (0..200).map(|line| 15.0 + 0.05 * f64::from(line)).collect();
//! let receptance = frequency_hz.iter().map(|hertz| {
//!     let r = hertz / 20.0;
//!     (1e6 * Complex64::new(1.0 - r * r, 2.0 * 0.02 * r)).inv()
//! });
//! let entry = Frf {
//!     response: Direction::X,
//!     force: Direction::X,
//!     receptance: receptance.collect(),
//!     coherence: None,
//!     folding: None,
//! };
//! let table = FrfTable::new(Path::new("one-mode"), frequency_hz, vec![entry])?;
//!
//! let model = identify(&Receptances::new(&table, None, None)?, &Options::default())?;
//! let mode = &model.modes[0].mode;
//! assert!((mode.frequency_hz - 20.0).abs() < 1e-3);
//! assert!((mode.damping_ratio - 0.02).abs() < 1e-4);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! This crate judges no baseline model: that a recording contradicts a case is for the crate `diagnose` to say.

pub mod ambient;
pub mod case_file;
mod case_uncertainty;
mod criteria;
pub mod cutting;
pub mod dwells;
mod least_squares;
pub mod modes;
pub mod nonlinear;
pub mod plan;
pub mod robot;

pub use ambient::subspace;
pub use cutting::{chip, force_coefficients, force_test, inverse_stability, observed_cut};
pub use dwells::{dwell, steady};
pub use nonlinear::{
    decay_curve, describing, harmonic_balance, hfrf, homogeneity, law, linearity, ncma, periodic_fit,
    reciprocity, response, restoring_force, spectrum, steady_fit, sweep,
};
pub use robot::{cubic_joints, joints};

#[cfg(test)]
mod tests;
