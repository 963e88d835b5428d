//! The joints of a robot from receptances at several postures.

pub mod cubic_joints;
mod cubic_model;
mod joint_parameter;
pub mod joints;
