//! Posture of a robot.

use quietcut_recording::RecordedPosture;

/// Posture of the robot at which the structure was measured or, for a structure given by joints, is computed.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Posture {
    /// Index of the posture, shared by host and device; 0 if the case gives none, as for a machine tool.
    pub index: u8,
    /// Joint angles, degrees, in the order from the base to the tool; empty if the case gives none, as for a machine
    /// tool.
    pub joints_deg: Vec<f64>,
}

impl Posture {
    /// The posture as an entry of a recording's sidecar; `None` without joint angles.
    pub fn recorded(&self) -> Option<RecordedPosture> {
        (!self.joints_deg.is_empty()).then(|| RecordedPosture {
            joints_deg: self.joints_deg.clone(),
        })
    }
}
