//! Identification from virtual rigs, and from published measurements.

mod ambient;
mod coupling;
mod cubic_joints;
mod cutting;
mod decay;
mod decay_curves;
mod inverse_stability;
mod joints;
mod linearity;
mod measured;
mod steady;
mod surface;
mod tap_coverage;
mod thesis;
mod uncoupled;
mod virtual_taps;
