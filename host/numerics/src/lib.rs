//! Numerical methods without reference to milling: eigenvalues, least squares, integration of differential equations,
//! statistics.
//!
//! | module | |
//! |---|---|
//! | [`eigenvalues`] | eigenvalues of real, complex, symmetric and companion matrices |
//! | [`singular_values`] | decomposition A = U Σ Vᴴ |
//! | [`least_squares`] | linear, from normal equations, nonlinear |
//! | [`newton`] | Newton's method for numbers and vectors |
//! | [`roots`] | bisection, Newton's method with a bracket, regula falsi, golden section |
//! | [`lu`] | LU factors of large matrices |
//! | [`crossing`] | the first zero crossing within a time step |
//! | [`quadrature`] | Gauss–Legendre nodes and weights |
//! | [`dormand_prince`] | one step of an integration in time |
//! | [`statistics`] | quantiles of the normal, Student's, χ² and F distributions, intervals of a proportion, median |
//!
//! ```
//! use nalgebra::{DMatrix, DVector};
//! use quietcut_numerics::least_squares::LinearProblem;
//! use quietcut_numerics::statistics::NINETY_PERCENT;
//!
//! // A straight line through (0, 1), (1, 3) and (2, 5).
//! let columns = DMatrix::from_row_slice(3, 2, &[1.0, 0.0, 1.0, 1.0, 1.0, 2.0]);
//! let values = DVector::from_row_slice(&[1.0, 3.0, 5.0]);
//! let fit = LinearProblem::new(&columns, &values).solve()?;
//! assert!((fit.parameters[1] - 2.0).abs() < 1e-12);
//! // The 90 % interval of a normal variable is ±1.645 standard deviations.
//! assert!((NINETY_PERCENT - 1.645).abs() < 1e-3);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! Matrices are those of `nalgebra`. Every iteration ends, and the results of [`newton`] and of nonlinear least squares
//! state why it stopped.
//!
//! `benches/linear_algebra.rs` measures least squares and eigenvalues beside nalgebra and faer. This crate does not
//! use faer: for ten columns the times of faer are between 0.85 and 2.3 times those of this crate, and it brings
//! duplicate versions of three packages.

pub mod crossing;
pub mod dormand_prince;
pub mod eigenvalues;
pub mod least_squares;
pub mod lu;
pub mod newton;
pub mod quadrature;
pub mod roots;
pub mod singular_values;
pub mod spherical_bessel;
pub mod statistics;
mod stop;

pub use stop::Stop;
