//! The result of advice: the proposed change, its source, and the obstacle to a better source.

use serde::{Deserialize, Serialize};

use crate::lobes::NotKnown;
use crate::units::{Millimeters, Rpm};
use crate::working_point::WorkingPoint;

/// The change that advice proposes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Action {
    /// No change: no chatter is detected.
    Keep,
    /// Change the spindle speed.
    Speed,
    /// Reduce the axial depth, at [`Advice::speed`].
    Depth,
    /// No advice can be given; [`Advice::obstacle`] says what is missing.
    NotKnown,
}

/// The source of advice.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Source {
    /// The lobe table of this machine.
    Table,
    /// The tooth-passing rule: a speed whose tooth-passing frequency is a fraction 1/k of the chatter frequency.
    ToothPassingRule,
}

/// The reason why no better source of advice was used.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Obstacle {
    /// No lobe table is loaded.
    NoTable,
    /// The table has no entry for the present cut.
    Table(NotKnown),
    /// The table says that the present point is stable with margin, but the cut chatters: the table is wrong here.
    Contradicted,
    /// The spindle speed is not a positive number.
    Speed,
    /// The table has no depth that is stable with margin at any speed within the limits.
    NothingStable,
    /// The chatter frequency is unknown; the tooth-passing rule requires it.
    ChatterFrequency,
    /// Every speed of the tooth-passing rule is outside the limits of the machine or unstable in the table.
    NoSpeedWithinLimits,
}

/// The advised spindle speed and axial depth, with their source.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Advice {
    /// The proposed change.
    pub action: Action,
    /// Advised spindle speed.
    pub speed: Rpm,
    /// Advised axial depth. `None` if no working point is set, or if the tooth-passing rule, which has no depths, says to
    /// reduce the depth.
    pub depth: Option<Millimeters>,
    /// Source of the advice.
    pub source: Source,
    /// The assumed working point; `None` if a working point is set.
    pub assumed: Option<WorkingPoint>,
    /// The reason why no better source was used; `None` if there is no better source.
    pub obstacle: Option<Obstacle>,
}
