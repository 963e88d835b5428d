//! The milling tool.

/// A milling tool with straight cutting edges.
#[derive(Clone, Debug, PartialEq)]
pub struct Tool {
    /// Number of teeth, at least 1.
    pub teeth: usize,
    /// Edge angle γ at the midpoint of the engaged length, degrees, in (0, 90]; 90 is a square end mill.
    pub edge_angle_deg: f64,
    /// Diameter, mm; `None` where the case does not say.
    pub diameter_mm: Option<f64>,
    /// Angle from each tooth to the one that follows it in the cut, degrees; `teeth` values with the sum 360.
    pub pitch_deg: Vec<f64>,
    /// Offset of the tool axis from the spindle axis; `None` for a tool that runs true.
    pub runout: Option<Runout>,
}

/// Tooth j runs on the radius R + e·cos(ψ + 2πj/N), j from 0.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Runout {
    /// Offset e, micrometers.
    pub offset_um: f64,
    /// Angle ψ of the first tooth from the direction of the offset, degrees.
    pub angle_deg: f64,
}

impl Tool {
    /// The pitch of a tool whose teeth stand at equal distances: 360/N degrees.
    pub fn equal_pitch_deg(&self) -> f64 {
        360.0 / self.teeth as f64
    }

    /// True where the distances between the teeth differ: then a chart has several delays.
    pub fn has_variable_pitch(&self) -> bool {
        let equal = self.equal_pitch_deg();
        // Printed pitches carry a few digits; below a thousandth of a degree the delays are the same to 1e-5.
        self.pitch_deg.iter().any(|pitch| (pitch - equal).abs() > 1e-3)
    }

    /// Time from tooth to tooth, seconds, with equal pitch.
    pub fn tooth_period_s(&self, spindle_rpm: f64) -> f64 {
        60.0 / (spindle_rpm * self.teeth as f64)
    }
}
