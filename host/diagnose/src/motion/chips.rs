//! Where teeth cut along a motion that is known, and how thick a chip each earlier pass leaves them.
//!
//! This is the costly part of the force of a cut, and the same for every tool, material and law that turns alike: it is
//! computed once, and the force of each of them is one pass over its chips.

use std::f64::consts::TAU;

use nalgebra::{Matrix3, Vector3};
use rayon::prelude::*;

use crate::motion::cut_force::CutForce;
use crate::motion::mean_slopes::MeanSlopes;
use crate::motion::spindle_motion::SpindleMotion;
use quietcut_simulate::path::{SampledMotion, interpolated};
use quietcut_simulate::{Cutter, Immersion, Tooth};

/// By which share of its thickness a chip grows for the slope of its force.
const STEP: f64 = 1e-3;
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
pub(crate) struct Chips {
    /// Earlier passes that are looked at.
    passes: usize,
    /// True where all of them count for any tool.
    jumps: bool,
    /// Of each finer sample, for as long as the tooth is in the arc.
    over_samples: Series,
    /// At the samples of the record.
    at_samples: Series,
}

/// Sampling of a record.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Sampling {
    /// Samples per second.
    pub rate_hz: f64,
    /// Samples.
    pub count: usize,
    /// Finer samples per sample.
    pub finer: usize,
    /// Earlier passes that a surface may come from, where teeth jump over several; else as many as teeth in contact need.
    pub passes: Option<usize>,
}

/// How many passes back the surface may come from: a turn and a pass where the teeth differ, else two.
fn passes(teeth: usize, differ: bool) -> usize {
    if differ { teeth + 1 } else { 2.min(teeth + 1) }
}

impl Chips {
    /// The chips along `motion`, and where `at_samples` says so those at the samples of the record as far as it says so.
    pub(crate) fn new(
        cutter: &Cutter,
        spindle_motion: &SpindleMotion,
        motion: &SampledMotion,
        sampling: Sampling,
        at_samples: impl Fn(usize) -> bool + Sync,
    ) -> Self {
        let Sampling {
            rate_hz,
            count,
            finer,
            passes: several,
        } = sampling;
        let along = Along {
            cutter,
            spindle_motion,
            motion,
            passes: passes(cutter.teeth.len(), true).max(several.unwrap_or(0)),
            step_s: 1.0 / (rate_hz * finer as f64),
            end_s: count as f64 / rate_hz,
        };
        Self {
            passes: along.passes,
            jumps: several.is_some(),
            over_samples: series(finer * count, |sample, into| along.over(sample, into)),
            at_samples: series(count, |sample, into| {
                if at_samples(sample) {
                    along.at_instant(sample, sample as f64 / rate_hz, into);
                }
            }),
        }
    }

    /// The force of a tool that turns so along the motion of these chips.
    pub(crate) fn force(
        &self,
        cutter: &Cutter,
        spindle_motion: &SpindleMotion,
        motion: &SampledMotion,
    ) -> CutForce {
        let of = |series, width_s| self.of_series_n(series, width_s, cutter, spindle_motion, motion);
        CutForce {
            mean_n: of(&self.over_samples, motion.step_s),
            sampled_n: of(&self.at_samples, 0.0),
        }
    }

    /// `width_s` is the time that a sample stands for.
    fn of_series_n(
        &self,
        series: &Series,
        width_s: f64,
        cutter: &Cutter,
        spindle_motion: &SpindleMotion,
        motion: &SampledMotion,
    ) -> [Vec<f64>; 3] {
        let (radial_m, passes) = self.standing_out(cutter);
        let chips = || series.chips.iter().zip(series.thickness_m.chunks(self.passes));
        let thickness_m: Vec<f64> = chips()
            .map(|(chip, left_m)| thickness(cutter, &radial_m, chip, &left_m[..passes]).0)
            .collect();
        let in_contact = in_contact(series, &thickness_m, cutter.teeth.len(), width_s);
        let mut sum: [Vec<f64>; 3] = std::array::from_fn(|_| vec![0.0; series.samples]);
        for (chip, (in_contact, thickness_m)) in series.chips.iter().zip(in_contact) {
            if in_contact <= 0.0 {
                continue;
            }
            let depth_m = cutter.depth_at_m(cutter.depth_m, chip.z_m);
            let mut force = cutter.force.force_n(chip.place, thickness_m, depth_m);
            if let (Some(_), Some(radius_m)) = (cutter.force.process_damping, cutter.radius_m) {
                let speed_m_per_s = radius_m * spindle_motion.speed_rad_per_s(chip.t);
                let damping = cutter.force.damping_ns_per_m(chip.place, depth_m, speed_m_per_s);
                let v = at(&motion.v, chip.t / motion.step_s);
                for (force, damping) in force.iter_mut().zip(damping) {
                    *force -= damping[0] * v[0] + damping[1] * v[1] + damping[2] * v[2];
                }
            }
            let factor = in_contact * chip.share * cutter.force.wear(spindle_motion.since_s(chip.t));
            for (sum, force) in sum.iter_mut().zip(force) {
                sum[chip.sample] += factor * force;
            }
        }
        sum
    }

    /// How the force of a tool that turns so answers to a small motion beside the one of these chips.
    pub(crate) fn mean_slopes(&self, cutter: &Cutter, spindle_motion: &SpindleMotion) -> MeanSlopes {
        let (radial_m, passes) = self.standing_out(cutter);
        let series = &self.over_samples;
        let mut means = MeanSlopes::default();
        for (chip, left_m) in series.chips.iter().zip(series.thickness_m.chunks(self.passes)) {
            let (thickness_m, pass) = thickness(cutter, &radial_m, chip, &left_m[..passes]);
            if thickness_m <= 0.0 {
                continue;
            }
            let depth_m = cutter.depth_at_m(cutter.depth_m, chip.z_m);
            let share =
                chip.share * cutter.force.wear(spindle_motion.since_s(chip.t)) / series.samples as f64;
            let at = |thickness_m: f64| Vector3::from(cutter.force.force_n(chip.place, thickness_m, depth_m));
            let step_m = STEP * thickness_m;
            let force_n = at(thickness_m);
            let even = Tooth {
                radial_m: 0.0,
                ..cutter.teeth[chip.tooth]
            };
            let axis = |axis: usize| std::array::from_fn(|other| f64::from(u8::from(other == axis)));
            let normal = Vector3::from_fn(|i, _| cutter.reach_m(&even, chip.place, axis(i)));
            let slope = (at(thickness_m + step_m) - force_n) / step_m * normal.transpose();
            let (mut tooth, mut back_rad) = (chip.tooth, 0.0);
            for _ in 0..=pass {
                back_rad += cutter.teeth[tooth].pitch_rad;
                tooth = cutter.teeth[tooth].ahead;
            }
            means.add(back_rad / TAU * spindle_motion.revolution_s(), share * slope);
            for (axis, square) in means.squares.iter_mut().enumerate() {
                let column = slope.column(axis);
                *square += share
                    * chip.share
                    * cutter.force.wear(spindle_motion.since_s(chip.t))
                    * column
                    * column.transpose();
            }
            if cutter.axial_depth_modulation && depth_m > 0.0 {
                let by_depth = means.direct_n_per_m.column(2) - share * force_n / depth_m;
                means.direct_n_per_m.set_column(2, &by_depth);
            }
            if let (Some(_), Some(radius_m)) = (cutter.force.process_damping, cutter.radius_m) {
                let speed_m_per_s = radius_m * spindle_motion.speed_rad_per_s(chip.t);
                let damping = cutter.force.damping_ns_per_m(chip.place, depth_m, speed_m_per_s);
                means.damping_ns_per_m += share * Matrix3::from_fn(|i, j| damping[i][j]);
            }
        }
        means
    }

    /// How far each tooth stands out along the chip, m, and how many passes back the surface may come from.
    fn standing_out(&self, cutter: &Cutter) -> (Vec<f64>, usize) {
        let radial_m: Vec<f64> = cutter
            .teeth
            .iter()
            .map(|tooth| cutter.reach_m(tooth, cutter.immersion(0.0), [0.0; 3]))
            .collect();
        let differ = radial_m.iter().any(|radial| *radial != radial_m[0]);
        let passes = if self.jumps {
            self.passes
        } else {
            passes(cutter.teeth.len(), differ)
        };
        (radial_m, passes)
    }
}

/// The thickness of a chip, m, and which earlier pass left its surface, counted from the last; not above zero where the tooth is in
/// the air.
fn thickness(cutter: &Cutter, radial_m: &[f64], chip: &Chip, left_m: &[f64]) -> (f64, usize) {
    let mut ahead = chip.tooth;
    let mut thinnest = (f64::INFINITY, 0);
    for (pass, left_m) in left_m.iter().enumerate() {
        ahead = cutter.teeth[ahead].ahead;
        let thickness_m = left_m + radial_m[chip.tooth] - radial_m[ahead];
        if thickness_m < thinnest.0 {
            thinnest = (thickness_m, pass);
        }
    }
    thinnest
}

/// Of every chip the share of its time in which its tooth touches, and its mean thickness there, m: within a sample a chip grows or
/// thins as it does to the next sample of the same tooth, and where it comes to nothing the tooth loses contact.
fn in_contact(series: &Series, thickness_m: &[f64], teeth: usize, width_s: f64) -> Vec<(f64, f64)> {
    let mut all: Vec<(f64, f64)> = thickness_m
        .iter()
        .map(|thickness_m| (f64::from(u8::from(*thickness_m > 0.0)), *thickness_m))
        .collect();
    let mut last: Vec<Option<usize>> = vec![None; teeth];
    for (index, chip) in series.chips.iter().enumerate() {
        let before = last[chip.tooth].replace(index);
        let Some(before) = before.filter(|before| series.chips[*before].sample + 1 == chip.sample) else {
            continue;
        };
        // Both are looked at: the first chip of a pass has none before it.
        let (from, to) = (thickness_m[before], thickness_m[index]);
        let per_s = (to - from) / (chip.t - series.chips[before].t);
        for at in [before, index] {
            let half_m = 0.5 * per_s.abs() * width_s * series.chips[at].share;
            if thickness_m[at].abs() < half_m {
                let share = 0.5 * (1.0 + thickness_m[at] / half_m);
                all[at] = (share, share * half_m);
            }
        }
    }
    all
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
    spindle_motion: &'a SpindleMotion,
    motion: &'a SampledMotion,
    passes: usize,
    step_s: f64,
    end_s: f64,
}

impl Along<'_> {
    /// Every tooth in the arc within a finer sample, only as long as it is there.
    fn over(&self, sample: usize, into: &mut Series) {
        let (cutter, spindle_motion) = (self.cutter, self.spindle_motion);
        let t = sample as f64 * self.step_s;
        let speed = spindle_motion.speed_rad_per_s(t);
        let half = 0.5 * self.step_s * speed;
        let angle = spindle_motion.angle_rad(t);
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
        let angle = self.spindle_motion.angle_rad(t);
        for (number, tooth) in cutter.teeth.iter().enumerate() {
            let from_start = (angle + tooth.angle_rad - cutter.start_rad).rem_euclid(TAU);
            if from_start < cutter.exit_rad - cutter.start_rad {
                self.put(sample, number, 1.0, t, into);
            }
        }
    }

    fn put(&self, sample: usize, number: usize, share: f64, t: f64, into: &mut Series) {
        let (cutter, spindle_motion) = (self.cutter, self.spindle_motion);
        let tooth = &cutter.teeth[number];
        let place = cutter.immersion(spindle_motion.angle_rad(t) + tooth.angle_rad);
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
            let delay_s = spindle_motion.delay_s(t, back_rad);
            let was = at(&self.motion.x, self.recorded(t - delay_s) / self.step_s);
            // The feed axis moves on steadily.
            let feed_m =
                cutter.feed_per_tooth_m * cutter.teeth.len() as f64 * delay_s / spindle_motion.revolution_s();
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
        let revolution_s = self.spindle_motion.revolution_s();
        let later = t + (-t / revolution_s).ceil() * revolution_s;
        if later < self.end_s { later } else { 0.0 }
    }
}

/// A motion between its samples; `place` counts them.
fn at(signal: &[Vec<f64>; 3], place: f64) -> [f64; 3] {
    signal.each_ref().map(|samples| interpolated(samples, place))
}
