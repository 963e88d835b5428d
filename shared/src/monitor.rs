//! Block in, report out: the pipeline that all callers use.

use serde::{Deserialize, Serialize};

use crate::acceleration::Sensor;
use crate::advice::Advice;
use crate::detector::Judgement;
use crate::tachometer::Wheel;
use crate::units::{Nanoseconds, Rpm};
use crate::working_point::{Limits, Tool};

/// What the pipeline must be told before it starts; the host may change it over the link.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Settings {
    /// The accelerometer.
    pub sensor: Sensor,
    /// The tool.
    pub tool: Tool,
    /// The tachometer wheel; `None` where there is no tachometer.
    pub wheel: Option<Wheel>,
    /// Spindle speed to assume where there is no tachometer.
    pub assumed_speed: Option<Rpm>,
    /// What the spindle can do.
    pub limits: Option<Limits>,
}

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
