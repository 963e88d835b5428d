//! What the passings of one band say: levels, and whether the deviation from the forced orbit grows or dies.
//!
//! About the forced orbit the deviation x_k of tooth passing k follows an autoregression of order 4 (two pairs of multipliers) with
//! innovations e_k of the broadband cutting force:
//!
//! ```text
//! x_k = a_1·x_{k−1} + … + a_4·x_{k−4} + constant + e_k,       z⁴ = a_1·z³ + … + a_4  has the roots μ
//! ```
//!
//! in every harmonic of the tooth period ([`rows`]). One normal matrix, summed over the channels with the inverse innovation variance of each
//! harmonic as weight, gives a by least squares over the last 8 and the last 64 passings ([`recursion`]). Colour of the noise (a structure that
//! rings) is in a: e_k is white.
//!
//! The hypotheses are H₀: |μ| ≤ 0.95, H₁: |μ| > 0.95, with the same angle and the same other roots. The statistic of a generalized likelihood
//! ratio test (Willsky and Jones, IEEE Trans. Autom. Control 21, 1976, 108; Basseville and Nikiforov, Detection of Abrupt Changes, 1993, 2.4.3)
//! over a window has two parts:
//!
//! ```text
//! Λ = Σ(e₀² − e²)/(2σ_e²)  +  ½·(P/P₀ − 1)
//! ```
//!
//! The first is the growth within the window: e₀ are the prediction errors with the root drawn back to 0.95, σ_e² is the variance of e
//! ([`likelihood`]). The second is what the past of the window has added: a stationary autoregression of power P₀ reaches power P with a
//! density of exp(−P/2P₀). P₀ is learned while all roots decay ([`usual`]). An exponential window in place of the sum since a change is the
//! geometric form of Page's cumulative sum (Biometrika 41, 1954, 100): it needs no memory of past onsets. [`decision`] compares Λ with its threshold.

mod decision;
mod likelihood;
mod recursion;
mod rows;
mod usual;

use crate::criteria::{LEAST_WEIGHT, LONG_MEMORY, SHORT_MEMORY, SURELY_DECAYING, SUSPICION};
use crate::detector::finding::{Finding, GrowthKind, Multiplier};
use crate::math::sqrt;
use crate::stroboscope::Stroboscope;
use crate::synchronous::{Average, CHANNELS, SLOTS, ToothPassing};
use decision::{Decision, Observation};
use likelihood::{Candidate, STABLE, fit, floor};
use recursion::{Recursion, Rows};
use rows::{GROUPS, row};
use usual::Usual;

/// Passings over which the constant part is learnt, and over which activity is.
const REST_MEMORY: f32 = 64.0;
const ACTIVITY_MEMORY: f32 = 4.0;
/// Revolutions and passings for which the means of the classes are held at most while growth is suspected: growth of 2 % per passing
/// becomes threefold in the latter.
const HELD_REVOLUTIONS: u32 = 8;
const HELD_PASSINGS: u32 = 64;
/// Nearer than this to a half turn the angle of a flip and of a Hopf pair cannot be told.
const FLIP_ANGLE: f32 = 0.006;
/// No |μ| is stated sharper than this: the cut itself does not stay the same to more.
const LEAST_DEVIATION: f32 = 5e-4;
/// Passings whose shape tells the cycles per tooth period.
const SHAPE_WINDOW: usize = 32;

/// Looks at the passings of one band.
#[derive(Clone, Debug)]
pub struct Growth {
    average: Average,
    stroboscope: Stroboscope,
    previous: Option<u64>,
    /// What is constant: gravity and offsets, in m/s².
    rest: Option<[f32; 3]>,
    rows: Rows,
    short: Recursion,
    long: Recursion,
    /// Weight of each harmonic, the inverse of its innovation variance; `None` before it is known.
    weights: Option<[f32; GROUPS]>,
    usual: Usual,
    decision: Decision,
    is_suspicious: bool,
    /// Passings for which the means of the classes have been held.
    held: u32,
    finding: Finding,
}

impl Growth {
    /// For a tool with this many teeth.
    pub const fn new(teeth: u8) -> Self {
        Self {
            average: Average::new(teeth),
            stroboscope: Stroboscope::new(teeth),
            previous: None,
            rest: None,
            rows: Rows::new(),
            short: Recursion::new(SHORT_MEMORY),
            long: Recursion::new(LONG_MEMORY),
            weights: None,
            usual: Usual::new(),
            decision: Decision::new(),
            is_suspicious: false,
            held: 0,
            finding: Finding::NOTHING,
        }
    }

    /// Forgets the past.
    pub fn reset(&mut self) {
        self.average.reset();
        self.stroboscope.reset();
        self.rows.reset();
        self.short.reset();
        self.long.reset();
        self.usual = Usual::new();
        self.decision = Decision::new();
        (self.is_suspicious, self.held) = (false, 0);
        (self.previous, self.rest, self.weights) = (None, None, None);
        self.finding = Finding::NOTHING;
    }

    /// The newest finding.
    pub fn finding(&self) -> &Finding {
        &self.finding
    }

    /// The passing a revolution before the next one, of the same tooth; `None` where it is not known.
    pub fn a_revolution_ago(&self) -> Option<ToothPassing> {
        self.stroboscope.a_revolution_ago()
    }

    /// Takes a passing. `noise` is the mean square of white noise in one channel, in (m/s²)². With `evaluate` the finding is brought up to
    /// date, else the passing is only remembered.
    pub fn push(&mut self, tooth: u64, passing: &ToothPassing, noise: f32, teeth: u8, evaluate: bool) {
        if !self.average.is_for(teeth) {
            (self.average, self.stroboscope) = (Average::new(teeth), Stroboscope::new(teeth));
            self.reset();
        }
        if self.previous.is_some_and(|previous| tooth != previous + 1) {
            self.reset();
        }
        self.previous = Some(tooth);
        self.stroboscope.push(tooth, passing);
        self.finding.activity = self.activity(passing);
        if let Some(deviation) = self.average.deviation(tooth, passing)
            && self.rows.push(&row(&deviation))
        {
            self.short.push(&self.rows);
            self.long.push(&self.rows);
        }
        self.follow_classes(tooth, passing, teeth);
        self.finding.passings = self.stroboscope.since_reset();
        if evaluate {
            self.evaluate(noise);
        }
    }

    /// Updates the means of the classes, unless growth is suspected: they would follow it.
    fn follow_classes(&mut self, tooth: u64, passing: &ToothPassing, teeth: u8) {
        let longest = HELD_PASSINGS.max(HELD_REVOLUTIONS * u32::from(teeth));
        if self.is_suspicious && self.held < longest {
            self.held += 1;
            return;
        }
        self.average.update(tooth, passing);
        if !self.is_suspicious {
            self.held = 0;
        }
        if self.average.is_filled() {
            self.finding.levels = self.average.levels();
        }
    }

    /// Root mean square of what moves, over the last few passings.
    fn activity(&mut self, passing: &ToothPassing) -> f32 {
        let mut mean = [0.0; 3];
        for axes in passing.chunks_exact(3) {
            for (mean, value) in mean.iter_mut().zip(axes) {
                *mean += value / SLOTS as f32;
            }
        }
        let rest = self.rest.get_or_insert(mean);
        let mut square = 0.0;
        for axes in passing.chunks_exact(3) {
            for (value, rest) in axes.iter().zip(rest.iter()) {
                square += (value - rest) * (value - rest) / CHANNELS as f32;
            }
        }
        for (rest, mean) in rest.iter_mut().zip(mean) {
            *rest += (mean - *rest) / REST_MEMORY;
        }
        let before = self.finding.activity * self.finding.activity;
        sqrt(before + (square - before) / ACTIVITY_MEMORY)
    }

    fn evaluate(&mut self, noise: f32) {
        (self.finding.growing, self.finding.persistent) = (None, None);
        (self.finding.multiplier, self.finding.decaying) = (None, false);
        if self.short.weight < LEAST_WEIGHT {
            return;
        }
        let weights = self.weights.unwrap_or([1.0 / floor(noise); GROUPS]);
        let recent = self.short.centred();
        let short = fit(&recent, self.short.weight, &weights, floor(noise)).and_then(|fit| fit.candidate);
        let long = fit(&self.long.centred(), self.long.weight, &weights, floor(noise));
        if let Some(long) = &long {
            self.weights = Some(long.innovations.map(|variance| 1.0 / variance));
        }
        let long = long.and_then(|fit| fit.candidate);
        let power = recent.map(|products| (products[0] / self.short.weight).max(floor(noise)));
        let likeliest = match (short, long) {
            (Some(short), Some(long)) if short.against_stable > long.against_stable => Some(short),
            (short, long) => long.or(short),
        };
        self.is_suspicious = likeliest.is_some_and(|c| c.against_stable > SUSPICION && c.abs > 1.0);
        let decays = likeliest.is_none_or(|c| c.abs < SURELY_DECAYING);
        self.usual.follow(&power, decays);
        let observation = Observation {
            likeliest,
            recent: short,
            excess: self.usual.excess(&power, floor(noise)),
            power: power.iter().sum(),
            mean_square: self.short.mean_square(),
            passings: self.finding.passings,
            teeth: self.stroboscope.classes(),
        };
        let growing = self.decision.step(&observation);
        let persistent = long.filter(|c| decision::persists(c, observation.teeth));
        self.state(noise, observation.power, [growing, persistent, long]);
    }

    /// Puts what grows, what persists and the multiplier of the long window into the finding.
    fn state(&mut self, noise: f32, power: f32, [growing, persistent, long]: [Option<Candidate>; 3]) {
        let level = sqrt((power / CHANNELS as f32 - noise).max(0.0));
        let multiplier = |c: Candidate| multiplier(&c, level);
        self.finding.growing = growing.map(multiplier);
        self.finding.persistent = persistent.map(multiplier);
        self.finding.multiplier = long.map(multiplier);
        self.finding.decaying = long.is_some_and(|c| c.abs < SURELY_DECAYING);
        if let Some(moving) = self.finding.growing.or(self.finding.persistent) {
            let window = self
                .stroboscope
                .window(self.stroboscope.filled().min(SHAPE_WINDOW));
            self.finding.cycles = window.and_then(|window| match moving.kind {
                GrowthKind::Hopf => window.cycles(moving.angle_turns),
                GrowthKind::Flip => window.alternating_cycles(),
            });
        }
    }
}

/// A root as a multiplier. Its deviation is that at which the likelihood ratio against [`STABLE`] is z²/2.
fn multiplier(c: &Candidate, level: f32) -> Multiplier {
    let deviation = (c.abs - STABLE).abs() / sqrt(2.0 * c.against_stable.max(0.1));
    Multiplier {
        abs: c.abs,
        deviation: deviation.max(LEAST_DEVIATION),
        angle_turns: c.angle_turns,
        kind: if c.angle_turns > 0.5 - FLIP_ANGLE {
            GrowthKind::Flip
        } else {
            GrowthKind::Hopf
        },
        level,
    }
}
