//! Steady motion under a force of constant frequency, and where a recording holds it.

pub(crate) mod differentiation;
pub mod dwell;
pub mod steady;
