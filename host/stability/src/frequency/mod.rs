//! Stability by receptances alone: modelled or measured, without a fit of modes.
//!
//! On a motion that grows as e^{st}, u − u_τ = (1 − e^{−sτ}) u. With the complex depth κ = w (1 − e^{−sτ}) the cut closes a
//! loop around the structure: u = H (κ α − β) u. Averaged coefficients make it a loop at one frequency, their whole
//! Fourier series one at the frequencies s + ikΩ. In both, the depth multiplies a matrix that does not depend on it:
//! an eigenvalue λ(s) of it belongs to a root where κ λ = 1.

pub(crate) mod averaged;
pub(crate) mod harmonic;
pub(crate) mod limits;
pub(crate) mod loci;
pub(crate) mod open_loop;
pub(crate) mod problem;
pub(crate) mod root;
