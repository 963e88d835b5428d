//! Diagnoses virtual records from end to end.

mod chatter;
pub(crate) mod cutting;
mod hammer;
mod joint_friction;
mod quintic_stiffness;
mod sensor;
pub(crate) mod structure;
mod two_effects;
mod uncertain_structure;
mod velocity_jump;
pub(crate) mod virtual_records;
