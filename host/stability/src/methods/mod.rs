//! One file per method behind [`Method`](crate::Method).

pub(crate) mod at_each_speed;
pub(crate) mod collocation;
pub(crate) mod discretized;
pub(crate) mod fdm;
pub(crate) mod mode_coupling;
pub(crate) mod multi_frequency;
pub(crate) mod nyquist;
pub(crate) mod revolution_collocation;
pub(crate) mod sdm;
pub(crate) mod step_error;
pub(crate) mod stepped;
pub(crate) mod zoa;
