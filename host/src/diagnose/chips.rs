//! Where teeth cut along a motion that is known, and how thick a chip each earlier pass leaves them.
//!
//! This is the costly part of the force of a cut, and the same for every tool, material and law that turns alike: it is
//! computed once, and the force of each of them is one pass over its chips.

use std::f64::consts::TAU;

use rayon::prelude::*;

use super::cut::CutForce;
use super::turning::Turning;
use crate::simulate::path::{Motion, between};
use crate::simulate::{Cutter, Immersion, Tooth};

/// Samples that are done at a time.
const AT_A_TIME: usize = 4096;

/// A tooth in the arc of the cut.
#[derive(Clone, Copy, Debug)]
struct Chip {
    /// The sample that it belongs to.
    sample: usize,
    /// Its tooth.
    tooth: usize,
    /// Share of the sample during which the tooth is in the arc.
    share: f64,
    /// The middle of that time, s.
    t: f64,
    place: Immersion,
    /// Axial displacement, m.
    z_m: f64,
}

/// Chips in the order of samples, and behind them the thickness that each earlier pass leaves, m, for teeth of one radius.
#[derive(Clone, Debug, Default)]
struct Series {
    chips: Vec<Chip>,
    thickness_m: Vec<f64>,
    /// Number of samples.
    samples: usize,
}

/// The chips of a record.
#[derive(Clone, Debug)]
pub struct Chips {
    /// Earlier passes that are looked at.
    passes: usize,
    /// Of each finer sample, for as long as the tooth is in the arc.
    over_samples: Series,
    /// At the samples of the record.
    at_samples: Series,
}

/// Sampling of a record.
#[derive(Clone, Copy, Debug)]
pub struct Sampling {
    /// Samples per second.
    pub rate_hz: f64,
    /// Samples.
    pub count: usize,
    /// Finer samples per sample.
    pub finer: usize,
}

/// How many passes back the surface may come from: a turn and a pass where the teeth differ, else two.
fn passes(teeth: usize, differ: bool) -> usize {
    if differ { teeth + 1 } else { 2.min(teeth + 1) }
}

impl Chips {
    /// The chips along `motion`, and where `at_samples` says so those at the samples of the record as far as it says so.
    pub fn new(
        cutter: &Cutter,
        turning: &Turning,
        motion: &Motion,
        sampling: Sampling,
        at_samples: impl Fn(usize) -> bool + Sync,
    ) -> Self {
        let Sampling {
            rate_hz,
            count,
            finer,
        } = sampling;
        let along = Along {
            cutter,
            turning,
            motion,
            passes: passes(cutter.teeth.len(), true),
            step_s: 1.0 / (rate_hz * finer as f64),
            end_s: count as f64 / rate_hz,
        };
        Self {
            passes: along.passes,
            over_samples: series(finer * count, |sample, into| along.over(sample, into)),
            at_samples: series(count, |sample, into| {
                if at_samples(sample) {
                    along.at_instant(sample, sample as f64 / rate_hz, into);
                }
            }),
        }
    }

    /// The force of a tool that turns so along the motion of these chips.
    pub fn force(&self, cutter: &Cutter, turning: &Turning, motion: &Motion) -> CutForce {
        let of = |series| self.of_series_n(series, cutter, turning, motion);
        CutForce {
            mean_n: of(&self.over_samples),
            sampled_n: of(&self.at_samples),
        }
    }

    fn of_series_n(
        &self,
        series: &Series,
        cutter: &Cutter,
        turning: &Turning,
        motion: &Motion,
    ) -> [Vec<f64>; 3] {
        // How far each tooth stands out along the chip.
        let radial_m: Vec<f64> = cutter
            .teeth
            .iter()
            .map(|tooth| cutter.reach_m(tooth, cutter.immersion(0.0), [0.0; 3]))
            .collect();
        let differ = radial_m.iter().any(|radial| *radial != radial_m[0]);
        let passes = passes(cutter.teeth.len(), differ);
        let mut sum: [Vec<f64>; 3] = std::array::from_fn(|_| vec![0.0; series.samples]);
        for (chip, left_m) in series.chips.iter().zip(series.thickness_m.chunks(self.passes)) {
            let mut ahead = chip.tooth;
            let mut thickness_m = f64::INFINITY;
            for left_m in &left_m[..passes] {
                ahead = cutter.teeth[ahead].ahead;
                thickness_m = thickness_m.min(left_m + radial_m[chip.tooth] - radial_m[ahead]);
            }
            if thickness_m <= 0.0 {
                continue;
            }
            let depth_m = cutter.depth_at_m(cutter.depth_m, chip.z_m);
            let mut force = cutter.force.force_n(chip.place, thickness_m, depth_m);
            if let (Some(_), Some(radius_m)) = (cutter.force.process_damping, cutter.radius_m) {
                let speed_m_per_s = radius_m * turning.speed_rad_per_s(chip.t);
                let damping = cutter.force.damping_ns_per_m(chip.place, depth_m, speed_m_per_s);
                let v = at(&motion.v, chip.t / motion.step_s);
                for (force, damping) in force.iter_mut().zip(damping) {
                    *force -= damping[0] * v[0] + damping[1] * v[1] + damping[2] * v[2];
                }
            }
            let factor = chip.share * cutter.force.wear(chip.t);
            for (sum, force) in sum.iter_mut().zip(force) {
                sum[chip.sample] += factor * force;
            }
        }
        sum
    }
}

/// What `of` puts in for each of so many samples.
fn series(samples: usize, of: impl Fn(usize, &mut Series) + Sync) -> Series {
    let parts: Vec<Series> = (0..samples.div_ceil(AT_A_TIME))
        .into_par_iter()
        .map(|part| {
            let mut series = Series::default();
            for sample in part * AT_A_TIME..samples.min((part + 1) * AT_A_TIME) {
                of(sample, &mut series);
            }
            series
        })
        .collect();
    let mut whole = Series {
        samples,
        ..Series::default()
    };
    for part in parts {
        whole.chips.extend(part.chips);
        whole.thickness_m.extend(part.thickness_m);
    }
    whole
}

/// A cut along a motion.
struct Along<'a> {
    cutter: &'a Cutter,
    turning: &'a Turning,
    motion: &'a Motion,
    passes: usize,
    step_s: f64,
    end_s: f64,
}

impl Along<'_> {
    /// Every tooth in the arc within a finer sample, only as long as it is there.
    fn over(&self, sample: usize, into: &mut Series) {
        let (cutter, turning) = (self.cutter, self.turning);
        let t = sample as f64 * self.step_s;
        let speed = turning.speed_rad_per_s(t);
        let half = 0.5 * self.step_s * speed;
        let angle = turning.angle_rad(t);
        let arc = cutter.exit_rad - cutter.start_rad;
        for (number, tooth) in cutter.teeth.iter().enumerate() {
            // From the start of the arc, so that the pass that begins within the sample is not cut in two.
            let from_start = (angle + tooth.angle_rad - cutter.start_rad + half).rem_euclid(TAU) - half;
            let (from, to) = ((from_start - half).max(0.0), (from_start + half).min(arc));
            if to > from {
                let share = (to - from) / (2.0 * half);
                let then = t + (0.5 * (from + to) - from_start) / speed;
                self.put(sample, number, share, then, into);
            }
        }
    }

    /// Every tooth in the arc at an instant.
    fn at_instant(&self, sample: usize, t: f64, into: &mut Series) {
        let cutter = self.cutter;
        let angle = self.turning.angle_rad(t);
        for (number, tooth) in cutter.teeth.iter().enumerate() {
            let from_start = (angle + tooth.angle_rad - cutter.start_rad).rem_euclid(TAU);
            if from_start < cutter.exit_rad - cutter.start_rad {
                self.put(sample, number, 1.0, t, into);
            }
        }
    }

    fn put(&self, sample: usize, number: usize, share: f64, t: f64, into: &mut Series) {
        let (cutter, turning) = (self.cutter, self.turning);
        let tooth = &cutter.teeth[number];
        let place = cutter.immersion(turning.angle_rad(t) + tooth.angle_rad);
        let x = at(&self.motion.x, t / self.step_s);
        let even = |tooth: &Tooth| Tooth {
            radial_m: 0.0,
            ..*tooth
        };
        let reach_m = cutter.reach_m(&even(tooth), place, x);
        let (mut ahead, mut back_rad) = (tooth, 0.0);
        for _ in 0..self.passes {
            back_rad += ahead.pitch_rad;
            ahead = &cutter.teeth[ahead.ahead];
            let delay_s = turning.delay_s(t, back_rad);
            let was = at(&self.motion.x, self.recorded(t - delay_s) / self.step_s);
            // The feed axis moves on steadily.
            let feed_m = cutter.feed_per_tooth_m * cutter.teeth.len() as f64 * delay_s / turning.turn_s();
            let left_m = cutter.reach_m(&even(ahead), place, was) - cutter.recession_m(place, feed_m);
            into.thickness_m.push(reach_m - left_m);
        }
        into.chips.push(Chip {
            sample,
            tooth: number,
            share,
            t,
            place,
            z_m: x[2],
        });
    }

    /// Before the record the motion is taken to have been that of some turns later.
    fn recorded(&self, t: f64) -> f64 {
        if t >= 0.0 {
            return t;
        }
        let turn_s = self.turning.turn_s();
        let later = t + (-t / turn_s).ceil() * turn_s;
        if later < self.end_s { later } else { 0.0 }
    }
}

/// A motion between its samples; `place` counts them.
fn at(signal: &[Vec<f64>; 3], place: f64) -> [f64; 3] {
    signal.each_ref().map(|samples| between(samples, place))
}
