//! Recordings prepared for comparison, each with the prediction of the baseline.
//!
//! The files build on each other from the top to the bottom: `domain` and `channel`; `checks`, `pulses` and
//! `full_engagement`, which refuse or shorten recordings; `cutting`; `record`; `motion_estimate` and `amplification`;
//! `response_prediction` and `cut_prediction`; `prepare`, the one place where a record is built; `study`.

pub(crate) mod amplification;
pub(crate) mod channel;
pub(crate) mod checks;
mod cut_prediction;
pub(crate) mod cutting;
pub(crate) mod domain;
pub(crate) mod full_engagement;
mod motion_estimate;
mod prepare;
pub(crate) mod pulses;
pub(crate) mod record;
mod response_prediction;
pub(crate) mod study;
