//! Numerical methods that know nothing of milling.

pub mod crossing;
pub mod dormand_prince;
pub mod eigenvalues;
pub mod least_squares;
pub mod quadrature;
pub mod singular_values;
pub mod statistics;
