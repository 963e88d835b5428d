//! From recordings to a model of the structure: parameters with intervals.
//!
//! Steady tests: [`dwell`] finds where a frequency is held and what moves there, [`steady_fit`] fits a [`law`] to it by
//! [`harmonic_balance`]; [`hfrf`] and [`ncma`] are the thesis's own ways, [`linearity`] judges. Any record:
//! [`restoring_force`]; whole periods of a multisine: [`periodic_fit`]. Cutting tests: [`force_coefficients`].
//! A robot at several postures: [`joints`], with cubic terms [`cubic_joints`]. Without any force: [`subspace`], and from chatter [`inverse_stability`].

pub mod ambient;
pub mod case_file;
pub mod chip;
pub mod cubic_joints;
pub mod cutting_test;
pub mod describing;
pub mod dwell;
pub mod force_coefficients;
pub mod harmonic_balance;
pub mod hfrf;
pub mod homogeneity;
pub mod inverse_stability;
pub mod joints;
pub mod law;
mod least_squares;
pub mod linearity;
pub mod modes;
pub mod ncma;
pub mod observed_cut;
pub mod periodic_fit;
pub mod plan;
pub mod reciprocity;
pub mod response;
pub mod restoring_force;
pub mod spectrum;
pub mod steady;
pub mod steady_fit;
pub mod student;
pub mod subspace;
pub mod sweep;
mod whitening;

#[cfg(test)]
mod tests;
