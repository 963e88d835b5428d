//! The verdict: what the machine is doing.

pub mod evidence;
pub mod finding;
mod frequency;
pub mod growth;
pub mod judge;
mod latched_chatter;
pub mod lines;
mod lone_tone;
pub mod presence;
pub mod tone;

use serde::{Deserialize, Serialize};

use crate::units::Hertz;

/// What the monitor hears.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Verdict {
    /// The spindle turns, nothing is cut.
    AirCut,
    /// A cut whose disturbances die out.
    Stable,
    /// Chatter at a frequency that is no harmonic of the spindle (secondary Hopf, torus).
    Hopf,
    /// Chatter with twice the tooth period (flip).
    PeriodDoubling,
    /// Large vibration at harmonics of the tooth passing: forced, not chatter.
    Forced,
    /// Large vibration at harmonics of the spindle that are none of the tooth passing.
    Runout,
    /// The signal cannot tell; [`Reason`] says why.
    Indeterminate,
}

impl Verdict {
    /// True for the two kinds of chatter.
    pub fn is_chatter(self) -> bool {
        matches!(self, Self::Hopf | Self::PeriodDoubling)
    }
}

/// Why a verdict is what it is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Reason {
    /// Not enough signal yet since the start or the last gap.
    TooShort,
    /// Nothing above the noise of the sensor but what the spindle makes.
    NoSignal,
    /// What is not periodic with the tooth dies out: the largest multiplier is below 1.
    Decaying,
    /// What is not periodic with the tooth grows: the largest multiplier is above 1.
    Growing,
    /// It neither grows nor dies: a saturated vibration that stays.
    Persistent,
    /// Alternating once-per-tooth samples whose multiplier cannot be seen: runout and a flip look the same.
    FlipOrRunout,
    /// No tachometer and no assumed speed: harmonics cannot be told from chatter.
    SpeedUnknown,
    /// The spindle speed is changing.
    SpeedChanging,
    /// Too many clipped or lost samples.
    DamagedSignal,
}

/// A verdict with what it rests on.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Judgement {
    /// What the machine is doing.
    pub verdict: Verdict,
    /// Why.
    pub reason: Reason,
    /// The chatter frequency, where there is chatter.
    pub chatter: Option<Hertz>,
    /// |μ| of the dominant multiplier over one tooth period, where it could be estimated.
    pub multiplier_abs: Option<f32>,
    /// Probability that the verdict is right, 0 to 1.
    pub confidence: f32,
}
