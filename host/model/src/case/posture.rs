//! Where the robot stood.

use quietcut_recording::RecordedPosture;

/// What the robot's joints were at when the structure was measured.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Posture {
    /// An index that means the same on host and device; 0 on a machine tool.
    pub index: u8,
    /// Joint angles, degrees, from the base on.
    pub joints_deg: Vec<f64>,
}

impl Posture {
    /// As it stands beside a recording; `None` where no joints are known.
    pub fn recorded(&self) -> Option<RecordedPosture> {
        (!self.joints_deg.is_empty()).then(|| RecordedPosture {
            joints_deg: self.joints_deg.clone(),
        })
    }
}
