//! The force of a recorded cut along a motion that is known.
//!
//! With the measured motion u the chip of every tooth is known: h = min over earlier passes p of
//! n·(u − u(t − pτ)) + (r_j − r_(j+p)) sin γ + p f sin φ sin γ (a surface is what all earlier passes left), and the force of
//! the cut is linear in most of what a process may have otherwise. Between samples the force jumps where teeth enter and
//! leave: what drives the structure is its mean over each finer sample, with entry and exit at their instants.

use rayon::prelude::*;

use super::DiagnoseError;
use super::turning::Turning;
use crate::case::Case;
use crate::milling::Cut;
use crate::recording::Recording;
use crate::simulate::path::Motion;
use crate::simulate::{Cutter, Effects, Spindle, Tooth};

/// Force samples closer to an entry or exit than this share of a sample are not compared: the tachometer does not say on
/// which side they are.
const BESIDE: f64 = 0.25;

/// A recorded cut.
#[derive(Clone, Debug)]
pub struct RecordedCut {
    /// The tool in its cut, as the case has it.
    pub cutter: Cutter,
    /// How the spindle turns.
    pub turning: Turning,
    /// Samples per second.
    rate_hz: f64,
    /// Samples of the record.
    count: usize,
}

/// The force of a cut, N, in the machine's axes.
#[derive(Clone, Debug)]
pub struct CutForce {
    /// Its mean over each finer sample.
    pub mean_n: [Vec<f64>; 3],
    /// At the samples of the record; 0 at those beside an entry or an exit.
    pub sampled_n: [Vec<f64>; 3],
}

impl CutForce {
    /// This less `other`, over `divisor`.
    pub fn difference(&self, other: &Self, divisor: f64) -> Self {
        let of = |a: &[Vec<f64>; 3], b: &[Vec<f64>; 3]| {
            std::array::from_fn(|axis| {
                a[axis]
                    .iter()
                    .zip(&b[axis])
                    .map(|(a, b)| (a - b) / divisor)
                    .collect()
            })
        };
        Self {
            mean_n: of(&self.mean_n, &other.mean_n),
            sampled_n: of(&self.sampled_n, &other.sampled_n),
        }
    }
}

/// How a cut may differ from the one that is believed.
#[derive(Clone, Debug)]
pub struct Variation {
    /// The tool.
    pub cutter: Cutter,
    /// The turning.
    pub turning: Turning,
}

impl RecordedCut {
    /// The cut of a recording: working point from its sidecar, the rest from the case with its extensions.
    ///
    /// # Errors
    /// The case has no tool, material or cut, the sidecar no depth, the recording no tachometer; an extension that cannot be.
    pub fn new(case: &Case, effects: &Effects, recording: &Recording) -> Result<Self, DiagnoseError> {
        let (tool, material, believed) = (case.tool()?, case.material()?, case.cut()?);
        let said = recording.sidecar.cut.unwrap_or_default();
        let depth_mm = said.axial_depth_mm.ok_or_else(|| {
            recording.lacks("axial_depth_mm under [cut] in the .toml beside it, the depth that was cut")
        })?;
        let cut = Cut {
            start_deg: said.start_deg.unwrap_or(believed.start_deg),
            exit_deg: said.exit_deg.unwrap_or(believed.exit_deg),
            feed_per_tooth_mm: said.feed_per_tooth_mm.unwrap_or(believed.feed_per_tooth_mm),
            feed_direction_deg: believed.feed_direction_deg,
        };
        if let Some(teeth) = said.teeth.filter(|teeth| *teeth as usize != tool.teeth) {
            return Err(DiagnoseError::record(
                &recording.path,
                format!(
                    "[cut] says {teeth} teeth, the case {}: they are not of the same tool",
                    tool.teeth
                ),
            ));
        }
        let wrong = |error| DiagnoseError::simulate(&case.path, error);
        let cutter = Cutter::new(tool, material, &cut, 1e-3 * depth_mm)
            .and_then(|cutter| effects.cutter(cutter))
            .map_err(wrong)?;
        let turning = Turning::new(recording, effects.spindle(Spindle::new(1.0)).fluctuation())?;
        if let Some(rpm) = said.spindle_rpm
            && (turning.rpm() / rpm - 1.0).abs() > 0.05
        {
            return Err(DiagnoseError::record(
                &recording.path,
                format!(
                    "tacho says {:.1} rev/min, the .toml beside it {rpm}: is pulses_per_rev of the tachometer right?",
                    turning.rpm()
                ),
            ));
        }
        Ok(Self {
            cutter,
            turning,
            rate_hz: recording.sample_rate_hz,
            count: recording.len(),
        })
    }

    /// The cut as it is believed.
    pub fn believed(&self) -> Variation {
        Variation {
            cutter: self.cutter.clone(),
            turning: self.turning.clone(),
        }
    }

    /// The force along `motion`, whose samples are `finer` times as dense as those of the record.
    pub fn force(&self, variation: &Variation, motion: &Motion, finer: usize) -> CutForce {
        let along = Along {
            variation,
            motion,
            passes: passes(&variation.cutter),
            step_s: 1.0 / (self.rate_hz * finer as f64),
            end_s: self.count as f64 / self.rate_hz,
        };
        let means: Vec<[f64; 3]> = (0..finer * self.count)
            .into_par_iter()
            .map(|index| along.mean_n(index))
            .collect();
        let sampled: Vec<[f64; 3]> = (0..self.count)
            .into_par_iter()
            .map(|sample| {
                let t = sample as f64 / self.rate_hz;
                if self.is_beside(t) {
                    [0.0; 3]
                } else {
                    along.force_n(t)
                }
            })
            .collect();
        let by_axis =
            |samples: &[[f64; 3]]| std::array::from_fn(|axis| samples.iter().map(|x| x[axis]).collect());
        CutForce {
            mean_n: by_axis(&means),
            sampled_n: by_axis(&sampled),
        }
    }

    /// True where a tooth enters or leaves within `BESIDE` of a sample of `t`.
    pub fn is_beside(&self, t: f64) -> bool {
        let near_rad = BESIDE / self.rate_hz * self.turning.speed_rad_per_s(t);
        self.cutter.teeth.iter().any(|tooth| {
            let phi = self.turning.angle_rad(t) + tooth.angle_rad;
            [self.cutter.start_rad, self.cutter.exit_rad]
                .into_iter()
                .any(|edge| {
                    let apart = (phi - edge).rem_euclid(std::f64::consts::TAU);
                    apart < near_rad || apart > std::f64::consts::TAU - near_rad
                })
        })
    }
}

/// How many passes back the surface may come from: a turn where the teeth differ, else the last one.
fn passes(cutter: &Cutter) -> usize {
    let count = cutter.teeth.len();
    let differ = cutter
        .teeth
        .iter()
        .any(|tooth| tooth.radial_m != cutter.teeth[0].radial_m);
    if differ { count + 1 } else { 2.min(count + 1) }
}

/// A cut along a motion.
struct Along<'a> {
    variation: &'a Variation,
    motion: &'a Motion,
    passes: usize,
    step_s: f64,
    end_s: f64,
}

impl Along<'_> {
    /// The mean over a finer sample, with every tooth only as long as it is in the arc.
    fn mean_n(&self, index: usize) -> [f64; 3] {
        let Variation { cutter, turning } = self.variation;
        let t = index as f64 * self.step_s;
        let speed = turning.speed_rad_per_s(t);
        let half = 0.5 * self.step_s * speed;
        let angle = turning.angle_rad(t);
        let arc = cutter.exit_rad - cutter.start_rad;
        let mut sum = [0.0; 3];
        for tooth in &cutter.teeth {
            // From the start of the arc, so that the pass that begins within the sample is not cut in two.
            let into =
                (angle + tooth.angle_rad - cutter.start_rad + half).rem_euclid(std::f64::consts::TAU) - half;
            let (from, to) = ((into - half).max(0.0), (into + half).min(arc));
            if to > from {
                let share = (to - from) / (2.0 * half);
                let then = t + (0.5 * (from + to) - into) / speed;
                let force = self.of_tooth_n(tooth, then);
                for (sum, force) in sum.iter_mut().zip(force) {
                    *sum += share * force;
                }
            }
        }
        sum
    }

    /// The force at an instant.
    fn force_n(&self, t: f64) -> [f64; 3] {
        let Variation { cutter, turning } = self.variation;
        let angle = turning.angle_rad(t);
        let arc = cutter.exit_rad - cutter.start_rad;
        let mut sum = [0.0; 3];
        for tooth in &cutter.teeth {
            let into = (angle + tooth.angle_rad - cutter.start_rad).rem_euclid(std::f64::consts::TAU);
            if into < arc {
                for (sum, force) in sum.iter_mut().zip(self.of_tooth_n(tooth, t)) {
                    *sum += force;
                }
            }
        }
        sum
    }

    /// The force of a tooth in the arc.
    fn of_tooth_n(&self, tooth: &Tooth, t: f64) -> [f64; 3] {
        let Variation { cutter, turning } = self.variation;
        let place = cutter.immersion(turning.angle_rad(t) + tooth.angle_rad);
        let x = self.at(&self.motion.x, t);
        let mut thickness_m = f64::INFINITY;
        let (mut ahead, mut back_rad) = (tooth, 0.0);
        for _ in 0..self.passes {
            back_rad += ahead.pitch_rad;
            ahead = &cutter.teeth[ahead.ahead];
            let delay_s = turning.delay_s(t, back_rad);
            let was = self.at(&self.motion.x, self.recorded(t - delay_s));
            // The feed axis moves on steadily.
            let feed_m = cutter.feed_per_tooth_m * cutter.teeth.len() as f64 * delay_s / turning.turn_s();
            let left_m = cutter.reach_m(ahead, place, was) - cutter.recession_m(place, feed_m);
            thickness_m = thickness_m.min(cutter.reach_m(tooth, place, x) - left_m);
        }
        if thickness_m <= 0.0 {
            return [0.0; 3];
        }
        let depth_m = cutter.depth_at_m(cutter.depth_m, x[2]);
        let mut force = cutter.force.force_n(place, thickness_m, depth_m);
        if let (Some(_), Some(radius_m)) = (cutter.force.process_damping, cutter.radius_m) {
            let speed_m_per_s = radius_m * turning.speed_rad_per_s(t);
            let damping = cutter.force.damping_ns_per_m(place, depth_m, speed_m_per_s);
            let v = self.at(&self.motion.v, t);
            for (force, damping) in force.iter_mut().zip(damping) {
                *force -= damping[0] * v[0] + damping[1] * v[1] + damping[2] * v[2];
            }
        }
        force.map(|force| force * cutter.force.wear(t))
    }

    /// Before the record the motion is taken to have been that of some turns later.
    fn recorded(&self, t: f64) -> f64 {
        if t >= 0.0 {
            return t;
        }
        let turn_s = self.variation.turning.turn_s();
        let later = t + (-t / turn_s).ceil() * turn_s;
        if later < self.end_s { later } else { 0.0 }
    }

    /// A signal between its samples, by a cubic through four of them.
    fn at(&self, signal: &[Vec<f64>; 3], t: f64) -> [f64; 3] {
        let place = t / self.step_s;
        let index = place.floor().max(0.0) as usize;
        let u = place - index as f64;
        std::array::from_fn(|axis| {
            let samples = &signal[axis];
            let Some(last) = samples.len().checked_sub(1) else {
                return 0.0;
            };
            let of = |index: usize| samples[index.min(last)];
            let (a, b, c, d) = (
                of(index.saturating_sub(1)),
                of(index),
                of(index + 1),
                of(index + 2),
            );
            b + 0.5 * u * (c - a + u * (2.0 * a - 5.0 * b + 4.0 * c - d + u * (3.0 * (b - c) + d - a)))
        })
    }
}
