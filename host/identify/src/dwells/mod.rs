//! Steady motion under harmonic excitation of constant frequency (dwells), extracted from recordings.

pub(crate) mod differentiation;
pub mod dwell;
pub mod steady;
