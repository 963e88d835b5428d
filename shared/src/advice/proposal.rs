//! The advice of the device: the proposed change of speed or depth, its source, and the obstacle to a better source.

use serde::{Deserialize, Serialize};

use crate::lobes::NotKnown;
use crate::units::{Millimeters, Rpm};
use crate::working_point::WorkingPoint;

/// The change that advice proposes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Action {
    /// No change of speed or depth is proposed: no chatter is detected.
    Keep,
    /// Change the spindle speed.
    Speed,
    /// Reduce the axial depth of the cut, at the spindle speed [`Advice::speed`].
    Depth,
    /// No advice can be given; [`Advice::obstacle`] says what is missing.
    NotKnown,
}

/// The source of advice.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Source {
    /// The advice comes from the lobe table of this machine.
    Table,
    /// The advice comes from the tooth-passing rule: a speed whose tooth-passing frequency is a fraction 1/k of the
    /// chatter frequency.
    ToothPassingRule,
}

/// The reason why advice does not come from a better source, such as the lobe table, or proposes no speed.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Obstacle {
    /// No lobe table is loaded.
    NoTable,
    /// The lobe table cannot be used for the present cut: for example, it has no entry for it, or is damaged.
    Table(NotKnown),
    /// The lobe table says that the present cut is stable, but it chatters: the table is wrong here. Stable means with
    /// margin at the set depth; without a working point, unstable at no depth.
    Contradicted,
    /// The present spindle speed is not a positive finite number.
    Speed,
    /// The search found no depth, up to that of the cut, that the lobe table calls stable with margin at a speed within
    /// the limits of the machine.
    NothingStable,
    /// The chatter frequency, which the tooth-passing rule requires, is unknown or not a positive finite number.
    ChatterFrequency,
    /// The tooth-passing rule proposes no speed that lies within the limits of the machine and is not unstable in the
    /// lobe table.
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
    /// Advised axial depth; the set depth if no other is advised. `None` if the tooth-passing rule, which has no
    /// depths, says to reduce the depth. Without a working point `None`, unless the lobe table proposes a depth.
    pub depth: Option<Millimeters>,
    /// Source of the advice; without chatter [`Source::Table`] if there is a lobe table.
    pub source: Source,
    /// The working point that the advice assumes because none is set; `None` if one is set or none was assumed.
    pub assumed: Option<WorkingPoint>,
    /// The reason why the advice does not come from a better source, or proposes no speed; `None` without chatter, or
    /// if the advice comes from the lobe table.
    pub obstacle: Option<Obstacle>,
}
