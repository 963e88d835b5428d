//! The linear delay problem of a cut: equation, tooth passages, meshes of the period.

pub(crate) mod element;
pub(crate) mod exponential;
pub(crate) mod linear;
pub(crate) mod period;
pub(crate) mod pitched;
pub(crate) mod revolution;
pub(crate) mod revolution_mesh;
pub(crate) mod tooth_passages;
