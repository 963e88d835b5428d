//! The wheel of a tachometer.

use serde::{Deserialize, Serialize};

/// The wheel that makes the pulses: one mark, or a toothed wheel with a gap such as 60−2.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Wheel {
    /// Positions on the wheel, at least 1.
    pub positions: u16,
    /// This many positions in a row are missing; the first edge after them is immersion angle 0 of tooth 1.
    pub missing: u16,
}

impl Wheel {
    /// Number of teeth: positions that make an edge.
    pub(super) fn teeth(&self) -> u16 {
        self.positions.saturating_sub(self.missing)
    }
}
