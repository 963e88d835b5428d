//! Eigenvalues of real, complex, symmetric and companion matrices, and eigenvectors. Every iteration is bounded.
//!
//! | matrix | function | method |
//! |---|---|---|
//! | real | [`of_real`] | balancing, Hessenberg form, Francis double-shift QR with exceptional shifts |
//! | complex | [`of_complex`] | Hessenberg form, single-shift QR with exceptional shifts |
//! | complex, the largest only | [`dominant`] | Arnoldi, then as above |
//! | real symmetric, Hermitian | [`of_symmetric`] | tridiagonal form, implicit QR with Wilkinson's shift |
//! | symmetric pencil K v = λ M v | [`of_symmetric_pencil`] | Cholesky factor of M, then as above |
//! | one eigenvector | [`eigenvector`], or [`inverse_iteration`] with a solver of one's own | inverse iteration |
//! | a vector v with A v ≈ 0 | [`null_vector`] | inverse iteration |
//! | polynomial | [`polynomial_roots`] | companion matrix |
//!
//! For a matrix with an entry that is not finite, or on which a QR iteration exceeds its bound, the functions for
//! eigenvalues return an [`EigenvalueError`] that names the size. Those for one eigenvector return `None` if they find
//! none. Every function ends, and none panics on square matrices.

mod complex;
mod error;
mod polynomial;
mod real;
mod symmetric;
mod vector;

pub use complex::{dominant, of_complex};
pub use error::EigenvalueError;
pub use polynomial::polynomial_roots;
pub use real::of_real;
pub use symmetric::{of_symmetric, of_symmetric_pencil};
pub use vector::{eigenvector, inverse_iteration, null_vector};

#[cfg(test)]
mod tests;
