//! The teeth: where they are, and how thick a chip they see.

use std::f64::consts::TAU;

pub use super::immersion::Immersion;

use super::force_law::ForceLaw;
use crate::ModelError;
use crate::milling::{Cut, Material, Runout, Tool};

/// The tool in its cut, in SI units and in the machine's axes.
///
/// Tooth j stands at φⱼ = θ + ψⱼ with the spindle angle θ, clockwise from the normal of the feed (thesis Fig. 3.1).
/// A tooth with the larger ψ comes first: the surface in front of tooth j was left by tooth j + 1.
#[derive(Clone, Debug)]
pub struct Cutter {
    /// The teeth in the order of ψ.
    pub teeth: Vec<Tooth>,
    /// Immersion angle where teeth enter, rad.
    pub start_rad: f64,
    /// Immersion angle where teeth leave, rad.
    pub exit_rad: f64,
    /// Axial depth of cut, m.
    pub depth_m: f64,
    /// Feed per tooth, mean over the teeth, m.
    pub feed_per_tooth_m: f64,
    /// Half the diameter, m, where it is known.
    pub radius_m: Option<f64>,
    /// True where the depth of cut follows the axial vibration, b = b₀ − z (thesis eq. 3.5).
    pub axial_depth_modulation: bool,
    /// How hard a chip pushes.
    pub force: ForceLaw,
    feed_direction: [f64; 2],
    sin_edge: f64,
    cos_edge: f64,
}

/// One tooth.
#[derive(Clone, Copy, Debug)]
pub struct Tooth {
    /// ψ, rad in [0, 2π).
    pub angle_rad: f64,
    /// How far its radius exceeds the mean, m.
    pub radial_m: f64,
    /// The tooth that passed here before it.
    pub ahead: usize,
    /// The tooth that passes here after it.
    pub behind: usize,
    /// Angle to the tooth ahead, rad.
    pub pitch_rad: f64,
    /// How far the tool feeds while it turns by that angle, m.
    pub feed_m: f64,
}

impl Cutter {
    /// The tool in its cut; `axial_depth_m` deep.
    ///
    /// # Errors
    /// The tool's pitches do not go once around.
    pub fn new(tool: &Tool, material: &Material, cut: &Cut, axial_depth_m: f64) -> Result<Self, ModelError> {
        let edge_rad = tool.edge_angle_deg.to_radians();
        // A right angle is exact: the axial vibration is then not in the chip at all.
        let (sin_edge, cos_edge) = if tool.edge_angle_deg == 90.0 {
            (1.0, 0.0)
        } else {
            edge_rad.sin_cos()
        };
        let feed_rad = cut.feed_direction_deg.to_radians();
        let mut cutter = Self {
            teeth: teeth(tool, cut.feed_per_tooth_mm * 1e-3)?,
            start_rad: cut.start_deg.to_radians(),
            exit_rad: cut.exit_deg.to_radians(),
            depth_m: axial_depth_m,
            feed_per_tooth_m: cut.feed_per_tooth_mm * 1e-3,
            radius_m: tool.diameter_mm.map(|diameter_mm| 0.5e-3 * diameter_mm),
            axial_depth_modulation: false,
            feed_direction: [feed_rad.cos(), feed_rad.sin()],
            sin_edge,
            cos_edge,
            force: ForceLaw::new(*material, [sin_edge, cos_edge]),
        };
        if let Some(runout) = tool.runout {
            cutter.set_runout(runout);
        }
        Ok(cutter)
    }

    /// The same with another feed.
    pub fn with_feed_per_tooth_m(mut self, feed_per_tooth_m: f64) -> Self {
        let count = self.teeth.len() as f64;
        for tooth in &mut self.teeth {
            tooth.feed_m = feed_per_tooth_m * tooth.pitch_rad * count / TAU;
        }
        self.feed_per_tooth_m = feed_per_tooth_m;
        self
    }

    /// Puts the tool's axis beside the spindle's.
    pub fn set_runout(&mut self, runout: Runout) {
        let count = self.teeth.len() as f64;
        for (index, tooth) in self.teeth.iter_mut().enumerate() {
            let angle = runout.angle_deg.to_radians() + TAU * index as f64 / count;
            tooth.radial_m = 1e-6 * runout.offset_um * angle.cos();
        }
    }

    /// The place at the immersion angle `phi_rad`.
    pub fn immersion(&self, phi_rad: f64) -> Immersion {
        let (sin, cos) = phi_rad.sin_cos();
        let [a, b] = self.feed_direction;
        Immersion {
            sin,
            outward: [sin * a - cos * b, sin * b + cos * a],
        }
    }

    /// How far the edge of a tooth stands out along the chip thickness, m: thesis eq. 3.1 without its feed.
    pub fn reach_m(&self, tooth: &Tooth, at: Immersion, x: [f64; 3]) -> f64 {
        let outward = at.outward[0] * x[0] + at.outward[1] * x[1];
        (outward + tooth.radial_m) * self.sin_edge - x[2] * self.cos_edge
    }

    /// How far a surface recedes along the chip thickness while the tool feeds on by `feed_m`, m.
    pub fn recession_m(&self, at: Immersion, feed_m: f64) -> f64 {
        feed_m * at.sin * self.sin_edge
    }

    /// The depth of cut at the axial displacement `z_m`, m.
    pub fn depth_at_m(&self, nominal_m: f64, z_m: f64) -> f64 {
        if self.axial_depth_modulation {
            (nominal_m - z_m).max(0.0)
        } else {
            nominal_m
        }
    }
}

fn teeth(tool: &Tool, feed_per_tooth_m: f64) -> Result<Vec<Tooth>, ModelError> {
    let count = tool.teeth;
    let sum: f64 = tool.pitch_deg.iter().sum();
    if count == 0 || tool.pitch_deg.len() != count || sum.is_nan() || (sum - 360.0).abs() > 1e-6 {
        return Err(ModelError::Pitch {
            teeth: count,
            pitch_deg: tool.pitch_deg.clone(),
        });
    }
    let mut angle_rad = 0.0;
    let teeth = (0..count).map(|index| {
        // Exact fractions of a turn where the teeth stand evenly.
        let equal = TAU * index as f64 / count as f64;
        if index > 0 {
            angle_rad += tool.pitch_deg[index].to_radians();
        }
        let ahead = (index + 1) % count;
        let pitch_rad = if tool.has_variable_pitch() {
            tool.pitch_deg[ahead].to_radians()
        } else {
            TAU / count as f64
        };
        Tooth {
            angle_rad: if tool.has_variable_pitch() {
                angle_rad
            } else {
                equal
            },
            radial_m: 0.0,
            ahead,
            behind: (index + count - 1) % count,
            pitch_rad,
            feed_m: feed_per_tooth_m * pitch_rad * count as f64 / TAU,
        }
    });
    Ok(teeth.collect())
}
