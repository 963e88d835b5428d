//! What a table says of a point, and why it may not.

use serde::{Deserialize, Serialize};

use super::IntervalKind;
use crate::units::{Degrees, Hertz, Millimeters, Rpm};

/// Why a table has no answer.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum NotKnown {
    /// The speed lies outside the table.
    Speed {
        /// The speed asked for.
        asked: Rpm,
        /// The slowest of the table.
        from: Rpm,
        /// The fastest of the table.
        to: Rpm,
    },
    /// The depth lies outside the table.
    Depth {
        /// The depth asked for.
        asked: Millimeters,
        /// The smallest of the table.
        from: Millimeters,
        /// The largest of the table.
        to: Millimeters,
    },
    /// The feed per tooth lies outside the layers for this immersion and posture.
    Feed {
        /// The feed asked for.
        asked: Millimeters,
        /// The smallest of the layers.
        from: Millimeters,
        /// The largest of the layers.
        to: Millimeters,
    },
    /// The table has no layer for this immersion.
    Immersion {
        /// The entry angle asked for.
        start: Degrees,
        /// The exit angle asked for.
        exit: Degrees,
    },
    /// The table has no layer for this posture.
    Posture {
        /// The posture asked for.
        asked: u8,
    },
    /// The table is for a tool with another number of teeth.
    Teeth {
        /// The teeth of the tool.
        asked: u8,
        /// The teeth of the table.
        table: u8,
    },
    /// The point lies in the table, but its computation could not decide.
    Undecided,
    /// The bytes of the table changed after they were checked.
    Damaged,
    /// The table has layers for several feed directions, and none is near enough to the one asked for.
    FeedDirection {
        /// The direction asked for.
        asked: Degrees,
    },
    /// The table has layers for several feed directions, and that of the cut was not told.
    FeedDirectionNotTold,
}

/// What the table says of a point.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum TabulatedStability {
    /// Disturbances die out.
    Stable {
        /// Distance in depth to the nearest depth that is not stable, or to the end of the table.
        margin: Millimeters,
    },
    /// The cut chatters.
    Unstable {
        /// The kind of the loss of stability.
        kind: IntervalKind,
        /// The chatter frequency; 0 where it is not known.
        chatter: Hertz,
        /// Distance in depth to the nearest stable depth, or to the end of the table.
        margin: Millimeters,
    },
    /// The table does not know.
    NotKnown(NotKnown),
}
