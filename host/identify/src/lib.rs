//! From recordings to a model of the structure: parameters with intervals.
//!
//! Steady tests: [`dwell`] finds where a frequency is held and what moves there, [`steady_fit`] fits a [`law`] to it by
//! [`harmonic_balance`]; [`hfrf`] and [`ncma`] are the thesis's own ways, [`linearity`] judges. Any record:
//! [`restoring_force`]; whole periods of a multisine: [`periodic_fit`]. Cutting tests: [`force_coefficients`].
//! A robot at several postures: [`joints`], with cubic terms [`cubic_joints`]. Without any force: [`subspace`], and from chatter [`inverse_stability`].

pub mod ambient;
pub mod case_file;
pub mod cutting;
pub mod dwells;
mod least_squares;
pub mod modes;
pub mod nonlinear;
pub mod plan;
pub mod robot;
pub mod student;

pub use ambient::subspace;
pub use cutting::{chip, force_coefficients, force_test, inverse_stability, observed_cut};
pub use dwells::{dwell, steady};
pub use nonlinear::{
    describing, harmonic_balance, hfrf, homogeneity, law, linearity, ncma, periodic_fit, reciprocity,
    response, restoring_force, spectrum, steady_fit, sweep,
};
pub use robot::{cubic_joints, joints};

#[cfg(test)]
mod tests;
