//! Slow growth, which noise hides from passing to passing: seen over the whole window, twice, and larger the second time.

use super::steadiness::LEAST_DEVIATION;
use crate::detector::finding::{GrowthKind, Multiplier};
use crate::math::exp;
use crate::stroboscope::exponential::ANGLES;
use crate::stroboscope::{Exponential, Guess, Window};

/// Standard deviations of growth, noise and wandering counted, in both looks. Noise alone comes to 5 in some hours of cutting.
const SURE: f32 = 7.0;
/// Passings between the two,
const SECOND_LOOK: u32 = 8;
/// in which it must have grown by this part of what the first look said.
const GOES_ON: f32 = 0.5;
/// Growth of what is less than this part of the forced vibration is none yet.
const LEAST_SHARE: f32 = 0.05;
/// Within this angle of each other, in turns, two looks see the same.
const SAME_ANGLE: f32 = 0.03;
/// Angles that are tried one after another, one in each look: closer than the resolution of the longest window, 1/64 turn.
const ANGLES_TRIED: u8 = 48;
/// Rate with which an angle is tried.
const RATE_TRIED: f32 = 0.01;

/// As it was first seen.
#[derive(Clone, Copy, Debug)]
struct Seen {
    passings: u32,
    level: f32,
    angle_turns: f32,
}

/// Follows what may grow slowly.
#[derive(Clone, Copy, Debug)]
pub(super) struct SlowGrowth {
    /// Where the last fit ended.
    tracked: Option<Guess>,
    /// Which angle is tried next.
    next: u8,
    first: Option<Seen>,
}

impl SlowGrowth {
    pub(super) const fn new() -> Self {
        Self {
            tracked: None,
            next: 0,
            first: None,
        }
    }

    /// Whether what has this angle is what the last fit was about.
    pub(super) fn sees(&self, angle_turns: f32) -> bool {
        self.tracked
            .is_some_and(|tracked| (tracked.angle_turns - angle_turns).abs() < SAME_ANGLE)
    }

    /// Takes the window of all passings since the conditions last changed. `predicted` is the angle of the multiplier that linear
    /// prediction sees, `forced` the level of the forced vibration in m/s².
    ///
    /// Returns what surely grows, and its cycles per tooth period.
    pub(super) fn look(
        &mut self,
        window: &Window<'_>,
        passings: u32,
        predicted: Option<f32>,
        forced: f32,
    ) -> Option<(Multiplier, Option<f32>)> {
        let part = f32::from(self.next) / f32::from(ANGLES_TRIED - 1);
        self.next = (self.next + 1) % ANGLES_TRIED;
        let guess = |angle_turns: f32| Guess {
            rate: RATE_TRIED,
            angle_turns: angle_turns.clamp(ANGLES.0, ANGLES.1),
        };
        let guesses = [
            self.tracked,
            predicted.filter(|angle| !self.sees(*angle)).map(guess),
            Some(guess(ANGLES.0 + part * (ANGLES.1 - ANGLES.0))),
        ];
        let found = window.exponential(guesses.into_iter().flatten());
        self.tracked = found.map(|found| Guess {
            rate: found.rate,
            angle_turns: found.angle_turns,
        });
        // What ends at the end of the angles lies beyond.
        let inside = |angle: f32| angle > ANGLES.0 && angle < ANGLES.1;
        let Some(found) =
            found.filter(|e| e.certainty > SURE && e.level > LEAST_SHARE * forced && inside(e.angle_turns))
        else {
            self.first = None;
            return None;
        };
        let first = self
            .first
            .filter(|first| (first.angle_turns - found.angle_turns).abs() < SAME_ANGLE)
            .unwrap_or(Seen {
                passings,
                level: found.level,
                angle_turns: found.angle_turns,
            });
        self.first = Some(first);
        let since = passings.saturating_sub(first.passings);
        let goes_on = found.level > first.level * (1.0 + GOES_ON * found.rate * since as f32);
        (since >= SECOND_LOOK && goes_on).then(|| (multiplier(&found), found.cycles()))
    }
}

fn multiplier(found: &Exponential) -> Multiplier {
    let abs = exp(found.rate);
    Multiplier {
        abs,
        deviation: (abs * found.rate / found.certainty).max(LEAST_DEVIATION),
        angle_turns: found.angle_turns,
        kind: GrowthKind::Hopf,
        level: found.level,
    }
}
