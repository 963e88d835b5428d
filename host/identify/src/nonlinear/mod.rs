//! Nonlinear restoring forces: linearity tests, and identification of nonlinear terms.

mod block_jackknife;
pub mod decay_curve;
mod decay_window;
pub mod describing;
mod free_decay;
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
mod smooth_law;
pub mod spectrum;
pub mod steady_fit;
mod surface;
pub mod sweep;
pub(crate) mod whitening;
