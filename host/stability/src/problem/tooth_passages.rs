//! Entry, exit and delay of each tooth, for methods that step through the period.

use std::f64::consts::TAU;

use nalgebra::{Matrix3, Vector3};

use super::pitched::Pitched;

/// Passage of one tooth through the cut.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct ToothPassage {
    /// Time at which the tooth enters the cut, s from the start of the period; may lie before it.
    pub(crate) entry_s: f64,
    /// Time at which the tooth leaves the cut, s from the start of the period; may lie after its end.
    pub(crate) exit_s: f64,
    /// Regenerative delay τ, s: the time since the preceding tooth had the same immersion angle.
    pub(crate) delay_s: f64,
    /// Feed of the tool during the regenerative delay of this tooth, m.
    pub(crate) feed_m: f64,
    /// Index of the tooth on the tool; 0 if the period is the tooth period.
    pub(crate) tooth: usize,
    /// Index of the tooth that cut the surface in front of this one; 0 if the period is the tooth period.
    pub(crate) before: usize,
}

/// Passages of all teeth that cut within one period, at one spindle speed.
///
/// The period is the tooth period, or the revolution if the problem has it as its period (as for unequal pitch). It
/// starts at the entry of a tooth.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct ToothPassages {
    /// Period T, s.
    pub(crate) period_s: f64,
    /// Spindle speed, rad/s.
    pub(crate) rad_per_s: f64,
    /// Passages of the teeth by time of entry, latest first.
    pub(crate) list: Vec<ToothPassage>,
}

impl ToothPassages {
    /// Passages of all teeth through the cut at a spindle speed in rev/min.
    pub(crate) fn new(pitched: &Pitched, rpm: f64) -> Self {
        let rad_per_s = rpm * TAU / 60.0;
        match &pitched.pitch_rad {
            None => Self::of_tooth_period(pitched, rad_per_s),
            Some(pitch_rad) => Self::of_revolution(pitched, pitch_rad, rad_per_s),
        }
    }

    fn of_tooth_period(pitched: &Pitched, rad_per_s: f64) -> Self {
        let process = &pitched.problem.process;
        let period_s = process.engagement.pitch / rad_per_s;
        let width_s = (process.engagement.exit - process.engagement.start) / rad_per_s;
        // A tooth of the preceding period that leaves within rounding of the start of this period does not cut in it.
        let count = (width_s / period_s - 1e-9).ceil().max(1.0) as usize;
        let list = (0..count).map(|index| {
            let entry_s = -(index as f64) * period_s;
            ToothPassage {
                entry_s,
                exit_s: entry_s + width_s,
                delay_s: period_s,
                feed_m: process.feed_per_tooth_m,
                tooth: 0,
                before: 0,
            }
        });
        Self {
            period_s,
            rad_per_s,
            list: list.collect(),
        }
    }

    fn of_revolution(pitched: &Pitched, pitch_rad: &[f64], rad_per_s: f64) -> Self {
        let process = &pitched.problem.process;
        let width_s = (process.engagement.exit - process.engagement.start) / rad_per_s;
        let count = pitch_rad.len();
        let period_s = TAU / rad_per_s;
        let mut list = Vec::with_capacity(2 * count);
        // Tooth j is ahead of tooth 0 by the angle ψ_j = Σ_{1 ≤ k ≤ j} pitch_k; tooth 0 enters at time 0.
        let mut ahead_rad = 0.0;
        for tooth in 0..count {
            if tooth > 0 {
                ahead_rad += pitch_rad[tooth];
            }
            let before = (tooth + 1) % count;
            let enters_s = if tooth == 0 {
                0.0
            } else {
                period_s - ahead_rad / rad_per_s
            };
            for entry_s in [enters_s, enters_s - period_s] {
                list.push(ToothPassage {
                    entry_s,
                    exit_s: entry_s + width_s,
                    delay_s: pitch_rad[before] / rad_per_s,
                    feed_m: process.feed_per_tooth_m * pitch_rad[before] / process.engagement.pitch,
                    tooth,
                    before,
                });
            }
        }
        list.retain(|passage| passage.exit_s > 1e-9 * period_s);
        list.sort_by(|a, b| b.entry_s.total_cmp(&a.entry_s));
        Self {
            period_s,
            rad_per_s,
            list,
        }
    }

    /// Times at which a tooth enters or leaves the cut, s, ascending, with both ends of the period.
    pub(crate) fn switches_s(&self) -> Vec<f64> {
        let ends = self
            .list
            .iter()
            .flat_map(|passage| [passage.entry_s, passage.exit_s]);
        distinct(ends.chain([0.0, self.period_s]).collect(), self.period_s)
    }

    /// Passages of the teeth that cut at a time, s, without those that enter or leave just then.
    pub(crate) fn cutting_at(&self, time_s: f64) -> impl Iterator<Item = &ToothPassage> {
        self.list
            .iter()
            .filter(move |passage| passage.entry_s < time_s && time_s < passage.exit_s)
    }

    /// Immersion angle of the tooth of a passage at a time (s), rad.
    pub(crate) fn angle(&self, pitched: &Pitched, passage: &ToothPassage, time_s: f64) -> f64 {
        pitched.problem.process.engagement.start + (time_s - passage.entry_s) * self.rad_per_s
    }
}

/// Sorts times and drops those outside [0, period], s; times closer than rounding are merged.
pub(crate) fn distinct(mut times_s: Vec<f64>, period_s: f64) -> Vec<f64> {
    // Immersion angles are given in degrees with a few digits: times closer than 1e-9 of the period belong to the same
    // angle.
    let least = 1e-9 * period_s;
    for time_s in &mut times_s {
        if time_s.abs() < least {
            *time_s = 0.0;
        } else if (*time_s - period_s).abs() < least {
            *time_s = period_s;
        }
    }
    times_s.retain(|time_s| (0.0..=period_s).contains(time_s));
    times_s.sort_by(f64::total_cmp);
    times_s.dedup_by(|later, earlier| *later - *earlier < least);
    times_s
}

/// Force per displacement of the cut (force coefficients), at one time or averaged over an interval of time.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Coefficients {
    /// For each regenerative delay: the delay, s, and the sum Σ K α of cutting coefficient times directional
    /// coefficients over the teeth with that delay, Pa.
    pub(crate) regenerative: Vec<(f64, Matrix3<f64>)>,
    /// Coefficient β_e + β_f of edge and feed forces −β u, N/m (eq. 3.7); only the axial displacement contributes.
    pub(crate) modulation: Matrix3<f64>,
}

impl Coefficients {
    /// Weighted mean of the force coefficients over `nodes` (time in s, weight), of those passages that cut at the time
    /// `inside_s`.
    pub(crate) fn mean(
        pitched: &Pitched,
        passages: &ToothPassages,
        inside_s: f64,
        nodes: impl Iterator<Item = (f64, f64)> + Clone,
    ) -> Self {
        let process = &pitched.problem.process;
        let mut coefficients = Self {
            regenerative: Vec::new(),
            modulation: Matrix3::zeros(),
        };
        for passage in passages.cutting_at(inside_s) {
            let mut directional = Matrix3::zeros();
            let mut forced = Vector3::zeros();
            for (time_s, share) in nodes.clone() {
                let angle = passages.angle(pitched, passage, time_s);
                directional += process.force.directional(angle) * share;
                if process.axial_depth_modulation {
                    forced += process.force.forced(angle, passage.feed_m) * share;
                }
            }
            let mut column = coefficients.modulation.column_mut(2);
            column += forced;
            let same = coefficients
                .regenerative
                .iter_mut()
                .find(|(delay_s, _)| (delay_s - passage.delay_s).abs() < 1e-12 * passage.delay_s);
            match same {
                Some((_, sum)) => *sum += directional,
                None => coefficients.regenerative.push((passage.delay_s, directional)),
            }
        }
        coefficients
    }

    /// Force per present displacement, w Σ K α − β, N/m, at an axial depth w, m; the force per delayed displacement is
    /// excluded.
    pub(crate) fn present(&self, depth_m: f64) -> Matrix3<f64> {
        let regenerative: Matrix3<f64> = self.regenerative.iter().map(|(_, directional)| directional).sum();
        regenerative * depth_m - self.modulation
    }
}
