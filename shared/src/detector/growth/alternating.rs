//! Growth of what alternates from tooth to tooth, where runout may alternate too.

use super::steadiness::{LEAST_DEVIATION, STEADY, chance, is_steady};
use crate::detector::finding::{GrowthKind, Multiplier};
use crate::stroboscope::{Alternation, Stroboscope, Window};
use crate::synchronous::CHANNELS;

/// Standard deviations between an estimate and the unit circle that make growth sure; two windows are looked at.
const SURE: f32 = 4.0;
/// The alternating part must have moved by this part of itself (root mean square against level) to be judged: a flip that
/// grows out of nothing moves by 0.1 while it grows by a half,
const MOVES: f32 = 0.08;
/// and it must grow in so many looks in a row.
const LOOKS: u8 = 4;
/// What grows is about as large as it has ever been.
const STILL_GROWS: f32 = 0.97;
/// The shortest window of which the alternating part is taken.
const LEAST_LENGTH: usize = 20;
/// Passings after a reset in which the alternating part is not looked at.
const TRANSIENT: usize = 10;
/// Residuals that follow each other more than this are those of something else that moves.
const CORRELATED: f32 = 0.5;

/// Follows what alternates.
#[derive(Clone, Copy, Debug)]
pub(super) struct AlternatingGrowth {
    /// The largest level since the conditions last changed, in m/s².
    largest: f32,
    /// Looks in a row in which it grew.
    looks: u8,
}

/// What a look at it said.
pub(super) struct Alternating {
    /// The flip that surely grows.
    pub(super) growing: Option<Multiplier>,
    /// Interval of confidence of |μ|.
    pub(super) interval: Option<(f32, f32)>,
}

impl AlternatingGrowth {
    pub(super) const fn new() -> Self {
        Self {
            largest: 0.0,
            looks: 0,
        }
    }

    /// Takes all passings since the conditions last changed, the level of the alternating part and of the forced vibration, and the
    /// mean square of white noise in one channel. `decays` is true where linear prediction sees all die.
    pub(super) fn look(
        &mut self,
        stroboscope: &Stroboscope,
        level: f32,
        forced: f32,
        noise: f32,
        decays: bool,
    ) -> Alternating {
        let found = trusted(stroboscope, forced, noise);
        self.largest = self.largest.max(level);
        let grows = found.filter(|a| {
            // What beats against the alternation, a pair near −1 that dies, is convex for a while too.
            a.least > 1.0 && a.change > MOVES * level && level > STILL_GROWS * self.largest && !decays
        });
        self.looks = if grows.is_some() {
            self.looks.saturating_add(1)
        } else {
            0
        };
        Alternating {
            growing: grows.filter(|_| self.looks >= LOOKS).map(|a| Multiplier {
                abs: a.multiplier_abs,
                deviation: ((a.multiplier_abs - a.least) / SURE).max(LEAST_DEVIATION),
                angle_turns: 0.5,
                kind: GrowthKind::Flip,
                level,
            }),
            interval: found.map(|a| (a.least, a.most)),
        }
    }
}

/// The alternating part, where it can be trusted: over the longest window without the first passings, in which other multipliers die, and over
/// the newer half of it; the one that is surer of growth.
fn trusted(stroboscope: &Stroboscope, forced: f32, noise: f32) -> Option<Alternation> {
    let filled = stroboscope.filled();
    let fresh = (stroboscope.since_reset() as usize) < filled + TRANSIENT;
    let longest = if fresh {
        filled - TRANSIENT.min(filled / 3)
    } else {
        filled
    };
    let look = |length: usize| {
        let window = stroboscope.window(length).filter(|_| length >= LEAST_LENGTH)?;
        let alternation = window.alternation(noise, SURE)?;
        (alternation.correlation < CORRELATED
            && alternation.change * alternation.change > noise / CHANNELS as f32
            && is_steady(&window, forced, 0.0, noise)
            && is_still_there(&window, forced, noise))
        .then_some(alternation)
    };
    let (long, short) = (look(longest), look(longest / 2));
    match (long, short) {
        (Some(long), Some(short)) => Some(if short.least > long.least && short.least > 1.0 {
            short
        } else {
            long
        }),
        (long, short) => long.or(short.filter(|short| short.least > 1.0)),
    }
}

/// Whether the forced orbit still is where it was a turn ago.
fn is_still_there(window: &Window<'_>, forced: f32, noise: f32) -> bool {
    let (drift, bound) = (window.recent_drift(), STEADY * forced);
    drift * drift < bound * bound + chance(noise, window.classes())
}
