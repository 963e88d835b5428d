//! The newest intervals between pulses, whatever made them: evidence of a speed that does not depend on a lock.

use super::wheel::Wheel;
use crate::units::Nanoseconds;

/// Intervals that are kept: two revolutions of a wheel whose marks [`Train::like_a_revolution_ago`] compares.
const INTERVALS: usize = 6;
/// Largest wheel whose revolutions are compared mark by mark, in positions: one with a late mark may have no two alike intervals in a
/// row.
const COMPARED_POSITIONS: u16 = 3;
/// Two intervals are alike if neither is longer than the other by this factor. A ramp of 50 % of the speed per second
/// changes the interval of one mark at 60 rev/min by a factor of at most 1.41; a missed pulse makes it 2.
const ALIKE: f32 = 1.5;
/// Alike intervals shorter than this part of the pitch are those of a faster train.
const FASTER: f32 = 0.7;
/// So many of them in a row and it is the pitch that is wrong: a single pulse anywhere makes two at most.
pub(super) const FASTER_INTERVALS: usize = 3;
/// Smallest wheel whose even intervals tell its pitch, in positions. With fewer marks three intervals are half a revolution or more.
const EVEN_POSITIONS: u16 = 6;
/// Intervals are even if none is longer than another by this factor: more than jitter, less than a late mark.
const EVEN: f32 = 1.05;
/// Even intervals contradict a pitch from which their mean differs by more than this part. In a ramp of 50 % per second at 60 rev/min the
/// intervals of eleven marks are just even, and their mean lags by 0.05.
const CONTRADICTION: f32 = 0.1;
/// A pulse after less than this part of the shorter of the two preceding intervals is a bounce of the sensor. The interval that
/// ends a standstill or a gap is long: it alone says nothing. The shortest true ratio is that beside the gap of a variable-reluctance sensor,
/// (1 − 0.46)/(1 + 0.46).
const BOUNCE: f32 = 0.3;

/// The newest intervals between pulses.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Train {
    newest: Option<Nanoseconds>,
    /// The pulse after `newest` that counts as a bounce.
    bounce: Option<Nanoseconds>,
    /// Intervals in ns, newest first.
    intervals_ns: [f32; INTERVALS],
    filled: u8,
}

impl Train {
    pub(super) const fn new() -> Self {
        Self {
            newest: None,
            bounce: None,
            intervals_ns: [0.0; INTERVALS],
            filled: 0,
        }
    }

    /// Time of the newest pulse.
    pub(super) fn newest(&self) -> Option<Nanoseconds> {
        self.newest
    }

    /// True if `time` is before the newest pulse: the clock has jumped.
    pub(super) fn is_after(&self, time: Nanoseconds) -> bool {
        self.newest.is_some_and(|newest| newest > time)
    }

    /// Takes the next pulse. False if it is a bounce. Two in a row are none: they are the pulses of a faster train.
    pub(super) fn push(&mut self, time: Nanoseconds) -> bool {
        let Some(newest) = self.newest else {
            self.newest = Some(time);
            return true;
        };
        let before_ns = match self.intervals() {
            [new, old, ..] => new.min(*old),
            _ => 0.0,
        };
        let mut interval_ns = time.seconds_since(newest) * 1e9;
        if interval_ns < BOUNCE * before_ns {
            let Some(bounce) = self.bounce else {
                self.bounce = Some(time);
                return false;
            };
            interval_ns = time.seconds_since(bounce) * 1e9;
        }
        self.bounce = None;
        self.newest = Some(time);
        self.intervals_ns.rotate_right(1);
        if let Some(first) = self.intervals_ns.first_mut() {
            *first = interval_ns;
        }
        self.filled = (self.filled + 1).min(INTERVALS as u8);
        self.drop_bounces();
        true
    }

    /// Takes the bounces out of a train in which every pulse bounces: intervals that are long and short in turn, the newest long.
    fn drop_bounces(&mut self) {
        let [long, short, before, short_before, ..] = self.intervals_ns;
        let in_turn = is_alike(long, before) && is_alike(short, short_before) && short < BOUNCE * long;
        if self.filled >= 4 && in_turn {
            self.intervals_ns = [0.0; INTERVALS];
            (self.intervals_ns[0], self.intervals_ns[1]) = (long + short, before + short_before);
            self.filled = 2;
        }
    }

    fn intervals(&self) -> &[f32] {
        self.intervals_ns
            .get(..usize::from(self.filled))
            .unwrap_or_default()
    }

    /// The newest `count` intervals, newest first, if each is like the next.
    fn alike(&self, count: usize) -> Option<&[f32]> {
        let newest = self.intervals().get(..count)?;
        let all = newest.windows(2).all(|pair| is_alike(pair[0], pair[1]));
        all.then_some(newest)
    }

    /// True if the newest `count` intervals are alike and those of a faster train than one of `pitch_ns`.
    pub(super) fn is_faster(&self, count: usize, pitch_ns: f32) -> bool {
        self.alike(count)
            .is_some_and(|intervals_ns| intervals_ns.iter().all(|&ns| ns < FASTER * pitch_ns))
    }

    /// Intervals, newest first, that a wheel of this pitch does not make, whatever pulses are missing or too many; `None` if there are none.
    pub(super) fn contradiction(&self, wheel: Wheel, pitch_ns: f32) -> Option<&[f32]> {
        if self.is_faster(FASTER_INTERVALS, pitch_ns) {
            return self.alike(FASTER_INTERVALS);
        }
        if wheel.positions >= EVEN_POSITIONS {
            let even = self.alike(FASTER_INTERVALS)?;
            let (mean_ns, least_ns, most_ns) = mean_and_range(even);
            let other =
                mean_ns > (1.0 + CONTRADICTION) * pitch_ns || mean_ns < (1.0 - CONTRADICTION) * pitch_ns;
            return (most_ns < EVEN * least_ns && other).then_some(even);
        }
        self.like_a_revolution_ago(wheel)
            .filter(|intervals_ns| mean_and_range(intervals_ns).0 < FASTER * pitch_ns)
    }

    /// Two revolutions of a wheel with few marks, newest interval first, if each interval is like that of the revolution before.
    /// Marks of different length make intervals that are not alike within a revolution.
    fn like_a_revolution_ago(&self, wheel: Wheel) -> Option<&[f32]> {
        if wheel.missing > 0 || !(2..=COMPARED_POSITIONS).contains(&wheel.positions) {
            return None;
        }
        let turn = usize::from(wheel.positions);
        let both = self.intervals().get(..2 * turn)?;
        let (new, old) = both.split_at(turn);
        let all = new.iter().zip(old).all(|(&new, &old)| is_alike(new, old));
        all.then_some(both)
    }

    /// The newest intervals that a steadily turning wheel makes, newest first; `None` if there are none.
    pub(super) fn regular(&self, wheel: Wheel) -> Option<&[f32]> {
        self.like_a_revolution_ago(wheel)
            .or_else(|| self.alike(agreeing_intervals(wheel)))
    }
}

/// Number of intervals in a row that must be alike. With many marks three are still a small part of a revolution; a
/// wheel of five or less with a lost tooth has no three alike.
pub(super) fn agreeing_intervals(wheel: Wheel) -> usize {
    if wheel.positions < 6 { 2 } else { 3 }
}

/// Mean, least and largest.
fn mean_and_range(intervals_ns: &[f32]) -> (f32, f32, f32) {
    let mean = intervals_ns.iter().sum::<f32>() / intervals_ns.len().max(1) as f32;
    let least = intervals_ns.iter().copied().fold(f32::INFINITY, f32::min);
    let most = intervals_ns.iter().copied().fold(0.0, f32::max);
    (mean, least, most)
}

fn is_alike(a: f32, b: f32) -> bool {
    a > 0.0 && a < ALIKE * b && b < ALIKE * a
}
