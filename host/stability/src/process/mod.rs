//! The extensions of a case in the stability problem: what they make of structure and cutting process.

pub(crate) mod extension;
pub(crate) mod treatment;
pub(crate) mod wear_and_drift;
