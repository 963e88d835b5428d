//! The search in the lobe table for quiet speeds: speeds at which the cut is stable with the depth margin over the
//! whole speed band.

use super::cell::{Cell, Node};
use super::rule::ratio;
use crate::criteria::{DEPTH_MARGIN, QUIET_SPEED_STEP, SPEED_BAND};
use crate::lobes::{CutLobes, LobeTable, NotKnown};
use crate::units::{Millimeters, Rpm};
use crate::working_point::WorkingPoint;

/// Direction of the search for quiet speeds: towards faster or slower spindle speeds.
#[derive(Clone, Copy)]
pub(super) enum Direction {
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

    /// True if the speed `a` equals `b` or lies beyond it in this direction.
    fn is_beyond(self, a: f32, b: f32) -> bool {
        self.sign() * a >= self.sign() * b
    }

    /// Returns whichever of the speeds `a` and `b` lies further in this direction.
    fn further(self, a: f32, b: f32) -> f32 {
        if self.is_beyond(a, b) { a } else { b }
    }
}

/// The search in the lobe table for speeds and depths at which one cut is stable with margin.
pub(super) struct QuietSpeedSearch<'t> {
    pub(super) table: &'t LobeTable<'t>,
    pub(super) cut: CutLobes<'t>,
    pub(super) depth_mm: f32,
    pub(super) depth_to_mm: f32,
    /// Speed range of the machine in rev/min. The speed band around a speed is clipped to this range.
    pub(super) machine_rpm: (f32, f32),
    /// Intersection of the machine's speed range with the speeds of the lobe table, in rev/min.
    pub(super) known_rpm: (f32, f32),
}

impl<'t> QuietSpeedSearch<'t> {
    /// Prepares the search for quiet speeds of a cut within the speed range `machine_rpm` of the machine.
    ///
    /// # Errors
    /// The table does not cover this cut, or is damaged.
    pub(super) fn new(
        table: &'t LobeTable<'t>,
        at: &WorkingPoint,
        machine_rpm: (f32, f32),
    ) -> Result<Self, NotKnown> {
        let first_rpm = table.speeds().next().map_or(f32::NAN, |speed| speed.0);
        let last_rpm = table.speeds().next_back().map_or(f32::NAN, |speed| speed.0);
        // The negated comparison also refuses a speed range with NaN, which a table damaged after its check may
        // contain.
        if !(first_rpm > 0.0 && first_rpm <= last_rpm && last_rpm.is_finite()) {
            return Err(NotKnown::Damaged);
        }
        let known_rpm = (
            f32::max(machine_rpm.0, first_rpm),
            f32::min(machine_rpm.1, last_rpm),
        );
        Ok(Self {
            table,
            cut: table.cut(at)?,
            depth_mm: at.axial_depth.0,
            depth_to_mm: table.depths().1.0,
            machine_rpm,
            known_rpm,
        })
    }

    /// The quiet speed (stable with margin) with the smallest relative change from `speed`, which may be `speed`
    /// itself; `None` if none is found.
    pub(super) fn nearest_speed(&self, speed: Rpm) -> Option<Rpm> {
        let faster = self.walk(Direction::Faster, speed, f32::INFINITY);
        let limit = faster.map_or(f32::INFINITY, |faster| ratio(faster, speed));
        self.walk(Direction::Slower, speed, limit).or(faster)
    }

    /// The first quiet speed (stable with margin) in this direction from `speed`, if its ratio to `speed` (the larger
    /// over the smaller) is below `limit`.
    ///
    /// The search steps from cell to cell of the table. It interpolates in cells of mixed stability, and at each
    /// speed that it is about to return.
    fn walk(&self, direction: Direction, speed: Rpm, limit: f32) -> Option<Rpm> {
        let (low_rpm, high_rpm) = self.known_rpm;
        let end_rpm = match direction {
            Direction::Faster => high_rpm,
            Direction::Slower => low_rpm,
        };
        if low_rpm > high_rpm {
            return None;
        }
        let near_end_rpm = speed.0 * (1.0 - direction.sign() * SPEED_BAND);
        let mut rpm = near_end_rpm.clamp(low_rpm, high_rpm);
        let mut run = Run {
            quiet: self,
            direction,
            speed,
            start_rpm: None,
        };
        let mut known: Option<(usize, Option<Node>)> = None;
        loop {
            let (index, cell_end_rpm) = self.cell_at(direction, rpm, end_rpm);
            let node = |index| match known {
                // Two neighbouring cells of the table share the speed between them, so the stability at that speed is
                // computed once.
                Some((known_index, node)) if known_index == index => node,
                _ => Node::at(&self.cut, index, self.depth_mm, self.depth_to_mm),
            };
            let (low, high) = (node(index), node(index + 1));
            known = match direction {
                Direction::Faster => Some((index + 1, high)),
                Direction::Slower => Some((index, low)),
            };
            let found = match Cell::between(low, high) {
                Cell::Unstable => run.end(),
                Cell::Stable => run.extend(rpm, cell_end_rpm),
                Cell::Mixed => run.check_speeds(rpm, index, cell_end_rpm),
            };
            if found.is_some() {
                return found.filter(|&found| ratio(found, speed) < limit);
            }
            rpm = cell_end_rpm;
            let is_past =
                direction.is_beyond(rpm, speed.0) && ratio(Rpm(rpm), speed) > limit * (1.0 + SPEED_BAND);
            if rpm == end_rpm || is_past {
                return None;
            }
        }
    }

    /// The next cell of the lobe table in this direction from `rpm`: the index of the lower of its two speeds, and the
    /// speed at which the cell or the search ends.
    pub(super) fn cell_at(&self, direction: Direction, rpm: f32, end_rpm: f32) -> (usize, f32) {
        let up_to = self.table.speeds_up_to(Rpm(rpm));
        let speed = |index: usize| self.table.speed(index).map_or(end_rpm, |speed| speed.0);
        let below = up_to.saturating_sub(1);
        let (index, ahead_rpm) = match direction {
            Direction::Faster => (below, speed(up_to)),
            // From a speed that is exactly one of the table, the next cell in the slower direction is the one below it.
            Direction::Slower if speed(below) == rpm => {
                (below.saturating_sub(1), speed(below.saturating_sub(1)))
            }
            Direction::Slower => (below, speed(below)),
        };
        // In a damaged lobe table a speed may be NaN. The search then still ends at `end_rpm`.
        let is_ahead = ahead_rpm != rpm && direction.is_beyond(ahead_rpm, rpm);
        let is_before_end = direction.is_beyond(end_rpm, ahead_rpm);
        (
            index,
            if is_ahead && is_before_end {
                ahead_rpm
            } else {
                end_rpm
            },
        )
    }

    /// The next spindle speed to check within a cell of the lobe table (between two of its speeds): the middle of the
    /// cell, its end, or one [`QUIET_SPEED_STEP`] further, whichever comes first.
    pub(super) fn next_rpm(&self, direction: Direction, rpm: f32, index: usize, cell_end_rpm: f32) -> f32 {
        let step = rpm * (1.0 + direction.sign() * QUIET_SPEED_STEP);
        let ends = self.table.speed(index).zip(self.table.speed(index + 1));
        let middle = ends.map_or(cell_end_rpm, |(low, high)| 0.5 * (low.0 + high.0));
        let is_within = |candidate: &f32| {
            direction.is_beyond(cell_end_rpm, *candidate) && !direction.is_beyond(rpm, *candidate)
        };
        let nearer = |a: f32, b: f32| if direction.is_beyond(a, b) { b } else { a };
        [middle, step]
            .into_iter()
            .filter(is_within)
            .fold(cell_end_rpm, nearer)
    }

    /// True if the depth of the cut is stable with the depth margin at exactly the spindle speed `rpm`.
    fn is_stable(&self, rpm: f32) -> bool {
        let [from, to] =
            [1.0 - DEPTH_MARGIN, 1.0 + DEPTH_MARGIN].map(|factor| Millimeters(factor * self.depth_mm));
        let column = self.cut.column(Rpm(rpm));
        column.is_ok_and(|column| column.is_stable_within(from, to))
    }
}

/// A run of consecutive spindle speeds at which the cut is stable. A speed is quiet once the run covers the speed
/// band around it, within the machine's limits.
struct Run<'q, 't> {
    quiet: &'q QuietSpeedSearch<'t>,
    direction: Direction,
    /// The present spindle speed, from which the search starts. Speeds before it in the direction of the search are not
    /// advised.
    speed: Rpm,
    /// First speed of the run of stable speeds in rev/min; `None` while no run has begun.
    start_rpm: Option<f32>,
}

impl Run<'_, '_> {
    /// Ends the run of stable speeds at an unstable speed. Returns `None`, as no quiet speed is reached.
    fn end(&mut self) -> Option<Rpm> {
        self.start_rpm = None;
        None
    }

    /// Extends the run over the stable speeds from `from_rpm` to `to_rpm`. Returns the quiet speed once the run covers
    /// the speed band around it.
    fn extend(&mut self, from_rpm: f32, to_rpm: f32) -> Option<Rpm> {
        let start_rpm = *self.start_rpm.get_or_insert(from_rpm);
        let centre_rpm = self.centre_rpm(start_rpm);
        let QuietSpeedSearch {
            machine_rpm,
            known_rpm,
            ..
        } = self.quiet;
        let band_end_rpm = centre_rpm * (1.0 + self.direction.sign() * SPEED_BAND);
        let is_wide = self
            .direction
            .is_beyond(to_rpm, band_end_rpm.clamp(machine_rpm.0, machine_rpm.1));
        let is_known = (known_rpm.0..=known_rpm.1).contains(&centre_rpm);
        (is_wide && is_known && self.quiet.is_stable(centre_rpm)).then_some(Rpm(centre_rpm))
    }

    /// Checks speeds of a cell of the lobe table, in which stability may change, one by one. Returns the quiet speed,
    /// if one is reached in this cell.
    fn check_speeds(&mut self, from_rpm: f32, index: usize, cell_end_rpm: f32) -> Option<Rpm> {
        let mut rpm = from_rpm;
        let mut unstable_rpm: Option<f32> = None;
        loop {
            if self.quiet.is_stable(rpm) {
                let onset_rpm = unstable_rpm.map_or(rpm, |unstable_rpm| self.onset_rpm(unstable_rpm, rpm));
                unstable_rpm = None;
                let found = self.extend(onset_rpm, rpm);
                if found.is_some() {
                    return found;
                }
            } else {
                self.end();
                unstable_rpm = Some(rpm);
            }
            if rpm == cell_end_rpm {
                return None;
            }
            rpm = self.quiet.next_rpm(self.direction, rpm, index, cell_end_rpm);
        }
    }

    /// Bisects the stability boundary between an unstable and a stable speed, to 1/32 of their distance. Returns the
    /// stable end of the last subinterval.
    fn onset_rpm(&self, mut unstable_rpm: f32, mut stable_rpm: f32) -> f32 {
        for _ in 0..5 {
            let middle_rpm = 0.5 * (unstable_rpm + stable_rpm);
            if self.quiet.is_stable(middle_rpm) {
                stable_rpm = middle_rpm;
            } else {
                unstable_rpm = middle_rpm;
            }
        }
        stable_rpm
    }

    /// The first speed that may be quiet: the speed whose speed band begins at the start of the run, or the start
    /// itself if it is at a limit of the machine. It does not lie before the present speed in the direction of the
    /// search.
    fn centre_rpm(&self, start_rpm: f32) -> f32 {
        let machine_rpm = match self.direction {
            Direction::Faster => self.quiet.machine_rpm.0,
            Direction::Slower => self.quiet.machine_rpm.1,
        };
        let centre_rpm = if self.direction.is_beyond(machine_rpm, start_rpm) {
            start_rpm
        } else {
            start_rpm / (1.0 - self.direction.sign() * SPEED_BAND)
        };
        self.direction.further(centre_rpm, self.speed.0)
    }
}
