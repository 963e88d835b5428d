//! What a layer of a table is valid for.

use serde::{Deserialize, Serialize};

use crate::units::{Degrees, Millimeters};

/// What a layer is valid for.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Validity {
    /// Smallest feed per tooth.
    pub feed_from: Millimeters,
    /// Largest feed per tooth; equal to the smallest where limits depend on the feed.
    pub feed_to: Millimeters,
    /// Immersion angle where a tooth enters.
    pub start: Degrees,
    /// Immersion angle where a tooth leaves.
    pub exit: Degrees,
    /// Posture of the robot; 0 on a machine tool.
    pub posture: u8,
}

impl Validity {
    /// True where both have the same immersion and posture: feeds may then be interpolated between them.
    pub(super) fn is_family_of(&self, other: &Self) -> bool {
        self.posture == other.posture && self.start == other.start && self.exit == other.exit
    }
}

/// Stands for a layer that could not be read: no working point lies in it.
pub(super) const NOWHERE: Validity = Validity {
    feed_from: Millimeters(f32::NAN),
    feed_to: Millimeters(f32::NAN),
    start: Degrees(f32::NAN),
    exit: Degrees(f32::NAN),
    posture: 0,
};
