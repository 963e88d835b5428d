//! Chips: engaged teeth, chip thickness and cutting force.

use std::cell::Cell;
use std::f64::consts::TAU;

use super::disturbance::Disturbance;
use super::job::Job;
use super::law::State;
use super::motion::System;
use super::process::Process;
use super::signal::interpolated;
use super::sliders::Branches;

/// Working point of one cut.
#[derive(Clone, Debug)]
pub(crate) struct Run {
    pub(crate) rpm: f64,
    pub(crate) depth_mm: f64,
    pub(crate) feed_mm: f64,
    /// Spindle angle at the start of the record, rad.
    pub(crate) angle: f64,
    /// Number of passes that teeth in chatter may miss; 0 in stable cuts.
    pub(crate) jumped: usize,
}

/// The chips of one cut.
pub(crate) struct Chips<'a> {
    pub(crate) job: &'a Job,
    pub(crate) run: &'a Run,
    pub(crate) process: Process,
    pub(crate) before_s: f64,
    pub(crate) step_s: f64,
    /// Largest displacement of the tool from its rest position so far, m.
    pub(crate) furthest_m: Cell<f64>,
    pub(crate) disturbance: Option<&'a Disturbance>,
}

impl Chips<'_> {
    /// Spindle angle at time `t` from the start of the cut, rad. The record begins at `before_s`.
    pub(crate) fn angle(&self, t: f64) -> f64 {
        let omega = TAU * self.run.rpm / 60.0;
        let recorded = t - self.before_s;
        let modulation = self.process.fluctuation.map_or(0.0, |[delta, hz, phase]| {
            let rate = TAU * hz;
            delta * omega / rate * (phase.cos() - (rate * recorded + phase).cos())
        });
        let wandered = self
            .disturbance
            .map_or(0.0, |disturbance| disturbance.wandered(recorded, omega));
        self.run.angle + omega * recorded + modulation + wandered
    }

    /// Time at which the spindle is at `angle`, near the time `guess`.
    fn time_at(&self, angle: f64, guess: f64) -> f64 {
        let omega = TAU * self.run.rpm / 60.0;
        let mut t = guess;
        if self.process.fluctuation.is_some() || self.disturbance.is_some() {
            // The speed modulation is about one percent: every iteration gains two digits.
            for _ in 0..8 {
                t -= (self.angle(t) - angle) / omega;
            }
        }
        t
    }

    /// Teeth between entry and exit angle, one bit for each.
    pub(crate) fn engaged(&self, t: f64) -> u32 {
        let [start, exit] = [self.job.start_deg, self.job.exit_deg].map(f64::to_radians);
        (0..self.job.teeth).fold(0, |bits, tooth| {
            let phi = self.immersion(t, tooth);
            if (start..exit).contains(&phi) {
                bits | 1 << tooth
            } else {
                bits
            }
        })
    }

    fn immersion(&self, t: f64, tooth: usize) -> f64 {
        (self.angle(t) + TAU * tooth as f64 / self.job.teeth as f64).rem_euclid(TAU)
    }

    /// Times at which teeth enter or leave between two times, in order.
    pub(crate) fn switches(&self, from: f64, to: f64) -> Vec<f64> {
        let omega = TAU * self.run.rpm / 60.0;
        let mut all = Vec::new();
        for tooth in 0..self.job.teeth {
            let phi = self.immersion(from, tooth);
            for edge in [self.job.start_deg, self.job.exit_deg].map(f64::to_radians) {
                let ahead = (edge - phi).rem_euclid(TAU);
                let t = self.time_at(self.angle(from) + ahead, from + ahead / omega);
                if t > from + 1e-9 * self.step_s && t < to - 1e-9 * self.step_s {
                    all.push(t);
                }
            }
        }
        all.sort_by(f64::total_cmp);
        // One tooth may leave while another enters: their times count as one.
        all.dedup_by(|a, b| *a - *b < 1e-6 * self.step_s);
        all
    }

    /// Advances the state between two times in which no tooth enters or leaves. Steps end when a tooth loses contact with the workpiece or
    /// regains it.
    pub(crate) fn advance(
        &self,
        system: &System,
        [mut from, to]: [f64; 2],
        y: &mut State,
        branches: &mut Branches,
        past: &[[f64; 3]],
    ) {
        let engaged = self.engaged(0.5 * (from + to));
        let mut cutting = self.cutting(from, system.displacement(y), engaged, past);
        // At most sixteen changes of contact per step are resolved.
        for _ in 0..16 {
            let stepped = |to: f64| {
                let (mut after, mut branched) = (*y, branches.clone());
                let force = |t: f64, x: [f64; 3], v: [f64; 3]| self.force(t, x, v, cutting, past);
                system.advance(from, to - from, &mut after, &mut branched, &force);
                let then = self.cutting(to, system.displacement(&after), engaged, past);
                (after, branched, then)
            };
            let (after, branched, then) = stepped(to);
            if then == cutting {
                (*y, *branches) = (after, branched);
                return;
            }
            let (mut inside, mut outside) = (from, to);
            while outside - inside > 1e-7 * self.step_s {
                let middle = 0.5 * (inside + outside);
                if stepped(middle).2 == cutting {
                    inside = middle
                } else {
                    outside = middle
                }
            }
            let (after, branched, then) = stepped(outside);
            (*y, *branches, cutting, from) = (after, branched, then, outside);
            if to - from < 1e-7 * self.step_s {
                return;
            }
        }
        let force = |t: f64, x: [f64; 3], v: [f64; 3]| self.force(t, x, v, cutting, past);
        system.advance(from, to - from, y, branches, &force);
    }

    /// Those of the `engaged` teeth that reach the surface.
    pub(crate) fn cutting(&self, t: f64, x: [f64; 3], engaged: u32, past: &[[f64; 3]]) -> u32 {
        let cuts = |tooth: &usize| engaged & 1 << tooth != 0 && self.chip_m(t, x, *tooth, past) > 0.0;
        (0..self.job.teeth)
            .filter(cuts)
            .fold(0, |bits, tooth| bits | 1 << tooth)
    }

    /// Chip thickness of a tooth: its depth in the surface that all earlier passes left, m; negative without contact.
    fn chip_m(&self, t: f64, x: [f64; 3], tooth: usize, past: &[[f64; 3]]) -> f64 {
        let (sin, cos) = self.immersion(t, tooth).sin_cos();
        let (sin_edge, cos_edge) = self.edge();
        let period = 60.0 / self.run.rpm / self.job.teeth as f64;
        let reach = |x: [f64; 3], tooth: usize| {
            (sin * x[0] + cos * x[1] + self.process.radial_m[tooth]) * sin_edge - cos_edge * x[2]
        };
        let mut chip = f64::INFINITY;
        // With runout, one tooth may be the only one that cuts: one revolution of passes is then evaluated, and one more pass for the
        // vibration.
        let passes = if self.process.radial_m.iter().all(|radial| *radial == 0.0) {
            2
        } else {
            self.job.teeth + 1
        };
        let passes = passes.max(self.run.jumped);
        for pass in 1..=passes {
            let angle = self.angle(t) - TAU * pass as f64 / self.job.teeth as f64;
            let then = self.time_at(angle, t - pass as f64 * period);
            let was = if then <= 0.0 {
                [0.0; 3]
            } else {
                interpolated(past, then / self.step_s)
            };
            // The feed is proportional to time, whatever the speed modulation.
            let fed = 1e-3 * self.run.feed_mm * (t - then) / period;
            if pass > 2 && self.run.jumped > 0 {
                // Earlier passes cannot have left a thinner chip: their surfaces are farther away by the feed.
                let most = 2.0 * self.furthest_m.get()
                    + self.process.radial_m[(tooth + pass) % self.job.teeth].abs();
                if reach(x, tooth) - most + fed * sin * sin_edge > chip {
                    break;
                }
            }
            let left = reach(was, (tooth + pass) % self.job.teeth) - fed * sin * sin_edge;
            chip = chip.min(reach(x, tooth) - left);
            // Before the start of the cut the tool was at rest: one such pass suffices.
            if then <= 0.0 {
                break;
            }
        }
        chip
    }

    /// Sine and cosine of the edge angle (90° is an end mill).
    fn edge(&self) -> (f64, f64) {
        if self.job.edge_angle_deg == 90.0 {
            (1.0, 0.0)
        } else {
            self.job.edge_angle_deg.to_radians().sin_cos()
        }
    }

    /// Force of the teeth in the bit set `cutting` on the tool, N. `past` holds earlier displacements on the integration grid.
    pub(crate) fn force(
        &self,
        t: f64,
        x: [f64; 3],
        v: [f64; 3],
        cutting: u32,
        past: &[[f64; 3]],
    ) -> [f64; 3] {
        let process = &self.process;
        let (sin_edge, cos_edge) = self.edge();
        let depth = (1e-3 * self.run.depth_mm - process.depth_follows * x[2]).max(0.0);
        let worn = 1.0 + process.wear_per_s * (t - self.before_s);
        let mut sum = [0.0; 3];
        for tooth in (0..self.job.teeth).filter(|tooth| cutting & 1 << tooth != 0) {
            let (sin, cos) = self.immersion(t, tooth).sin_cos();
            let chip = self.chip_m(t, x, tooth, past);
            let scattered = self.disturbance.map_or(1.0, |disturbance| {
                let teeth = self.job.teeth;
                disturbance.factor(tooth, teeth, self.angle(t) + TAU * tooth as f64 / teeth as f64)
            });
            // An intermediate stage of a step may lie slightly beyond the end of contact.
            let power = |power: f64, reference: f64| reference * (chip.max(0.0) / reference).powf(power);
            let chip = process
                .exponent
                .map_or(chip, |(exponent, reference)| power(exponent, reference));
            let along = |index: usize, width: f64| {
                scattered
                    * worn
                    * depth
                    * (process.cutting_pa[index] * chip + process.edge_n_per_m[index] / width)
            };
            let (tangential, radial, axial) = (along(0, sin_edge), along(1, sin_edge), along(2, sin_edge));
            let speed = std::f64::consts::PI * 1e-3 * self.job.diameter_mm * self.run.rpm / 60.0;
            let opening = (sin * v[0] + cos * v[1]) * sin_edge - cos_edge * v[2];
            let rubbing = process.damping_n_per_m / speed * depth * opening;
            let inward = radial * sin_edge + axial * cos_edge + rubbing * sin_edge;
            sum[0] += -tangential * cos - inward * sin;
            sum[1] += tangential * sin - inward * cos;
            sum[2] += radial * cos_edge - axial * sin_edge + rubbing * cos_edge;
        }
        sum
    }
}
