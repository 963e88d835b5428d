//! The cutting conditions for which a layer of a lobe table is valid.

use serde::{Deserialize, Serialize};

use crate::units::{Degrees, Millimeters};

/// The cutting conditions for which a layer of a lobe table is valid: feed range, immersion and posture.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Validity {
    /// Smallest feed per tooth.
    pub feed_from: Millimeters,
    /// Largest feed per tooth for which the layer is valid; equal to the smallest if the limits depend on the feed.
    pub feed_to: Millimeters,
    /// Entry angle of a tooth.
    pub start: Degrees,
    /// Exit angle of a tooth.
    pub exit: Degrees,
    /// Index of the robot's posture for which the layer is valid; 0 on a machine tool.
    pub posture: u8,
}

impl Validity {
    /// True if both table layers have the same immersion and posture, so that limits may be interpolated between them
    /// in feed.
    pub(super) fn is_family_of(&self, other: &Self) -> bool {
        self.posture == other.posture && self.start == other.start && self.exit == other.exit
    }
}

/// Placeholder for a table layer that cannot be read. No working point lies within its NaN bounds.
pub(super) const NOWHERE: Validity = Validity {
    feed_from: Millimeters(f32::NAN),
    feed_to: Millimeters(f32::NAN),
    start: Degrees(f32::NAN),
    exit: Degrees(f32::NAN),
    posture: 0,
};
