//! Recordings made ready, each beside what the baseline predicts of it.

pub(crate) mod amplification;
pub(crate) mod checks;
pub(crate) mod cutting;
pub(crate) mod full_engagement;
pub(crate) mod motion_estimate;
pub(crate) mod record;
pub(crate) mod study;
