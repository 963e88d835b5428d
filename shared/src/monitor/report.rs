//! What the pipeline says after each block.

use serde::{Deserialize, Serialize};

use crate::advice::Advice;
use crate::detector::Judgement;
use crate::units::{Nanoseconds, Rpm};

/// What the pipeline says after each block.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Report {
    /// Sequence number of the block.
    pub sequence: u32,
    /// Time of the last sample of the block.
    pub time: Nanoseconds,
    /// Spindle speed, where it is known.
    pub speed: Option<Rpm>,
    /// The verdict and what it rests on.
    pub judgement: Judgement,
    /// What to do about it.
    pub advice: Option<Advice>,
    /// Samples clipped since the start.
    pub clipped: u32,
    /// Samples lost since the start.
    pub lost: u32,
}
