//! What advice says: what to change, where that comes from, and why not from something better.

use serde::{Deserialize, Serialize};

use crate::lobes::NotKnown;
use crate::units::{Millimeters, Rpm};
use crate::working_point::WorkingPoint;

/// What to do.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Action {
    /// Nothing: no chatter is heard.
    Keep,
    /// Change the spindle speed.
    Speed,
    /// Reduce the axial depth, at [`Advice::speed`].
    Depth,
    /// No advice can be given; [`Advice::obstacle`] says what is missing.
    NotKnown,
}

/// Where advice comes from.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Source {
    /// The lobe table of this machine.
    Table,
    /// The tooth-passing rule: a speed whose tooth-passing frequency is a fraction 1/k of the chatter frequency.
    ToothPassingRule,
}

/// What kept a better source from being used.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Obstacle {
    /// There is no lobe table.
    NoTable,
    /// The table does not know the present point.
    Table(NotKnown),
    /// The table calls the present point stable with margin, and yet it chatters: it is not true here.
    Contradicted,
    /// The spindle speed is not a positive number.
    Speed,
    /// The table knows no depth that is stable with margin at any speed within the limits.
    NothingStable,
    /// The chatter frequency is not known, so that the rule has nothing to go by.
    ChatterFrequency,
    /// The rule has no speed within the limits of the machine that the table does not call unstable.
    NoSpeedWithinLimits,
}

/// The next speed and depth.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Advice {
    /// What to change.
    pub action: Action,
    /// The spindle speed to cut with.
    pub speed: Rpm,
    /// The axial depth to cut with; `None` where it is not known: the host never told the working point, or the rule, which
    /// knows no depths, says to reduce it.
    pub depth: Option<Millimeters>,
    /// What it rests on.
    pub source: Source,
    /// The working point that was assumed, where the host told none.
    pub assumed: Option<WorkingPoint>,
    /// Why it rests on nothing better.
    pub obstacle: Option<Obstacle>,
}
