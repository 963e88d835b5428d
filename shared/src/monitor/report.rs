//! The result of the signal chain for one block.

use serde::{Deserialize, Serialize};

use crate::advice::Advice;
use crate::detector::Judgement;
use crate::units::{Nanoseconds, Rpm};

/// The result of the signal chain for one block.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Report {
    /// Sequence number of the block.
    pub sequence: u32,
    /// Time of the last sample of the block.
    pub time: Nanoseconds,
    /// Spindle speed: measured by the tachometer, else estimated from the spectrum, else assumed.
    pub speed: Option<Rpm>,
    /// The verdict with its reason and estimates.
    pub judgement: Judgement,
    /// The advice; `None` if the spindle speed is unknown.
    pub advice: Option<Advice>,
    /// Number of clipped samples since the start.
    pub clipped: u32,
    /// Number of lost samples since the start.
    pub lost: u32,
}
