//! What the passings of one band say: levels, and whether the deviation from the forced orbit grows or dies.

mod alternating;
mod fast;
mod slow;
mod steadiness;

use crate::detector::finding::{Finding, GrowthKind, Multiplier};
use crate::math::sqrt;
use crate::stroboscope::Stroboscope;
use crate::synchronous::{Average, CHANNELS, SLOTS, ToothPassing};
use alternating::AlternatingGrowth;
use fast::Predictions;
use slow::SlowGrowth;
use steadiness::LIKELY;

/// How closely a passing is looked at: what that costs.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Evaluation {
    /// It is only remembered.
    None,
    /// Fast growth and what alternates.
    Quick,
    /// Slow growth too.
    Close,
}

/// Passings that differ from those of the turn before by so many times the usual mean an entry, an exit, a blow.
const EVENT: f32 = 5.0;
/// |μ| of growth that linear prediction may call where the fit of slow growth sees that angle too: this one e-folds in 33 passings, and
/// over its few passings a vibration that noise drives looks like anything slower.
const FAST: f32 = 1.03;
/// A look that finds fast growth needs another within this many passings.
const SECOND_LOOK: u32 = 4;
/// Passings over which the constant part is learnt, and over which activity is.
const REST_MEMORY: f32 = 64.0;
const ACTIVITY_MEMORY: f32 = 4.0;

/// Looks at the passings of one band.
#[derive(Clone, Debug)]
pub struct Growth {
    average: Average,
    stroboscope: Stroboscope,
    /// Usual difference from turn to turn, in m/s².
    usual: f32,
    previous: Option<u64>,
    /// What is constant: gravity and offsets, in m/s².
    rest: Option<[f32; 3]>,
    /// Passings since growth of each kind was last seen.
    since_seen: [u32; 2],
    alternating: AlternatingGrowth,
    slow: SlowGrowth,
    finding: Finding,
}

impl Growth {
    /// For a tool with this many teeth.
    pub const fn new(teeth: u8) -> Self {
        Self {
            average: Average::new(teeth),
            stroboscope: Stroboscope::new(teeth),
            usual: 0.0,
            previous: None,
            rest: None,
            since_seen: [u32::MAX; 2],
            alternating: AlternatingGrowth::new(),
            slow: SlowGrowth::new(),
            finding: Finding::NOTHING,
        }
    }

    /// Forgets the past.
    pub fn reset(&mut self) {
        self.forget_cut();
        self.usual = 0.0;
        self.previous = None;
        self.rest = None;
        self.finding = Finding::NOTHING;
    }

    /// Forgets what was before the conditions changed.
    fn forget_cut(&mut self) {
        self.average.reset();
        self.stroboscope.reset();
        self.since_seen = [u32::MAX; 2];
        self.alternating = AlternatingGrowth::new();
        self.slow = SlowGrowth::new();
    }

    /// The newest finding.
    pub fn finding(&self) -> &Finding {
        &self.finding
    }

    /// The passing a revolution before the next one, of the same tooth; `None` where it is not known.
    pub fn a_revolution_ago(&self) -> Option<ToothPassing> {
        self.stroboscope.a_revolution_ago()
    }

    /// Takes a passing. `noise` is the mean square of white noise in one channel, in (m/s²)².
    /// True where the conditions have changed with this passing.
    pub fn push(
        &mut self,
        tooth: u64,
        passing: &ToothPassing,
        noise: f32,
        teeth: u8,
        look: Evaluation,
    ) -> bool {
        if !self.average.is_for(teeth) {
            (self.average, self.stroboscope) = (Average::new(teeth), Stroboscope::new(teeth));
            self.reset();
        }
        if self.previous.is_some_and(|previous| tooth != previous + 1) {
            self.reset();
        }
        self.previous = Some(tooth);
        self.stroboscope.push(tooth, passing);
        let activity = self.activity(passing);
        if self.is_event(noise, teeth) {
            // The passing in which it happened belongs to neither side.
            self.forget_cut();
            self.finding = Finding {
                activity,
                ..Finding::NOTHING
            };
            return true;
        }
        self.average.update(tooth, passing);
        if self.average.is_filled() {
            self.finding.levels = self.average.levels();
        }
        self.finding.activity = activity;
        self.finding.passings = self.stroboscope.since_reset();
        self.since_seen = self.since_seen.map(|since| since.saturating_add(1));
        if look >= Evaluation::Quick {
            self.look(noise, look);
        }
        false
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

    /// Whether the newest passing differs from the one a turn before by far more than usual.
    fn is_event(&mut self, noise: f32, teeth: u8) -> bool {
        let Some(turn) = self.stroboscope.window(usize::from(teeth) + 1) else {
            return false;
        };
        let square = crate::synchronous::distance_square(turn.row(0), turn.row(usize::from(teeth)));
        let difference = sqrt(square / CHANNELS as f32);
        let floor = sqrt(2.0 * noise);
        let usual = self.usual.max(floor);
        let event =
            self.usual > 0.0 && difference > EVENT * usual && difference > 0.25 * self.finding.levels.forced;
        self.usual = if event || self.usual == 0.0 {
            difference
        } else {
            self.usual + 0.125 * (difference - self.usual)
        };
        event
    }

    fn look(&mut self, noise: f32, look: Evaluation) {
        let levels = self.finding.levels;
        let Predictions {
            best,
            growing,
            persistent,
        } = Predictions::new(&self.stroboscope, levels.forced, noise);
        let growing =
            growing.filter(|m| look < Evaluation::Close || m.abs > FAST || !self.slow.sees(m.angle_turns));
        let decays = best.is_some_and(|best| best.abs + LIKELY * best.deviation < 1.0);
        let alternating = self.alternating.look(
            &self.stroboscope,
            levels.alternating,
            levels.forced,
            noise,
            decays,
        );
        self.finding.alternating = alternating.interval;
        self.finding.decaying = decays;
        self.finding.multiplier = best;
        self.finding.persistent = persistent;
        self.finding.growing = self.second_look(alternating.growing.or(growing));
        let moving = self.finding.growing.or(persistent);
        self.finding.cycles = moving.and_then(|m| fast::cycles(&self.stroboscope, &m));
        if look == Evaluation::Close
            && let Some((multiplier, cycles)) = self.look_for_slow_growth(best)
        {
            self.finding.growing = Some(multiplier);
            self.finding.cycles = cycles;
        }
    }

    /// What was seen growing, where it was seen not long ago too.
    fn second_look(&mut self, seen: Option<Multiplier>) -> Option<Multiplier> {
        let seen = seen?;
        let since = self.since_seen.get_mut(seen.kind as usize)?;
        let again = *since <= SECOND_LOOK;
        *since = 0;
        again.then_some(seen)
    }

    fn look_for_slow_growth(&mut self, best: Option<Multiplier>) -> Option<(Multiplier, Option<f32>)> {
        let window = self.stroboscope.window(self.stroboscope.filled())?;
        let Finding {
            passings,
            levels,
            growing,
            ..
        } = self.finding;
        let predicted = best.map(|best| best.angle_turns);
        let slow = self.slow.look(&window, passings, predicted, levels.forced);
        // A flip is told by what alternates.
        slow.filter(|_| growing.is_none_or(|growing| growing.kind == GrowthKind::Hopf))
    }
}
