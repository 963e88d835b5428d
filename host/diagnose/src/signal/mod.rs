//! Sampled signals: transforms between samples and spectra, noise floors, inner products.

pub(crate) mod dot;
pub(crate) mod grid;
pub(crate) mod noise;
