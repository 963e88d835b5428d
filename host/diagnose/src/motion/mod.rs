//! Spindle angle, chips and cutting force of a recorded cut, and free decays of the structure.

pub(crate) mod chips;
pub(crate) mod cut_force;
pub(crate) mod free_decay;
pub(crate) mod mean_slopes;
pub(crate) mod recorded_cut;
pub(crate) mod spindle_motion;
