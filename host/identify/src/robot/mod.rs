//! Stiffness, damping and cubic terms of a robot's joints from tests at several postures.

pub mod cubic_joints;
mod cubic_model;
mod joint_parameter;
pub mod joints;
mod receptance_model;
