//! Sampled signals: transforms between samples and spectra, and noise floors.

pub(crate) mod grid;
pub(crate) mod noise;
