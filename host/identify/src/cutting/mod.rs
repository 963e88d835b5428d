//! Cutting tests: cutting force coefficients, and modes from stability limits.

pub mod chip;
pub mod force_coefficients;
pub mod force_test;
pub mod inverse_stability;
pub mod observed_cut;
mod prepared_test;
