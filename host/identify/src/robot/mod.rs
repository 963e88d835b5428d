//! Joint stiffness and damping of a robot from tests at several postures.

pub mod cubic_joints;
mod cubic_model;
mod joint_parameter;
pub mod joints;
