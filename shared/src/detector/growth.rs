//! What the passings of one band say: levels, and whether the deviation from the forced orbit grows or dies.

use crate::math::sqrt;
use crate::stroboscope::{Alternation, CAPACITY, Plan, Prediction, Stroboscope, Window};
use crate::synchronous::{Average, CHANNELS, Levels, Passing, SLOTS};

/// The kinds of growth.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// A complex pair of multipliers.
    Hopf,
    /// A real multiplier below −1.
    Flip,
}

/// The largest multiplier.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Multiplier {
    /// |μ| over one tooth period.
    pub abs: f32,
    /// Its standard deviation.
    pub deviation: f32,
    /// arg μ in turns, 0 to ½.
    pub angle_turns: f32,
    /// What it is, if it is outside the unit circle.
    pub kind: Kind,
}

/// What one look at the passings says.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Finding {
    /// Levels, in m/s²: means over some turns.
    pub levels: Levels,
    /// Root mean square of all that moves, over the last few passings, in m/s².
    pub activity: f32,
    /// Passings since the conditions last changed.
    pub passings: u32,
    /// The largest multiplier, where it could be estimated with some certainty.
    pub multiplier: Option<Multiplier>,
    /// What surely grows.
    pub growing: Option<Multiplier>,
    /// What surely dies out: the largest multiplier is below 1.
    pub decaying: bool,
    /// What neither grows nor dies, over the longest window.
    pub persistent: Option<Multiplier>,
    /// Cycles of what grows or persists per tooth period, from its shape within the period.
    pub cycles: Option<f32>,
    /// Interval of confidence of |μ| of the alternating part, where one moves.
    pub alternating: Option<(f32, f32)>,
}

/// The plans that are tried, shortest first. A step from one root to the next must be within the window, and the strides are chosen so that some
/// stride turns any angle well away from 0 and ½.
const PLANS: [Plan; 9] = [
    Plan {
        window: 8,
        order: 2,
        stride: 1,
    },
    Plan {
        window: 11,
        order: 2,
        stride: 1,
    },
    Plan {
        window: 16,
        order: 4,
        stride: 1,
    },
    Plan {
        window: 16,
        order: 2,
        stride: 4,
    },
    Plan {
        window: 24,
        order: 2,
        stride: 6,
    },
    Plan {
        window: 32,
        order: 3,
        stride: 6,
    },
    Plan {
        window: 32,
        order: 2,
        stride: 8,
    },
    Plan {
        window: 48,
        order: 3,
        stride: 8,
    },
    Plan {
        window: CAPACITY,
        order: 3,
        stride: 11,
    },
];

/// Standard deviations between an estimate and the unit circle that make growth sure (together with a second look).
const SURE: f32 = 3.5;
/// The same for the alternating part, which is looked at over two windows.
const ALTERNATION_SURE: f32 = 4.0;
/// Standard deviations for what is no alarm.
const LIKELY: f32 = 2.0;
/// No |μ| is stated sharper than this: the cut itself does not stay the same to more.
const LEAST_DEVIATION: f32 = 5e-4;
/// A multiplier nearer to the positive real axis than this, in turns, is that of a forced orbit that is still moving.
const LEAST_ANGLE: f32 = 0.03;
/// Part of the noise of the sensor that is taken off: the data sheet's figure is typical, and more than is there would blow |μ| up.
const COMPENSATED: f32 = 0.8;
/// The deviation must stand out of the noise of the sensor by this factor to be judged.
const LEAST_SIGNAL: f32 = 3.0;
/// A prediction that leaves more than this part of what it predicts says nothing about growth.
const WORST_FIT: f32 = 0.5;
/// The forced orbit may move by this part of itself within a window, or by this part of the deviation.
const STEADY: f32 = 0.15;
const STEADY_AGAINST_DEVIATION: f32 = 0.3;
/// Nearer than this to the angle of a class, in turns after one revolution, a multiplier is taken for one only while the forced orbit
/// stands still.
const CLASS_ANGLE: f32 = 0.1;
/// and only over a window of so many passings.
const CLASS_WINDOW: usize = 32;
/// Nearer than this to a half turn the angle of a flip and of a Hopf pair cannot be told.
const FLIP_ANGLE: f32 = 0.006;
/// Passings that differ from those of the turn before by so many times the usual mean an entry, an exit, a blow.
const EVENT: f32 = 5.0;
/// A look that finds growth needs another within this many passings.
const SECOND_LOOK: u32 = 4;
/// Passings over which the constant part is learnt, and over which activity is.
const REST_MEMORY: f32 = 64.0;
const ACTIVITY_MEMORY: f32 = 4.0;
/// The alternating part must have moved by this part of itself (root mean square against level) to be judged: a flip that
/// grows out of nothing moves by 0.1 while it grows by a half,
const ALTERNATION_MOVES: f32 = 0.08;
/// and it must grow in so many looks in a row.
const ALTERNATION_LOOKS: u8 = 4;
/// What grows is about as large as it has ever been.
const STILL_GROWS: f32 = 0.97;
/// The shortest window of which the alternating part is taken.
const ALTERNATION_LEAST: usize = 20;
/// Passings after a reset in which the alternating part is not looked at.
const TRANSIENT: usize = 10;
/// Passings whose shape tells the cycles per tooth period.
const SHAPE_WINDOW: usize = 32;
/// |μ| above this, surely, over the longest window is called persistent: what would take more than 130 passings to e-fold.
const PERSISTENT: f32 = 0.9925;

const NOTHING: Finding = Finding {
    levels: Levels {
        forced: 0.0,
        runout: 0.0,
        alternating: 0.0,
        residual: 0.0,
    },
    activity: 0.0,
    passings: 0,
    multiplier: None,
    growing: None,
    decaying: false,
    persistent: None,
    cycles: None,
    alternating: None,
};

/// What the plans say together.
#[derive(Default)]
struct Predictions {
    /// The sharpest.
    best: Option<Prediction>,
    /// The one over the longest window that surely grows.
    growing: Option<Prediction>,
    /// The same, where the forced orbit does not move at all.
    growing_steadily: Option<Prediction>,
    /// The one over all that is remembered, where it surely does not die.
    persistent: Option<Prediction>,
}

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
    /// The largest level of the alternating part since the conditions last changed, in m/s².
    alternated: f32,
    /// Looks in a row in which the alternating part grew.
    alternation_looks: u8,
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
            alternated: 0.0,
            alternation_looks: 0,
            finding: NOTHING,
        }
    }

    /// Forgets the past.
    pub fn reset(&mut self) {
        self.average.reset();
        self.stroboscope.reset();
        self.usual = 0.0;
        self.previous = None;
        self.rest = None;
        self.since_seen = [u32::MAX; 2];
        (self.alternated, self.alternation_looks) = (0.0, 0);
        self.finding = NOTHING;
    }

    /// The newest finding.
    pub fn finding(&self) -> &Finding {
        &self.finding
    }

    /// Takes a passing. `noise` is the mean square of white noise in one channel, in (m/s²)²; `look` false spares the estimates.
    /// True where the conditions have changed with this passing.
    pub fn push(&mut self, tooth: u64, passing: &Passing, noise: f32, teeth: u8, look: bool) -> bool {
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
        let changed = self.is_event(noise, teeth);
        if changed {
            // The passing in which it happened belongs to neither side.
            self.stroboscope.reset();
            self.average.reset();
            self.since_seen = [u32::MAX; 2];
            (self.alternated, self.alternation_looks) = (0.0, 0);
            self.finding = Finding { activity, ..NOTHING };
            return true;
        }
        self.average.update(tooth, passing);
        if self.average.is_filled() {
            self.finding.levels = self.average.levels();
        }
        self.finding.activity = activity;
        self.finding.passings = self.stroboscope.since_reset();
        self.since_seen = self.since_seen.map(|since| since.saturating_add(1));
        if look {
            self.look(noise);
        }
        false
    }

    /// Root mean square of what moves, over the last few passings.
    fn activity(&mut self, passing: &Passing) -> f32 {
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

    fn look(&mut self, noise: f32) {
        let predictions = self.predictions(noise);
        let multiplier = |prediction: Prediction| self.multiplier(&prediction);
        let moves = |m: &Multiplier| m.angle_turns > LEAST_ANGLE;
        // A forced orbit that still moves has the angles of the classes in it, runout included.
        let loose = |m: &Multiplier| {
            moves(m) && from_classes(m.angle_turns, self.stroboscope.classes()) > CLASS_ANGLE
        };
        let strictly = predictions.growing_steadily.map(multiplier).filter(moves);
        let mut seen = strictly.or(predictions.growing.map(multiplier).filter(loose));
        let persistent = predictions.persistent.map(multiplier).filter(moves);
        let best = predictions.best.map(multiplier);
        let alternation = self.alternation(noise);
        let alternating = self.finding.levels.alternating;
        self.alternated = self.alternated.max(alternating);
        let decays = best.is_some_and(|best| best.abs + LIKELY * best.deviation < 1.0);
        match alternation {
            // What beats against the alternation, a pair near −1 that dies, is convex for a while too.
            Some(a)
                if a.least > 1.0
                    && a.change > ALTERNATION_MOVES * alternating
                    && alternating > STILL_GROWS * self.alternated
                    && !decays =>
            {
                self.alternation_looks = self.alternation_looks.saturating_add(1);
                if self.alternation_looks >= ALTERNATION_LOOKS {
                    seen = Some(Multiplier {
                        abs: a.multiplier_abs,
                        deviation: ((a.multiplier_abs - a.least) / ALTERNATION_SURE).max(LEAST_DEVIATION),
                        angle_turns: 0.5,
                        kind: Kind::Flip,
                    });
                }
            }
            _ => self.alternation_looks = 0,
        }
        self.finding.alternating = alternation.map(|a| (a.least, a.most));
        self.finding.decaying = decays;
        self.finding.multiplier = best;
        self.finding.persistent = persistent;
        self.finding.growing = None;
        if let Some(seen) = seen {
            let since = &mut self.since_seen[seen.kind as usize];
            if *since <= SECOND_LOOK {
                self.finding.growing = Some(seen);
            }
            *since = 0;
        }
        self.finding.cycles = self.finding.growing.or(persistent).and_then(|m| self.cycles(&m));
    }

    /// Tries all plans that the passings so far are enough for.
    fn predictions(&self, noise: f32) -> Predictions {
        let mut found = Predictions::default();
        for plan in PLANS {
            let Some(window) = self.stroboscope.window(plan.window) else {
                break;
            };
            let Some(prediction) = window.predict(plan, COMPENSATED * noise) else {
                continue;
            };
            let power = prediction.level * prediction.level;
            let signal = power > LEAST_SIGNAL * LEAST_SIGNAL * noise;
            if !signal || prediction.innovation > WORST_FIT * prediction.level {
                continue;
            }
            if found
                .best
                .is_none_or(|best| prediction.deviation < best.deviation)
            {
                found.best = Some(prediction);
            }
            let surely = prediction.multiplier_abs - SURE * prediction.deviation;
            let forced = self.finding.levels.forced;
            if surely > 1.0 && is_steady(&window, forced, prediction.level, noise) {
                found.growing = Some(prediction);
                if plan.window >= CLASS_WINDOW && is_steady(&window, forced, 0.0, noise) {
                    found.growing_steadily = Some(prediction);
                }
            }
            let likely = prediction.multiplier_abs - LIKELY * prediction.deviation;
            if plan.window == CAPACITY && likely > PERSISTENT {
                found.persistent = Some(prediction);
            }
        }
        found
    }

    /// The multiplier of a prediction, its angle brought back to one tooth period.
    fn multiplier(&self, prediction: &Prediction) -> Multiplier {
        let angle_turns = match self
            .stroboscope
            .window(self.stroboscope.filled().min(SHAPE_WINDOW))
        {
            Some(window) if prediction.stride > 1 => window.unfold(prediction.angle_turns, prediction.stride),
            _ => prediction.angle_turns,
        };
        Multiplier {
            abs: prediction.multiplier_abs,
            deviation: prediction.deviation.max(LEAST_DEVIATION),
            angle_turns,
            kind: if angle_turns > 0.5 - FLIP_ANGLE {
                Kind::Flip
            } else {
                Kind::Hopf
            },
        }
    }

    /// Cycles per tooth period of a deviation with this multiplier.
    fn cycles(&self, multiplier: &Multiplier) -> Option<f32> {
        let window = self
            .stroboscope
            .window(self.stroboscope.filled().min(SHAPE_WINDOW))?;
        match multiplier.kind {
            Kind::Hopf => window.cycles(multiplier.angle_turns),
            Kind::Flip => window.alternating_cycles(),
        }
    }

    /// The alternating part, where it can be trusted: over the longest window without the first passings, in which other multipliers die, and over
    /// the newer half of it; the one that is surer of growth.
    fn alternation(&self, noise: f32) -> Option<Alternation> {
        let filled = self.stroboscope.filled();
        let fresh = (self.stroboscope.since_reset() as usize) < filled + TRANSIENT;
        let longest = if fresh {
            filled - TRANSIENT.min(filled / 3)
        } else {
            filled
        };
        let trusted = |length: usize| {
            let window = self
                .stroboscope
                .window(length)
                .filter(|_| length >= ALTERNATION_LEAST)?;
            let alternation = window.alternation(noise, ALTERNATION_SURE)?;
            (alternation.correlation < 0.5
                && alternation.change * alternation.change > noise / CHANNELS as f32
                && is_steady(&window, self.finding.levels.forced, 0.0, noise)
                && is_still_there(&window, self.finding.levels.forced, noise))
            .then_some(alternation)
        };
        let (long, short) = (trusted(longest), trusted(longest / 2));
        match (long, short) {
            (Some(long), Some(short)) => Some(if short.least > long.least && short.least > 1.0 {
                short
            } else {
                long
            }),
            (long, short) => long.or(short.filter(|short| short.least > 1.0)),
        }
    }
}

/// Distance in turns, after one revolution, of an angle from those of what comes back with each revolution.
fn from_classes(angle_turns: f32, classes: usize) -> f32 {
    let turns = angle_turns * classes as f32;
    (turns - crate::math::round(turns)).abs()
}

/// Whether the forced orbit stays where it is within a window.
fn is_steady(window: &Window<'_>, forced: f32, deviation: f32, noise: f32) -> bool {
    let drift = window.drift();
    let bound = (STEADY * forced).max(STEADY_AGAINST_DEVIATION * deviation);
    drift * drift < bound * bound + chance(noise, window.length() / 2)
}

/// Whether it still is where it was a turn ago.
fn is_still_there(window: &Window<'_>, forced: f32, noise: f32) -> bool {
    let (drift, bound) = (window.recent_drift(), STEADY * forced);
    drift * drift < bound * bound + chance(noise, window.classes())
}

/// Square of the difference of two means of so many passings that noise alone exceeds about never: of 24 channels
/// the mean square is within 2 of 1.
fn chance(noise: f32, passings: usize) -> f32 {
    2.0 * 2.0 * noise / passings.max(1) as f32
}
