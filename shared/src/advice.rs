//! Verdict, table and limits of the machine to the next speed or depth.

use serde::{Deserialize, Serialize};

use crate::units::{Millimeters, Rpm};

/// What to do.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Action {
    /// Nothing: the cut is quiet.
    Keep,
    /// Change the spindle speed.
    Speed,
    /// Reduce the axial depth.
    Depth,
    /// No advice can be given; [`Advice::source`] and the assumptions say what is missing.
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

/// The next speed and depth.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Advice {
    /// What to change.
    pub action: Action,
    /// The spindle speed to cut with.
    pub speed: Rpm,
    /// The axial depth to cut with; not known where the host never told the working point.
    pub depth: Option<Millimeters>,
    /// What it rests on.
    pub source: Source,
    /// True where the working point (depth, immersion, feed, posture) was not told and the table's first layer is assumed.
    pub assumed_working_point: bool,
}
