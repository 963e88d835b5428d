//! Identification of what a virtual rig has measured, and of records that others measured.

mod coupling;
mod linearity;
mod measured;
mod steady;
mod surface;
mod thesis;
