//! Stability from receptances alone, modelled or measured, without a modal fit.
//!
//! On a motion that grows as e^{st}, u − u_τ = (1 − e^{−sτ}) u. With the complex depth κ = w (1 − e^{−sτ}) the cut
//! closes a loop around the structure: u = H (κ α − β) u. With averaged coefficients the loop has one frequency; with
//! their Fourier series it couples the frequencies s + ikΩ. In both cases the depth multiplies a matrix that does not
//! depend on it: an eigenvalue λ(s) of that matrix belongs to a root if κ λ = 1.

pub(crate) mod averaged;
pub(crate) mod fitted_cut;
pub(crate) mod fitted_line;
pub(crate) mod fitted_point;
pub(crate) mod fitted_structure;
pub(crate) mod harmonic;
pub(crate) mod limits;
pub(crate) mod loci;
pub(crate) mod open_loop;
pub(crate) mod problem;
pub(crate) mod root;
