//! Numerical methods without reference to milling: eigenvalues, least squares, integration of differential equations, statistics.
//!
//! | module | |
//! |---|---|
//! | [`eigenvalues`] | eigenvalues of real, complex, symmetric and companion matrices |
//! | [`singular_values`] | decomposition A = U Σ Vᵀ |
//! | [`least_squares`] | linear, robust, from normal equations, nonlinear |
//! | [`newton`] | Newton's method for numbers and vectors |
//! | [`roots`] | bisection, regula falsi, golden section |
//! | [`crossing`] | the first zero crossing within a time step |
//! | [`quadrature`] | Gauss–Legendre nodes and weights |
//! | [`dormand_prince`] | one step of an integration in time |
//! | [`statistics`] | quantiles of the usual distributions |
//!
//! Arguments and results are matrices of `nalgebra`. The number of iterations is bounded everywhere, and a result states why an iteration
//! stopped.
//!
//! `benches/linear_algebra.rs` measures least squares and eigenvalues beside nalgebra and faer. faer is not used: at up to twenty parameters
//! its times are within a factor of two of ours, and it brings duplicate versions of three packages.

pub mod crossing;
pub mod dormand_prince;
pub mod eigenvalues;
pub mod least_squares;
pub mod newton;
pub mod quadrature;
pub mod roots;
pub mod singular_values;
pub mod statistics;
mod stop;

pub use stop::Stop;
