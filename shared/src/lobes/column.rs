//! A column of the lobe table: the unstable depth intervals at one spindle speed and working point.

use heapless::Vec;

use super::{Interval, IntervalKind, NotKnown, TabulatedStability};
use crate::units::{Hertz, Millimeters};

/// Largest number of unstable depth intervals in a column, also after combining up to four columns. Further intervals
/// are merged, which may call stable depths unstable.
const CAPACITY: usize = 32;

/// The depth intervals at one spindle speed at which the cut is unstable or undecided, ascending and without
/// overlaps; intervals may touch.
#[derive(Clone, Debug, PartialEq)]
pub struct Column {
    depth_from_mm: f32,
    depth_to_mm: f32,
    intervals: Vec<Interval, CAPACITY>,
}

impl Column {
    /// A column of the lobe table without unstable intervals, for the depth range from `depth_from_mm` to
    /// `depth_to_mm`.
    pub(super) fn new(depth_from_mm: f32, depth_to_mm: f32) -> Self {
        Self {
            depth_from_mm,
            depth_to_mm,
            intervals: Vec::new(),
        }
    }

    /// Appends an unstable depth interval to the column. Joins it with the last one if the two touch and have the
    /// same kind and chatter frequency.
    ///
    /// If the column is full, the last interval is extended instead. Stable depths may then be called unstable, never
    /// the reverse.
    pub(super) fn push(&mut self, interval: Interval) {
        if let Some(last) = self.intervals.last_mut()
            && last.to == interval.from
            && last.kind == interval.kind
            && last.chatter == interval.chatter
        {
            last.to = interval.to;
            return;
        }
        if self.intervals.push(interval).is_err()
            && let Some(last) = self.intervals.last_mut()
        {
            last.to = Millimeters(f32::max(last.to.0, interval.to.0));
        }
    }

    /// The unstable intervals, ascending.
    pub fn intervals(&self) -> &[Interval] {
        &self.intervals
    }

    /// The lowest unstable or undecided depth interval: its lower end is the stability limit for growing depth.
    /// `None` if all depths are stable.
    pub fn first_limit(&self) -> Option<&Interval> {
        self.intervals.first()
    }

    /// The ranges [from, to) of stable axial depths, ascending. The last range includes the largest depth of the table
    /// if it ends there.
    pub fn stable(&self) -> impl Iterator<Item = (Millimeters, Millimeters)> + '_ {
        let starts = core::iter::once(self.depth_from_mm).chain(self.intervals.iter().map(|i| i.to.0));
        let ends = self
            .intervals
            .iter()
            .map(|i| i.from.0)
            .chain(core::iter::once(self.depth_to_mm));
        starts
            .zip(ends)
            .filter(|(from, to)| from < to)
            .map(|(from, to)| (Millimeters(from), Millimeters(to)))
    }

    /// True if all depths from `from` to `to` are stable and inside the depth range of the lobe table.
    pub fn is_stable_within(&self, from: Millimeters, to: Millimeters) -> bool {
        from.0 >= self.depth_from_mm
            && to.0 <= self.depth_to_mm
            && self
                .intervals
                .iter()
                .all(|i| (i.to <= from && i.to.0 < self.depth_to_mm) || i.from > to)
    }

    /// Stability at a depth.
    pub fn at(&self, depth: Millimeters) -> TabulatedStability {
        // The negated comparison also catches a depth that is NaN.
        if !(depth.0 >= self.depth_from_mm && depth.0 <= self.depth_to_mm) {
            return TabulatedStability::NotKnown(NotKnown::Depth {
                asked: depth,
                from: Millimeters(self.depth_from_mm),
                to: Millimeters(self.depth_to_mm),
            });
        }
        let hit = self.intervals.iter().position(|i| self.covers(i, depth.0));
        let Some((index, interval)) = hit.and_then(|index| Some((index, self.intervals.get(index)?))) else {
            return TabulatedStability::Stable {
                margin: Millimeters(self.distance_to_unstable_mm(depth.0)),
            };
        };
        if interval.kind == IntervalKind::Undecided {
            return TabulatedStability::NotKnown(NotKnown::Undecided);
        }
        let (from_mm, to_mm) = self.unstable_range_mm(index, interval);
        TabulatedStability::Unstable {
            kind: interval.kind,
            chatter: interval.chatter,
            margin: Millimeters(f32::min(depth.0 - from_mm, to_mm - depth.0)),
        }
    }

    /// True if the unstable interval contains this depth. Its upper end is excluded, unless it is the largest depth of
    /// the table.
    fn covers(&self, interval: &Interval, depth_mm: f32) -> bool {
        interval.from.0 <= depth_mm
            && (depth_mm < interval.to.0
                || (interval.to.0 >= self.depth_to_mm && depth_mm <= self.depth_to_mm))
    }

    fn distance_to_unstable_mm(&self, depth_mm: f32) -> f32 {
        let below = self.intervals.iter().rev().find(|i| i.to.0 <= depth_mm);
        let above = self.intervals.iter().find(|i| i.from.0 > depth_mm);
        // With no unstable interval below the depth, the distance to the smallest depth of the table bounds the margin,
        // unless the smallest depth is 0: no cut has a depth below 0.
        let from_mm = match below {
            Some(interval) => interval.to.0,
            None if self.depth_from_mm > 0.0 => self.depth_from_mm,
            None => f32::NEG_INFINITY,
        };
        let to_mm = above.map_or(self.depth_to_mm, |interval| interval.from.0);
        f32::min(depth_mm - from_mm, to_mm - depth_mm)
    }

    /// The depth range in mm of an unstable interval and of all intervals of any kind joined to it without a gap.
    fn unstable_range_mm(&self, index: usize, interval: &Interval) -> (f32, f32) {
        let (mut from_mm, mut to_mm) = (interval.from.0, interval.to.0);
        for before in self.intervals.iter().take(index).rev() {
            if before.to.0 < from_mm {
                break;
            }
            from_mm = before.from.0;
        }
        for after in self.intervals.iter().skip(index + 1) {
            if after.from.0 > to_mm {
                break;
            }
            to_mm = after.to.0;
        }
        (from_mm, to_mm)
    }

    /// Fills an empty column (unstable depth intervals at one speed) with the interpolation between two neighbouring
    /// columns of the lobe table. `weight` is the weight of `b`, 0 to 1.
    ///
    /// Intervals that overlap or touch, within one column or across both, form a group. A group is interpolated if both
    /// columns have the same sequence of kinds in it and the intervals overlap pairwise. Otherwise the union of both
    /// columns is unstable.
    pub(super) fn blend(&mut self, a: &Self, b: &Self, weight: f32) {
        let (mut rest_a, mut rest_b) = (a.intervals.as_slice(), b.intervals.as_slice());
        while !(rest_a.is_empty() && rest_b.is_empty()) {
            let (count_a, count_b) = group(rest_a, rest_b);
            let (group_a, tail_a) = rest_a.split_at(count_a.min(rest_a.len()));
            let (group_b, tail_b) = rest_b.split_at(count_b.min(rest_b.len()));
            if is_same_topology(group_a, group_b) {
                for (x, y) in group_a.iter().zip(group_b) {
                    self.push(self.interpolate(x, y, weight));
                }
            } else if weight <= 0.5 {
                self.push_union(group_a, group_b);
            } else {
                self.push_union(group_b, group_a);
            }
            (rest_a, rest_b) = (tail_a, tail_b);
        }
    }

    /// Linear interpolation between two corresponding unstable depth intervals of neighbouring columns.
    ///
    /// An interval end at the smallest or largest depth of the table may lie beyond that depth in truth. If either
    /// interval ends there, the result does too. Its chatter frequency is 0 (unknown) if that of either interval is.
    fn interpolate(&self, a: &Interval, b: &Interval, weight: f32) -> Interval {
        let between = |x: f32, y: f32| x + (y - x) * weight;
        let from_mm = if f32::min(a.from.0, b.from.0) <= self.depth_from_mm {
            self.depth_from_mm
        } else {
            between(a.from.0, b.from.0)
        };
        let to_mm = if f32::max(a.to.0, b.to.0) >= self.depth_to_mm {
            self.depth_to_mm
        } else {
            between(a.to.0, b.to.0)
        };
        let chatter_hz = if a.chatter.0 == 0.0 || b.chatter.0 == 0.0 {
            0.0
        } else {
            between(a.chatter.0, b.chatter.0)
        };
        Interval {
            from: Millimeters(from_mm),
            to: Millimeters(to_mm),
            kind: a.kind,
            chatter: Hertz(chatter_hz),
        }
    }

    /// Appends the union of two groups of unstable intervals. Where the two overlap, the union has the kind and chatter
    /// frequency of `near`.
    fn push_union(&mut self, near: &[Interval], far: &[Interval]) {
        let mut depth_mm = f32::NEG_INFINITY;
        loop {
            let beyond = |i: &&Interval| i.to.0 > depth_mm;
            let next_near = near.iter().find(beyond);
            let next_far = far.iter().find(beyond);
            let start_near_mm = next_near.map_or(f32::INFINITY, |i| f32::max(i.from.0, depth_mm));
            let start_far_mm = next_far.map_or(f32::INFINITY, |i| f32::max(i.from.0, depth_mm));
            let piece = match (next_near, next_far) {
                (Some(i), _) if start_near_mm <= start_far_mm => Interval {
                    from: Millimeters(start_near_mm),
                    ..*i
                },
                (_, Some(i)) => Interval {
                    from: Millimeters(start_far_mm),
                    to: Millimeters(f32::min(i.to.0, start_near_mm)),
                    ..*i
                },
                _ => return,
            };
            depth_mm = piece.to.0;
            self.push(piece);
        }
    }
}

/// Numbers of intervals at the start of the lists `a` and `b` that form one group of overlapping or touching unstable
/// intervals.
fn group(a: &[Interval], b: &[Interval]) -> (usize, usize) {
    let (mut count_a, mut count_b) = (0, 0);
    let mut end_mm = f32::min(
        a.first().map_or(f32::INFINITY, |i| i.from.0),
        b.first().map_or(f32::INFINITY, |i| i.from.0),
    );
    loop {
        if let Some(i) = a.get(count_a).filter(|i| i.from.0 <= end_mm) {
            end_mm = f32::max(end_mm, i.to.0);
            count_a += 1;
        } else if let Some(i) = b.get(count_b).filter(|i| i.from.0 <= end_mm) {
            end_mm = f32::max(end_mm, i.to.0);
            count_b += 1;
        } else if count_a + count_b == 0 {
            // Reached only if depths of the table are NaN. Consuming one interval of each list lets the caller's loop
            // end.
            return (1, 1);
        } else {
            return (count_a, count_b);
        }
    }
}

/// True if two groups of unstable intervals have the same sequence of kinds, with pairwise overlapping intervals.
fn is_same_topology(a: &[Interval], b: &[Interval]) -> bool {
    a.len() == b.len()
        && a.iter()
            .zip(b)
            .all(|(x, y)| x.kind == y.kind && x.from < y.to && y.from < x.to)
}
