//! Extensions of a case in the stability problem: their effect on structure and cutting process.

pub(crate) mod extension;
pub(crate) mod treatment;
pub(crate) mod wear_and_drift;
