//! Extensions of a case in the stability problem: their effect on the structure and on the cutting process.

pub(crate) mod extension;
pub(crate) mod speed_dependence;
pub(crate) mod treatment;
pub(crate) mod wear_and_drift;
