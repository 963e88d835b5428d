//! Where the table is quiet: stable with margin in depth over a band of speed.

use heapless::Vec;

use super::rule::ratio;
use super::{BETTER, DEPTH_MARGIN, SPEED_BAND};
use crate::lobes::LobeTable;
use crate::units::{Millimeters, Rpm};
use crate::working_point::WorkingPoint;

/// Besides the speeds of the grid and the middles between them, columns are looked at in steps of this, relative: four to
/// each half of the speed band.
const STEP: f32 = SPEED_BAND / 4.0;

/// Ranges of quiet depths at one speed; what does not fit is left out, which is on the safe side.
type Ranges = Vec<(f32, f32), 24>;

/// Up or down in speed.
#[derive(Clone, Copy)]
enum Direction {
    Faster,
    Slower,
}

impl Direction {
    fn sign(self) -> f32 {
        match self {
            Self::Faster => 1.0,
            Self::Slower => -1.0,
        }
    }

    /// True where `a` is `b` or lies behind it on the way.
    fn is_beyond(self, a: f32, b: f32) -> bool {
        self.sign() * a >= self.sign() * b
    }

    fn further(self, a: f32, b: f32) -> f32 {
        if self.is_beyond(a, b) { a } else { b }
    }
}

/// A search for quiet points of one cut.
pub(super) struct Quiet<'t> {
    table: &'t LobeTable<'t>,
    at: WorkingPoint,
    /// What the spindle can do: the band around a speed is cut off here, since the spindle cannot go there.
    machine_rpm: (f32, f32),
    /// What the spindle can do and the table knows.
    known_rpm: (f32, f32),
}

impl<'t> Quiet<'t> {
    /// A search within the range of speeds of the machine.
    pub(super) fn new(table: &'t LobeTable<'t>, at: WorkingPoint, machine_rpm: (f32, f32)) -> Self {
        let first_rpm = table.speeds().next().map_or(f32::NAN, |speed| speed.0);
        let last_rpm = table.speeds().next_back().map_or(f32::NAN, |speed| speed.0);
        let known_rpm = (
            f32::max(machine_rpm.0, first_rpm),
            f32::min(machine_rpm.1, last_rpm),
        );
        Self {
            table,
            at,
            machine_rpm,
            known_rpm,
        }
    }

    /// The quiet speed that is nearest to `speed` in relative change; it may be `speed` itself.
    pub(super) fn nearest_speed(&self, speed: Rpm) -> Option<Rpm> {
        let faster = self.walk(Direction::Faster, speed, f32::INFINITY);
        let limit = faster.map_or(f32::INFINITY, |faster| ratio(faster, speed));
        self.walk(Direction::Slower, speed, limit).or(faster)
    }

    /// The largest quiet depth up to that of the cut, and the speed for it: the present one unless another is better.
    pub(super) fn largest_depth(&self, speed: Rpm) -> Option<(Rpm, Millimeters)> {
        let present_mm = self.largest_depth_mm(speed.0, 0.0);
        let mut best = present_mm.map(|depth_mm| (speed.0, depth_mm));
        let mut to_beat_mm = present_mm.map_or(0.0, |depth_mm| BETTER * depth_mm);
        let (low_rpm, high_rpm) = self.known_rpm;
        if low_rpm.is_nan() || high_rpm.is_nan() || low_rpm > high_rpm {
            return None;
        }
        // Outwards, so that of equal depths the nearest speed of each side comes first.
        for (direction, end_rpm) in [(Direction::Faster, high_rpm), (Direction::Slower, low_rpm)] {
            let mut rpm = speed.0.clamp(low_rpm, high_rpm);
            loop {
                // Most speeds are out by their own column, before the band around them is looked at.
                if let Some(depth_mm) = self.largest_depth_mm(rpm, to_beat_mm) {
                    best = Some((rpm, depth_mm));
                    to_beat_mm = depth_mm;
                }
                if rpm == end_rpm {
                    break;
                }
                rpm = self.next_rpm(direction, rpm, end_rpm);
            }
        }
        best.map(|(rpm, depth_mm)| (Rpm(rpm), Millimeters(depth_mm)))
    }

    /// The first quiet speed from `speed` on, if its relative change is below `limit`.
    ///
    /// Walks over columns and remembers where the present run of stable ones began: as soon as a run is as wide as the
    /// band around a speed, that speed is quiet. No column is read twice.
    fn walk(&self, direction: Direction, speed: Rpm, limit: f32) -> Option<Rpm> {
        let (low_rpm, high_rpm) = self.known_rpm;
        let sign = direction.sign();
        let (machine_near, end) = match direction {
            Direction::Faster => (self.machine_rpm.0, high_rpm),
            Direction::Slower => (self.machine_rpm.1, low_rpm),
        };
        // Written so that an empty range and NaN end here.
        if !(low_rpm <= high_rpm && speed.0 > 0.0) {
            return None;
        }
        let mut rpm = (speed.0 * (1.0 - sign * SPEED_BAND)).clamp(low_rpm, high_rpm);
        let mut run: Option<f32> = None;
        loop {
            run = if self.is_stable(rpm) {
                run.or(Some(rpm))
            } else {
                None
            };
            if let Some(start) = run {
                // The speed whose band begins where the run begins.
                let at_limit = direction.is_beyond(machine_near, start);
                let centre = if at_limit {
                    start
                } else {
                    start / (1.0 - sign * SPEED_BAND)
                };
                let centre = direction.further(centre, speed.0);
                if ratio(Rpm(centre), speed) >= limit {
                    return None;
                }
                let band_end =
                    (centre * (1.0 + sign * SPEED_BAND)).clamp(self.machine_rpm.0, self.machine_rpm.1);
                let is_inside = (low_rpm..=high_rpm).contains(&centre);
                if is_inside && direction.is_beyond(rpm, band_end) && self.is_stable(centre) {
                    return Some(Rpm(centre));
                }
            }
            let is_past =
                direction.is_beyond(rpm, speed.0) && ratio(Rpm(rpm), speed) > limit * (1.0 + SPEED_BAND);
            if rpm == end || is_past {
                return None;
            }
            rpm = self.next_rpm(direction, rpm, end);
        }
    }

    /// The next speed to look at: the next of the grid, the middle between two, a step, or the end.
    fn next_rpm(&self, direction: Direction, rpm: f32, end_rpm: f32) -> f32 {
        let up_to = self.table.speeds_up_to(Rpm(rpm));
        let speed = |index: Option<usize>| {
            index
                .and_then(|index| self.table.speed(index))
                .map(|speed| speed.0)
        };
        let below = speed(up_to.checked_sub(1));
        let (behind, ahead) = match direction {
            Direction::Faster => (below, speed(Some(up_to))),
            // Standing on a speed of the grid, the one before it is ahead.
            Direction::Slower if below == Some(rpm) => (below, speed(up_to.checked_sub(2))),
            Direction::Slower => (speed(Some(up_to)), below),
        };
        let middle = behind.zip(ahead).map(|(behind, ahead)| 0.5 * (behind + ahead));
        let step = rpm * (1.0 + direction.sign() * STEP);
        [ahead, middle, Some(end_rpm)]
            .into_iter()
            .flatten()
            .filter(|&candidate| candidate != rpm && direction.is_beyond(candidate, rpm))
            .fold(step, |nearest, candidate| {
                if direction.is_beyond(nearest, candidate) {
                    candidate
                } else {
                    nearest
                }
            })
    }

    /// True where the depth of the cut is stable with margin at exactly this speed.
    fn is_stable(&self, rpm: f32) -> bool {
        let depth_mm = self.at.axial_depth.0;
        let [from, to] =
            [1.0 - DEPTH_MARGIN, 1.0 + DEPTH_MARGIN].map(|factor| Millimeters(factor * depth_mm));
        self.table
            .column(Rpm(rpm), &self.at)
            .is_ok_and(|column| column.is_stable_within(from, to))
    }

    /// The largest quiet depth at a speed, if it is more than `at_least_mm`.
    fn largest_depth_mm(&self, rpm: f32, at_least_mm: f32) -> Option<f32> {
        let mut quiet = self.quiet_depths(rpm)?;
        let (low_rpm, high_rpm) = self.known_rpm;
        let from_rpm = f32::max(rpm * (1.0 - SPEED_BAND), self.machine_rpm.0);
        let to_rpm = f32::min(rpm * (1.0 + SPEED_BAND), self.machine_rpm.1);
        if from_rpm < low_rpm || to_rpm > high_rpm {
            return None;
        }
        let mut rpm = from_rpm;
        loop {
            let largest_mm = quiet.iter().map(|&(_, to_mm)| to_mm).fold(0.0, f32::max);
            if largest_mm <= at_least_mm {
                return None;
            }
            quiet = intersection(&quiet, &self.quiet_depths(rpm)?);
            if rpm >= to_rpm {
                break;
            }
            rpm = self.next_rpm(Direction::Faster, rpm, to_rpm);
        }
        let largest_mm = quiet.iter().map(|&(_, to_mm)| to_mm).fold(0.0, f32::max);
        (largest_mm > at_least_mm).then_some(largest_mm)
    }

    /// The depths up to that of the cut that are stable with margin at exactly this speed.
    fn quiet_depths(&self, rpm: f32) -> Option<Ranges> {
        let column = self.table.column(Rpm(rpm), &self.at).ok()?;
        let depth_mm = self.at.axial_depth.0;
        let mut ranges = Ranges::new();
        for (from, to) in column.stable() {
            let from_mm = from.0 / (1.0 - DEPTH_MARGIN);
            let to_mm = f32::min(to.0 / (1.0 + DEPTH_MARGIN), depth_mm);
            if from_mm < to_mm && ranges.push((from_mm, to_mm)).is_err() {
                break;
            }
        }
        Some(ranges)
    }
}

/// What two ascending lists of ranges have in common.
fn intersection(a: &Ranges, b: &Ranges) -> Ranges {
    let mut common = Ranges::new();
    for &(a_from, a_to) in a {
        for &(b_from, b_to) in b {
            let (from, to) = (f32::max(a_from, b_from), f32::min(a_to, b_to));
            if from < to && common.push((from, to)).is_err() {
                return common;
            }
        }
    }
    common
}
