//! The joints of a robot from receptances at several postures.

pub mod cubic_joints;
pub mod joints;
