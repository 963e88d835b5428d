//! The largest quiet depth (stable with margin in depth and speed), which is advised if no speed is quiet at the
//! present depth.

use heapless::{Deque, Vec};

use super::cell::largest_possible_mm;
use super::quiet_speed_search::{Direction, QuietSpeedSearch};
use super::rule::ratio;
use crate::criteria::{BETTER, CANDIDATE_SPEEDS, DEPTH_MARGIN, EQUAL_DEPTHS, SPEED_BAND};
use crate::units::{Millimeters, Rpm};

/// Depth ranges (from, to) in mm that are stable with the depth margin at one spindle speed. Ranges beyond the capacity
/// are dropped, so that their depths are not advised.
type Ranges = Vec<(f32, f32), 24>;

/// A spindle speed that may be advised, with an upper bound of the quiet depth (stable with margin) at it.
#[derive(Clone, Copy)]
struct Candidate {
    rpm: f32,
    depth_mm: f32,
}

impl QuietSpeedSearch<'_> {
    /// The largest quiet depth (stable with margin) found up to the depth of the cut, and the spindle speed for it;
    /// `None` if none is found. The speed is the present one, unless no depth is quiet there or the quiet depth of
    /// another speed is larger by the factor [`BETTER`].
    ///
    /// The entries at the grid speeds give an upper bound of the quiet depth at every speed. For the speeds with the
    /// largest bounds the quiet depth is computed from interpolated entries, until no bound exceeds the depth to beat.
    pub(super) fn largest_depth(&self, speed: Rpm) -> Option<(Rpm, Millimeters)> {
        let present_mm = self.largest_depth_mm(speed.0, 0.0);
        let mut best = present_mm.map(|depth_mm| (speed.0, depth_mm));
        let mut to_beat_mm = present_mm.map_or(0.0, |depth_mm| BETTER * depth_mm);
        for candidate in self.candidates(speed, to_beat_mm) {
            if candidate.depth_mm <= to_beat_mm {
                break;
            }
            if let Some(depth_mm) = self.largest_depth_mm(candidate.rpm, to_beat_mm) {
                best = Some((candidate.rpm, depth_mm));
                to_beat_mm = EQUAL_DEPTHS * depth_mm;
            }
        }
        best.map(|(rpm, depth_mm)| (Rpm(rpm), Millimeters(depth_mm)))
    }

    /// Spindle speeds at which the upper bound of the quiet depth (stable with margin) exceeds `to_beat_mm`: at most
    /// [`CANDIDATE_SPEEDS`], and only one of those within [`SPEED_BAND`] of each other. They are in descending order
    /// of the bound; of nearly equal bounds, that of the speed nearer to the present `speed` comes first.
    fn candidates(&self, speed: Rpm, to_beat_mm: f32) -> Vec<Candidate, CANDIDATE_SPEEDS> {
        let mut candidates: Vec<Candidate, CANDIDATE_SPEEDS> = Vec::new();
        let (low_rpm, high_rpm) = self.known_rpm;
        if low_rpm > high_rpm {
            return candidates;
        }
        let mut behind = Window::default();
        // `rpm` and `ahead_rpm` step through the same spindle speeds. `ahead_rpm` leads, up to the upper end of the
        // speed band around `rpm`.
        let mut rpm = low_rpm;
        let mut ahead_rpm = low_rpm;
        loop {
            let band_end_rpm = f32::min(rpm * (1.0 + SPEED_BAND), high_rpm);
            while ahead_rpm <= band_end_rpm {
                behind.push(ahead_rpm, self.possible_mm(ahead_rpm));
                if ahead_rpm == high_rpm {
                    break;
                }
                ahead_rpm = self.next_point(ahead_rpm, high_rpm);
            }
            behind.drop_below(rpm * (1.0 - SPEED_BAND));
            let depth_mm = behind.least_mm(self.depth_mm);
            if depth_mm > to_beat_mm {
                insert(&mut candidates, Candidate { rpm, depth_mm }, speed);
            }
            if rpm == high_rpm {
                return candidates;
            }
            rpm = self.next_point(rpm, high_rpm);
        }
    }

    /// The next spindle speed at which the quiet depth (stable with margin) is bounded: the next speed of the lobe
    /// table, half of [`SPEED_BAND`] further, or `end_rpm`, whichever is nearest.
    fn next_point(&self, rpm: f32, end_rpm: f32) -> f32 {
        let (_, cell_end_rpm) = self.cell_at(Direction::Faster, rpm, end_rpm);
        f32::min(rpm * (1.0 + 0.5 * SPEED_BAND), cell_end_rpm)
    }

    /// Upper bound in mm of the quiet depth (stable with margin) at a spindle speed, from the entries of the lobe table
    /// at this speed or at its two neighbours in the table.
    fn possible_mm(&self, rpm: f32) -> f32 {
        let index = self.table.speeds_up_to(Rpm(rpm)).saturating_sub(1);
        let is_on_grid = self.table.speed(index) == Some(Rpm(rpm));
        let indices = index..index + if is_on_grid { 1 } else { 2 };
        largest_possible_mm(&self.cut, indices, self.depth_mm, self.depth_to_mm)
    }

    /// The largest quiet depth (stable with margin) in mm at a spindle speed, if it exceeds `at_least_mm`. The speed
    /// band around the speed, within the machine's limits, is checked in steps. `None` also if the band leaves the
    /// lobe table, or a column of the table cannot be read.
    fn largest_depth_mm(&self, rpm: f32, at_least_mm: f32) -> Option<f32> {
        let (low_rpm, high_rpm) = self.known_rpm;
        let from_rpm = f32::max(rpm * (1.0 - SPEED_BAND), self.machine_rpm.0);
        let to_rpm = f32::min(rpm * (1.0 + SPEED_BAND), self.machine_rpm.1);
        if from_rpm < low_rpm || to_rpm > high_rpm {
            return None;
        }
        let mut quiet = self.quiet_depths(rpm)?;
        let mut rpm = from_rpm;
        loop {
            quiet = intersection(&quiet, &self.quiet_depths(rpm)?);
            let largest_mm = quiet.iter().map(|&(_, to_mm)| to_mm).fold(0.0, f32::max);
            if largest_mm <= at_least_mm {
                return None;
            }
            if rpm >= to_rpm {
                return Some(largest_mm);
            }
            let (index, cell_end_rpm) = self.cell_at(Direction::Faster, rpm, to_rpm);
            rpm = self.next_rpm(Direction::Faster, rpm, index, cell_end_rpm);
        }
    }

    /// The depth ranges, up to the depth of the cut, that are stable with the depth margin at exactly this spindle
    /// speed; `None` if the lobe table gives no column for it.
    fn quiet_depths(&self, rpm: f32) -> Option<Ranges> {
        let column = self.cut.column(Rpm(rpm)).ok()?;
        let mut ranges = Ranges::new();
        for (from, to) in column.stable() {
            let from_mm = from.0 / (1.0 - DEPTH_MARGIN);
            let to_mm = f32::min(to.0 / (1.0 + DEPTH_MARGIN), self.depth_mm);
            if from_mm < to_mm && ranges.push((from_mm, to_mm)).is_err() {
                break;
            }
        }
        Some(ranges)
    }
}

/// Inserts a candidate speed in descending order of its bound of the quiet depth (stable with margin). Of nearly equal
/// bounds, that of the speed nearer to the present `speed` comes first. If a candidate within [`SPEED_BAND`] is in the
/// list, the better of the two is kept.
fn insert(candidates: &mut Vec<Candidate, CANDIDATE_SPEEDS>, new: Candidate, speed: Rpm) {
    let is_better = |a: &Candidate, b: &Candidate| {
        let is_nearer = ratio(Rpm(a.rpm), speed) < ratio(Rpm(b.rpm), speed);
        a.depth_mm > EQUAL_DEPTHS * b.depth_mm || (is_nearer && EQUAL_DEPTHS * a.depth_mm >= b.depth_mm)
    };
    if let Some(index) = candidates
        .iter()
        .position(|old| ratio(Rpm(old.rpm), Rpm(new.rpm)) <= 1.0 + SPEED_BAND)
    {
        match candidates.get(index) {
            Some(old) if is_better(&new, old) => candidates.remove(index),
            _ => return,
        };
    }
    let place = candidates
        .iter()
        .position(|old| is_better(&new, old))
        .unwrap_or(candidates.len());
    if candidates.is_full() && place < candidates.len() {
        candidates.pop();
    }
    // If the list of candidate speeds is full, the last one in its order is dropped.
    let _ = candidates.insert(place, new);
}

/// Minimum of the upper bounds of the quiet depth (stable with margin) over a speed band that moves along the spindle
/// speed.
#[derive(Default)]
struct Window {
    /// Pairs (spindle speed in rev/min, upper bound in mm of the quiet depth, which is stable with margin), ascending
    /// in both. A bound is removed once a later bound is not larger. If the list is full, the newest bound is
    /// dropped: the minimum may then be larger, which is still an upper bound.
    bounds: Deque<(f32, f32), 32>,
}

impl Window {
    fn push(&mut self, rpm: f32, bound_mm: f32) {
        while self
            .bounds
            .back()
            .is_some_and(|&(_, last_mm)| last_mm >= bound_mm)
        {
            self.bounds.pop_back();
        }
        let _ = self.bounds.push_back((rpm, bound_mm));
    }

    fn drop_below(&mut self, rpm: f32) {
        while self.bounds.front().is_some_and(|&(first_rpm, _)| first_rpm < rpm) {
            self.bounds.pop_front();
        }
    }

    fn least_mm(&self, otherwise_mm: f32) -> f32 {
        self.bounds
            .front()
            .map_or(otherwise_mm, |&(_, bound_mm)| bound_mm)
    }
}

/// Intersection of two ascending lists of axial depth ranges.
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
