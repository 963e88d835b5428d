//! Where the robot stood.

/// What the robot's joints were at when the structure was measured.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Posture {
    /// An index that means the same on host and device; 0 on a machine tool.
    pub index: u8,
    /// Joint angles, degrees, from the base on.
    pub joints_deg: Vec<f64>,
}
