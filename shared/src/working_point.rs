//! What the host knows of the cut and the machine, and tells the device.

use serde::{Deserialize, Serialize};

use crate::units::{Degrees, Millimeters, Rpm};

/// The cut as it is set up. Spindle speed is not part of it: the device measures that.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct WorkingPoint {
    /// Axial depth of cut.
    pub axial_depth: Millimeters,
    /// Immersion angle where a tooth enters.
    pub start: Degrees,
    /// Immersion angle where a tooth leaves.
    pub exit: Degrees,
    /// Feed per tooth.
    pub feed_per_tooth: Millimeters,
    /// Posture of the robot: an index that means the same on host and device; 0 on a machine tool.
    pub posture: u8,
}

/// What the spindle can do: advice stays within.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Limits {
    /// Slowest spindle speed.
    pub rpm_min: Rpm,
    /// Fastest spindle speed.
    pub rpm_max: Rpm,
}

/// The tool as the signal chain sees it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Tool {
    /// Number of teeth, at least 1.
    pub teeth: u8,
}
