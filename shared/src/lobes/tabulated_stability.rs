//! The result of a lookup in the lobe table: stable, unstable, or not known with the reason.

use serde::{Deserialize, Serialize};

use super::IntervalKind;
use crate::units::{Degrees, Hertz, Millimeters, Rpm};

/// The reason why a lookup in the lobe table does not say whether the cut is stable.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum NotKnown {
    /// The spindle speed lies outside the lobe table.
    Speed {
        /// The requested speed.
        asked: Rpm,
        /// The slowest spindle speed of the lobe table.
        from: Rpm,
        /// The fastest spindle speed of the lobe table.
        to: Rpm,
    },
    /// The axial depth lies outside the lobe table.
    Depth {
        /// The requested depth.
        asked: Millimeters,
        /// The smallest axial depth of the lobe table.
        from: Millimeters,
        /// The largest axial depth of the lobe table.
        to: Millimeters,
    },
    /// The feed per tooth lies outside the range of the table layers for this immersion, posture and feed direction.
    Feed {
        /// The requested feed per tooth.
        asked: Millimeters,
        /// The smallest feed per tooth of these table layers.
        from: Millimeters,
        /// The largest feed per tooth of these table layers.
        to: Millimeters,
    },
    /// The lobe table has no layer for the immersion angles of the cut at its posture.
    Immersion {
        /// The requested entry angle.
        start: Degrees,
        /// The requested exit angle.
        exit: Degrees,
    },
    /// The lobe table has no layer for the posture of the robot.
    Posture {
        /// The requested posture.
        asked: u8,
    },
    /// The lobe table was computed for another number of teeth.
    Teeth {
        /// Number of teeth of the tool that cuts.
        asked: u8,
        /// Number of teeth for which the lobe table was computed.
        table: u8,
    },
    /// The speed and depth lie in the lobe table, but its entry there is [`Undecided`](super::IntervalKind::Undecided).
    Undecided,
    /// The bytes of the lobe table were changed after the check.
    Damaged,
    /// The table layers for this immersion and posture are valid for other feed directions, between which the lookup
    /// cannot interpolate to that of the cut.
    FeedDirection {
        /// The requested feed direction.
        asked: Degrees,
    },
    /// The lobe table has layers for several feed directions at this immersion and posture, and the feed direction of
    /// the cut is not set.
    FeedDirectionNotTold,
}

/// Stability of a cut (spindle speed and working point) according to the lobe table.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum TabulatedStability {
    /// The cut is stable: a perturbation of the forced vibration decays.
    Stable {
        /// Distance of the cut's depth to the nearest depth that is not stable, or to an end of the lobe table other
        /// than depth 0, whichever is nearer.
        margin: Millimeters,
    },
    /// The cut is unstable.
    Unstable {
        /// Kind of stability loss.
        kind: IntervalKind,
        /// Chatter frequency; 0 if unknown.
        chatter: Hertz,
        /// Distance of the cut's depth to the nearest stable depth, or to an end of the lobe table, whichever is
        /// nearer.
        margin: Millimeters,
    },
    /// The stability of the cut is not known, for the given reason.
    NotKnown(NotKnown),
}
