//! From recordings to a model of the structure: parameters with intervals.
//!
//! Steady tests: [`dwell`] finds where a frequency is held and what moves there, [`steady_fit`] fits a [`law`] to it by
//! [`harmonic_balance`]; [`hfrf`] and [`ncma`] are the thesis's own ways, [`linearity`] judges. Any record:
//! [`restoring_force`]; whole periods of a multisine: [`periodic_fit`].

pub mod case_file;
pub mod describing;
pub mod dwell;
pub mod harmonic_balance;
pub mod hfrf;
pub mod homogeneity;
pub mod law;
pub mod linearity;
pub mod ncma;
pub mod periodic_fit;
pub mod reciprocity;
pub mod response;
pub mod restoring_force;
pub mod spectrum;
pub mod steady;
pub mod steady_fit;
pub mod sweep;

#[cfg(test)]
mod tests;
