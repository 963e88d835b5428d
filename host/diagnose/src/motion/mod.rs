//! The motion of the spindle and of the teeth in a recorded cut, and free decays.

pub(crate) mod chips;
pub(crate) mod cut_force;
pub(crate) mod free_decay;
pub(crate) mod mean_slopes;
pub(crate) mod recorded_cut;
pub(crate) mod spindle_motion;
