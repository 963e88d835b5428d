//! The milling tool.

use crate::criteria::VARIABLE_PITCH_DEG;

/// A milling tool without helix: each cutting edge lies in a plane with the tool axis. One edge angle stands for the
/// whole engaged length.
#[derive(Clone, Debug, PartialEq)]
pub struct Tool {
    /// Number of teeth, at least 1.
    pub teeth: usize,
    /// Edge angle γ between the cutting edge and the normal plane of the tool axis, degrees, in (0, 90]; for a curved
    /// edge at the midpoint of the engaged length. 90 is a square end mill.
    pub edge_angle_deg: f64,
    /// Diameter of the tool, mm; `None` if the case does not give it.
    pub diameter_mm: Option<f64>,
    /// Pitch angles between successive teeth, degrees; `teeth` values with the sum 360. Entry j is the angle from tooth
    /// j − 1 to tooth j, entry 0 that from the last tooth to the first.
    pub pitch_deg: Vec<f64>,
    /// Runout of the tool; `None` if the case does not give it.
    pub runout: Option<Runout>,
}

/// Runout from an axis offset e: a tooth at the angle θ from the first tooth has the radius R + e·cos(ψ + θ), where R
/// is the radius without runout.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Runout {
    /// Offset e of the tool axis from the spindle axis, µm.
    pub offset_um: f64,
    /// Angle ψ of the first tooth from the direction of the offset, degrees.
    pub angle_deg: f64,
}

impl Runout {
    /// Radial runout of a tooth at the angle `tooth_rad` from the first tooth, rad: the radius of that tooth minus the
    /// radius without runout, m.
    pub fn radial_m(self, tooth_rad: f64) -> f64 {
        1e-6 * self.offset_um * (self.angle_deg.to_radians() + tooth_rad).cos()
    }
}

impl Tool {
    /// Pitch angle of the N teeth at equal pitch, 360/N degrees.
    pub fn equal_pitch_deg(&self) -> f64 {
        360.0 / self.teeth as f64
    }

    /// True if a pitch angle differs from that of equal pitch by more than 0.001 degrees: the delay equation then has
    /// several delays.
    pub fn has_variable_pitch(&self) -> bool {
        let equal = self.equal_pitch_deg();
        self.pitch_deg
            .iter()
            .any(|pitch| (pitch - equal).abs() > VARIABLE_PITCH_DEG)
    }

    /// Tooth-passing period at equal pitch, s, at the spindle speed `spindle_rpm`, rev/min.
    pub fn tooth_period_s(&self, spindle_rpm: f64) -> f64 {
        60.0 / (spindle_rpm * self.teeth as f64)
    }
}
