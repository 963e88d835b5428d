//! Geometry of the teeth: angles, runout, and chip thickness.

use std::f64::consts::TAU;

use super::force_law::ForceLaw;
use crate::ModelError;
pub use crate::milling::Immersion;
use crate::milling::{Cut, EdgeAngle, Material, Runout, Tool};

/// The engaged tool in the machine's axes.
///
/// Tooth j is at the immersion angle φⱼ = θ + ψⱼ with the spindle angle θ, clockwise from the normal of the feed
/// (thesis Fig. 3.1). A tooth with larger ψ passes earlier: tooth j cuts the surface left by tooth j + 1.
#[derive(Clone, Debug)]
pub struct Cutter {
    /// The teeth in the order of ascending angle ψ on the tool.
    pub teeth: Vec<Tooth>,
    /// Immersion angle of entry, rad.
    pub start_rad: f64,
    /// Immersion angle of exit, rad.
    pub exit_rad: f64,
    /// Axial depth of cut, m.
    pub depth_m: f64,
    /// Feed per tooth as the mean over the teeth, m; single teeth differ with variable pitch.
    pub feed_per_tooth_m: f64,
    /// Radius of the tool, m; `None` if the case has no diameter.
    pub radius_m: Option<f64>,
    /// True if the axial depth follows the axial vibration, b = b₀ − z (thesis eq. 3.5), but at least 0.
    pub axial_depth_modulation: bool,
    /// Cutting force law.
    pub force: ForceLaw,
    /// Mean spindle speed of the cut, rev/min; `None` if it is not known.
    pub spindle_rpm: Option<f64>,
    feed_direction: [f64; 2],
    edge: EdgeAngle,
}

/// Angle, runout and neighbours of one tooth.
#[derive(Clone, Copy, Debug)]
pub struct Tooth {
    /// Angle ψ of the tooth on the tool, rad in [0, 2π).
    pub angle_rad: f64,
    /// Radial runout of the tooth, m: its radius minus the radius without runout.
    pub radial_m: f64,
    /// Index of the tooth that passes immediately before this one.
    pub ahead: usize,
    /// Index of the tooth that passes immediately after this one.
    pub behind: usize,
    /// Pitch angle to the tooth `ahead`, rad.
    pub pitch_rad: f64,
    /// Feed of the tool while it rotates by the pitch angle of this tooth, m.
    pub feed_m: f64,
}

impl Cutter {
    /// The tool in a cut of the axial depth `axial_depth_m`, m.
    ///
    /// # Errors
    /// The tool has no teeth, the number of pitch angles differs from the number of teeth, or the sum of the pitch
    /// angles is not 360 degrees.
    pub fn new(tool: &Tool, material: &Material, cut: &Cut, axial_depth_m: f64) -> Result<Self, ModelError> {
        let edge = EdgeAngle::new(tool.edge_angle_deg);
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
            edge,
            force: ForceLaw::new(*material, edge),
            spindle_rpm: None,
        };
        if let Some(runout) = tool.runout {
            cutter.set_runout(runout);
        }
        Ok(cutter)
    }

    /// This cutter at the mean spindle speed `spindle_rpm`, rev/min.
    #[must_use]
    pub fn at_speed(self, spindle_rpm: f64) -> Self {
        Self {
            spindle_rpm: Some(spindle_rpm),
            ..self
        }
    }

    /// Mean cutting speed V = π·D·n, m/s; `None` if diameter or spindle speed is not known.
    pub fn cutting_speed_m_per_s(&self) -> Option<f64> {
        Some(self.radius_m? * TAU * self.spindle_rpm? / 60.0)
    }

    /// This cutter with another feed per tooth (mean over the teeth), m.
    pub fn with_feed_per_tooth_m(mut self, feed_per_tooth_m: f64) -> Self {
        let count = self.teeth.len() as f64;
        for tooth in &mut self.teeth {
            tooth.feed_m = feed_per_tooth_m * tooth.pitch_rad * count / TAU;
        }
        self.feed_per_tooth_m = feed_per_tooth_m;
        self
    }

    /// Sets the radial runout of all teeth to that of `runout`.
    pub fn set_runout(&mut self, runout: Runout) {
        for tooth in &mut self.teeth {
            tooth.radial_m = runout.radial_m(tooth.angle_rad);
        }
    }

    /// sin φ and the outward radial unit vector at the immersion angle φ = `phi_rad`, rad.
    pub fn immersion(&self, phi_rad: f64) -> Immersion {
        Immersion::new(phi_rad).in_machine(self.feed_direction)
    }

    /// Position of the edge of a tooth along the chip-thickness direction, m, at the displacement `x` of the tool, m:
    /// thesis eq. 3.1 without feed.
    pub fn reach_m(&self, tooth: &Tooth, at: Immersion, x: [f64; 3]) -> f64 {
        self.edge.reach_m(at, tooth.radial_m, x)
    }

    /// Contribution of a feed `feed_m`, m, to the chip thickness, m: feed·sin φ·sin γ.
    pub fn recession_m(&self, at: Immersion, feed_m: f64) -> f64 {
        self.edge.recession_m(at, feed_m)
    }

    /// Axial depth of cut, m, at the axial displacement `z_m` of the tool: the nominal depth `nominal_m`, or
    /// `nominal_m` − `z_m`, but at least 0, if the depth follows the axial vibration.
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
        // With equal pitch the angle of a tooth follows from its index, so that rounding does not accumulate.
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
