//! Floquet multipliers (characteristic multipliers): eigenvalues of the map over one period, and their dependence on
//! the axial depth.

pub(crate) mod along_depth;
pub(crate) mod characteristic;
pub(crate) mod chatter_frequency;
pub(crate) mod collocated;
pub(crate) mod crossing;
pub(crate) mod floquet_mode;
pub(crate) mod hessenberg;
pub(crate) mod krylov;
pub(crate) mod map_spectrum;
pub(crate) mod period_map;
mod period_parts;
pub(crate) mod port_mode;
pub(crate) mod revolution_map;
pub(crate) mod root;
pub(crate) mod stability_loss;
pub(crate) mod verdict;
pub(crate) mod winding;
