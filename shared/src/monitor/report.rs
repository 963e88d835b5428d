//! The report of the signal chain on one block of samples.

use serde::{Deserialize, Serialize};

use crate::advice::Advice;
use crate::detector::Judgement;
use crate::units::{Nanoseconds, Rpm};

/// The report of the signal chain on one block of samples.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Report {
    /// Sequence number of the block.
    pub sequence: u32,
    /// Time of the last sample of the block, on the device's clock.
    pub time: Nanoseconds,
    /// Spindle speed: measured by the tachometer, else estimated from the spectrum, else assumed; `None` if none of
    /// these is available.
    pub speed: Option<Rpm>,
    /// The verdict on the cut with its reason and estimates.
    pub judgement: Judgement,
    /// True while the machine should be stopped or slowed: chatter, or what may be a flip and is too large for the runout of the tool. Version 1
    /// of the protocol does not carry it: in a report from a device it is false.
    #[serde(skip)]
    pub alarm: bool,
    /// The advice on speed and depth; `None` if the spindle speed is unknown.
    pub advice: Option<Advice>,
    /// Number of clipped acceleration samples since the signal chain was started or reset.
    pub clipped: u32,
    /// Number of lost acceleration samples since the signal chain was started or reset.
    pub lost: u32,
}
