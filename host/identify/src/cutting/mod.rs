//! Cutting tests: coefficients of the cutting force, and modes from limits of stability.

pub mod chip;
pub mod force_coefficients;
pub mod force_test;
pub mod inverse_stability;
pub mod observed_cut;
mod prepared_test;
