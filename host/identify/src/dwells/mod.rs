//! Dwells: steady motion under harmonic excitation of constant frequency, extracted from recordings.

pub(crate) mod differentiation;
pub mod dwell;
pub mod steady;
