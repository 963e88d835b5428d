//! The cutting process and its changes by causes.

use std::f64::consts::TAU;

use super::cause::{Cause, EffectKind, Scale};
use super::job::{CutScale, Job};
use super::machine::Machine;

/// The cutting process changed by causes.
pub(crate) struct Process {
    pub(crate) cutting_pa: [f64; 3],
    pub(crate) edge_n_per_m: [f64; 3],
    /// Deviation of each tooth's radius from the mean, m.
    pub(crate) radial_m: Vec<f64>,
    pub(crate) exponent: Option<(f64, f64)>,
    pub(crate) damping_n_per_m: f64,
    /// Factor on z, which is subtracted from the axial depth: 1 for axial depth modulation, otherwise 0.
    pub(crate) depth_follows: f64,
    pub(crate) wear_per_s: f64,
    pub(crate) fluctuation: Option<[f64; 3]>,
}

impl Process {
    /// The cutting process of a job while `causes` act.
    pub(crate) fn under(causes: &[Cause], job: &Job, machine: &Machine, scale: &Scale) -> Self {
        let mut process = Self {
            cutting_pa: job.cutting_mpa.map(|value| 1e6 * value),
            edge_n_per_m: job.edge_n_per_mm.map(|value| 1e3 * value),
            radial_m: radial_m(job.runout, job.teeth),
            exponent: None,
            damping_n_per_m: 0.0,
            depth_follows: 0.0,
            wear_per_s: 0.0,
            fluctuation: None,
        };
        for cause in causes {
            let values: Vec<f64> = cause.values(machine, scale).iter().map(|value| value.1).collect();
            match cause.kind {
                EffectKind::ForceCoefficients => {
                    (0..values.len()).for_each(|i| process.cutting_pa[i] = 1e6 * values[i])
                }
                EffectKind::EdgeForce => {
                    (0..values.len()).for_each(|i| process.edge_n_per_m[i] = 1e3 * values[i])
                }
                EffectKind::CommonForce => {
                    process.cutting_pa = process.cutting_pa.map(|value| value * values[0]);
                    process.edge_n_per_m = process.edge_n_per_m.map(|value| value * values[0]);
                }
                EffectKind::ForceExponent => process.exponent = Some((values[0], 1e-3 * values[1])),
                EffectKind::Runout => process.radial_m = radial_m([values[0], values[1]], job.teeth),
                EffectKind::ProcessDamping => process.damping_n_per_m = values[0],
                EffectKind::AxialDepthModulation => process.depth_follows = values[0],
                EffectKind::SpeedFluctuation => {
                    process.fluctuation = Some([values[0], values[1], cause.shares[2]])
                }
                EffectKind::Wear => process.wear_per_s = values[0],
                _ => {}
            }
        }
        process
    }
}

impl Cause {
    /// True values of the parameters of a cause in the cutting process, by their keys in answers; `None` for other causes.
    pub(crate) fn process_values(
        &self,
        machine: &Machine,
        cut: &CutScale,
        scale: &Scale,
    ) -> Option<Vec<(&'static str, f64)>> {
        let (s, job) = (&self.shares, &cut.job);
        let [kt, kr, _] = job.cutting_mpa;
        let edge = kt * job.feed_mm;
        Some(match self.kind {
            EffectKind::ForceCoefficients => vec![
                ("ktc_mpa", kt * (1.0 + 0.2 * s[0])),
                ("krc_mpa", kr * (1.0 + 0.2 * s[1])),
            ],
            EffectKind::CommonForce => vec![("factor", 1.0 + 0.1 * s[0])],
            EffectKind::EdgeForce => vec![
                ("kte_n_per_mm", job.edge_n_per_mm[0] + 0.1 * s[0] * edge),
                ("kre_n_per_mm", job.edge_n_per_mm[1] + 0.1 * s[1] * edge),
            ],
            EffectKind::ForceExponent => vec![
                ("exponent", 1.0 - 0.4 * s[0]),
                ("reference_chip_mm", s[1] * job.feed_mm),
            ],
            EffectKind::Runout => runout(0.2e3 * s[0] * job.feed_mm, s[1], job.teeth),
            // Scale: with one tooth always engaged, process damping would be half the damping of the structure.
            EffectKind::ProcessDamping => {
                vec![(
                    "process_damping_n_per_m",
                    0.5 * s[0] * machine.damping[(0, 0)] * cut.cutting_speed() / (1e-3 * cut.depth_mm),
                )]
            }
            EffectKind::AxialDepthModulation => vec![("on", s[0])],
            EffectKind::SpeedFluctuation => {
                vec![("delta", 0.02 * s[0]), ("frequency_hz", s[1] * cut.rpm / 60.0)]
            }
            EffectKind::Wear => vec![("relative_rate_per_s", 0.2 * s[0] / scale.seconds)],
            _ => return None,
        })
    }
}

/// Deviations of the radii of the teeth for an offset, µm, at an angle, degrees.
fn radial_m([offset_um, angle_deg]: [f64; 2], teeth: usize) -> Vec<f64> {
    (0..teeth)
        .map(|index| {
            let angle = angle_deg.to_radians() + TAU * index as f64 / teeth as f64;
            1e-6 * offset_um * angle.cos()
        })
        .collect()
}

/// Runout as offset and angle. With two teeth only the component along their line changes their radii and is identifiable.
fn runout(offset_um: f64, angle: f64, teeth: usize) -> Vec<(&'static str, f64)> {
    let (offset_um, angle) = if teeth == 2 {
        let along = offset_um * angle.cos();
        (along.abs(), if along < 0.0 { std::f64::consts::PI } else { 0.0 })
    } else {
        (offset_um, angle)
    };
    vec![("runout_um", offset_um), ("angle_deg", angle.to_degrees())]
}
