//! Cutting tests: force coefficients from measured forces, and modes from the outcome of trial cuts.

pub mod chip;
pub mod force_coefficients;
pub mod force_test;
pub mod inverse_stability;
pub mod observed_cut;
mod prepared_test;
