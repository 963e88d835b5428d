//! The linear cutting process: force law of a tooth, engagement and feed.

use nalgebra::Vector3;

use super::{Cut, EdgeAngle, Engagement, Material, Tool, ToothForce};

/// The linear cutting process of a tool with equal pitch and without runout.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Process {
    /// Force on one tooth.
    pub force: ToothForce,
    /// Engagement of the teeth over the tooth-passing period.
    pub engagement: Engagement,
    /// Feed per tooth, m.
    pub feed_per_tooth_m: f64,
    /// True if the axial depth follows the axial vibration z: the cutting force then contains −(β_e + β_f) z (thesis
    /// eq. 3.7).
    pub axial_depth_modulation: bool,
}

impl Process {
    /// The linear cutting process of a tool in a cut. The teeth are taken at equal pitch and without runout.
    pub fn new(tool: &Tool, material: &Material, cut: &Cut, axial_depth_modulation: bool) -> Self {
        Self {
            force: ToothForce::new(EdgeAngle::new(tool.edge_angle_deg), material),
            engagement: Engagement::new(tool, cut),
            feed_per_tooth_m: cut.feed_per_tooth_mm * 1e-3,
            axial_depth_modulation,
        }
    }

    /// Force per axial depth, N/m, summed over the `teeth` teeth in cut at a phase of the tooth-passing period, rad, at
    /// the chip thickness of the feed alone. On an orbit with the tooth-passing period the vibration cancels in the
    /// chip thickness.
    pub fn forced(&self, teeth: usize, phase: f64) -> Vector3<f64> {
        (0..teeth)
            .map(|tooth| {
                let angle = self.engagement.angle(tooth, phase);
                self.force.forced(angle, self.feed_per_tooth_m)
            })
            .sum()
    }
}
