//! Identification of what a virtual rig has measured, and of records that others measured.

mod ambient;
mod coupling;
mod cubic_joints;
mod cutting;
mod inverse_stability;
mod joints;
mod linearity;
mod measured;
mod steady;
mod surface;
mod thesis;
