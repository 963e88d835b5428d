//! From recordings to a model of the structure: parameters with intervals.

pub mod dwell;
pub mod harmonic_balance;
pub mod law;
pub mod steady_fit;

#[cfg(test)]
mod tests;
