//! Cutting conditions, machine limits and tool, as set by the host.

use serde::{Deserialize, Serialize};

use crate::units::{Degrees, Millimeters, Rpm};

/// The cutting conditions: depth, immersion, feed and posture. The spindle speed is not one of them, because the device
/// measures it.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct WorkingPoint {
    /// Axial depth of cut.
    pub axial_depth: Millimeters,
    /// Entry angle of a tooth.
    pub start: Degrees,
    /// Exit angle of a tooth.
    pub exit: Degrees,
    /// Feed per tooth.
    pub feed_per_tooth: Millimeters,
    /// Index of the robot's posture during the cut, the same on host and device; 0 on a machine tool.
    pub posture: u8,
}

/// Speed limits of the spindle. Advice stays within them.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Limits {
    /// Slowest spindle speed.
    pub rpm_min: Rpm,
    /// Fastest spindle speed.
    pub rpm_max: Rpm,
}

/// The properties of the milling tool that the signal chain uses.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Tool {
    /// Number of teeth of the tool, at least 1.
    pub teeth: u8,
}
