//! The cutting process: what turns a displacement of the tool into a force.

use nalgebra::Vector3;

use super::{Cut, Engagement, Material, Tool, ToothForce};

/// Everything that turns a displacement into a force.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Process {
    /// The force on a tooth.
    pub force: ToothForce,
    /// When which tooth cuts.
    pub engagement: Engagement,
    /// Feed per tooth, m.
    pub feed_per_tooth_m: f64,
    /// True where the depth follows the axial vibration: then F gets −(β_e + β_f) z (eq. 3.7).
    pub axial_depth_modulation: bool,
}

impl Process {
    /// The cutting process of a case with equal pitch.
    pub fn new(tool: &Tool, material: &Material, cut: &Cut, axial_depth_modulation: bool) -> Self {
        Self {
            force: ToothForce::new(tool, material),
            engagement: Engagement::new(tool, cut),
            feed_per_tooth_m: cut.feed_per_tooth_mm * 1e-3,
            axial_depth_modulation,
        }
    }

    /// Force per depth, N/m, of the `teeth` that cut at a phase of the tooth period, rad, where the chip is that of the feed:
    /// on every orbit of the tooth period.
    pub fn forced(&self, teeth: usize, phase: f64) -> Vector3<f64> {
        (0..teeth)
            .map(|tooth| {
                let angle = self.engagement.angle(tooth, phase);
                self.force.forced(angle, self.feed_per_tooth_m)
            })
            .sum()
    }
}
