//! The result of a lookup: stable, unstable, or not known with the reason.

use serde::{Deserialize, Serialize};

use super::IntervalKind;
use crate::units::{Degrees, Hertz, Millimeters, Rpm};

/// The reason why a lookup gives no stability.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum NotKnown {
    /// The speed lies outside the table.
    Speed {
        /// The requested speed.
        asked: Rpm,
        /// The slowest speed of the table.
        from: Rpm,
        /// The fastest speed of the table.
        to: Rpm,
    },
    /// The depth lies outside the table.
    Depth {
        /// The requested depth.
        asked: Millimeters,
        /// The smallest depth of the table.
        from: Millimeters,
        /// The largest depth of the table.
        to: Millimeters,
    },
    /// The feed per tooth lies outside the layers for this immersion and posture.
    Feed {
        /// The requested feed per tooth.
        asked: Millimeters,
        /// The smallest feed of these layers.
        from: Millimeters,
        /// The largest feed of these layers.
        to: Millimeters,
    },
    /// The table has no layer for this immersion.
    Immersion {
        /// The requested entry angle.
        start: Degrees,
        /// The requested exit angle.
        exit: Degrees,
    },
    /// The table has no layer for this posture.
    Posture {
        /// The requested posture.
        asked: u8,
    },
    /// The table was computed for another number of teeth.
    Teeth {
        /// Number of teeth of the tool.
        asked: u8,
        /// Number of teeth in the table.
        table: u8,
    },
    /// The point lies in the table, but its stability is [`Undecided`](super::IntervalKind::Undecided).
    Undecided,
    /// The bytes of the table were changed after the check.
    Damaged,
    /// The table has layers for several feed directions, and none is close enough to the requested one.
    FeedDirection {
        /// The requested feed direction.
        asked: Degrees,
    },
    /// The table has layers for several feed directions, and no feed direction is set.
    FeedDirectionNotTold,
}

/// Stability of a point (speed, working point) according to the table.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum TabulatedStability {
    /// The cut is stable: a perturbation of the forced vibration decays.
    Stable {
        /// Distance to the nearest depth that is not stable, or to the end of the table.
        margin: Millimeters,
    },
    /// The cut is unstable.
    Unstable {
        /// Kind of stability loss.
        kind: IntervalKind,
        /// Chatter frequency; 0 if unknown.
        chatter: Hertz,
        /// Distance to the nearest stable depth, or to the end of the table.
        margin: Millimeters,
    },
    /// The stability is not known, for the given reason.
    NotKnown(NotKnown),
}
