//! Stability in a whole cell of the lobe table, without interpolation. A cell is the range between two neighbouring
//! spindle speeds of the table.

use heapless::Vec;

use crate::criteria::DEPTH_MARGIN;
use crate::lobes::{CutLobes, FEW, Interval};

/// Stability of a cut in one cell of the lobe table (the range between two neighbouring speeds) at one depth and all
/// depths within the depth margin around it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Cell {
    /// The cut is stable at every speed of the cell and all depths within the margin.
    Stable,
    /// The cut is unstable or undecided at every speed of the cell, at the depth or at an end of its margin.
    Unstable,
    /// The stability of the cut changes within the cell, or the entries at both ends of the cell do not decide it
    /// without interpolation.
    Mixed,
}

/// Stability of a cut at one spindle speed of the lobe table, at one depth and the depths within the depth margin
/// around it, in all layers of the table from which the cut is interpolated.
#[derive(Clone, Copy)]
pub(super) struct Node {
    /// True if no depth within the margin around the depth of the cut exceeds the largest depth of the table, and all
    /// are stable in all layers.
    is_stable: bool,
    /// Whether the depths `(1 − DEPTH_MARGIN)·d`, `d` and `(1 + DEPTH_MARGIN)·d`, with the depth d of the cut, are
    /// unstable or undecided in every layer.
    is_unstable: [bool; 3],
}

impl Node {
    /// Stability of the cut at the speed of the table with index `speed_index` and the depth `depth_mm`.
    /// `depth_to_mm` is the largest depth of the table.
    ///
    /// `None` if an entry of the table at this speed cannot be read, or has more than [`FEW`] unstable intervals.
    pub(super) fn at(
        cut: &CutLobes<'_>,
        speed_index: usize,
        depth_mm: f32,
        depth_to_mm: f32,
    ) -> Option<Self> {
        let probes_mm = [1.0 - DEPTH_MARGIN, 1.0, 1.0 + DEPTH_MARGIN].map(|factor| factor * depth_mm);
        let [from_mm, _, to_mm] = probes_mm;
        let mut node = Self {
            is_stable: to_mm <= depth_to_mm,
            is_unstable: [true; 3],
        };
        for layer in cut.layers() {
            let mut is_covered = [false; 3];
            for interval in cut.stored(layer, speed_index)? {
                let Interval { from, to, .. } = interval?;
                node.is_stable &= (to.0 <= from_mm && to.0 < depth_to_mm) || from.0 > to_mm;
                for (is_covered, probe_mm) in is_covered.iter_mut().zip(probes_mm) {
                    *is_covered |= from.0 <= probe_mm && probe_mm < to.0;
                }
            }
            for (is_unstable, is_covered) in node.is_unstable.iter_mut().zip(is_covered) {
                *is_unstable &= is_covered;
            }
        }
        Some(node)
    }
}

impl Cell {
    /// The stability of the cell of the table between two neighbouring speeds, from the stability at both.
    pub(super) fn between(a: Option<Node>, b: Option<Node>) -> Self {
        let (Some(a), Some(b)) = (a, b) else {
            return Self::Mixed;
        };
        if a.is_stable && b.is_stable {
            Self::Stable
        } else if a.is_unstable.iter().zip(b.is_unstable).any(|(a, b)| *a && b) {
            Self::Unstable
        } else {
            Self::Mixed
        }
    }
}

/// Upper bound in mm of the quiet depths (stable with the depth margin) up to `depth_mm`, at one spindle speed of the
/// lobe table or between two neighbouring ones.
///
/// A depth that is stable between two entries is stable in at least one of them. Therefore the margin range `(1 ±
/// DEPTH_MARGIN)·d` of a quiet depth `d` lies within the union of the entries' stable ranges.
pub(super) fn largest_possible_mm(
    cut: &CutLobes<'_>,
    speed_indices: impl IntoIterator<Item = usize>,
    depth_mm: f32,
    depth_to_mm: f32,
) -> f32 {
    let mut ranges_mm: Ranges = Vec::new();
    for index in speed_indices {
        for layer in cut.layers() {
            if add_stable_ranges(&mut ranges_mm, cut, layer, index, depth_to_mm).is_none() {
                return depth_mm;
            }
        }
    }
    let (mut largest_mm, mut from_mm, mut to_mm) = (0.0, 0.0, 0.0);
    for range_mm in ranges_mm {
        if range_mm.0 > to_mm {
            (from_mm, to_mm) = range_mm;
        } else {
            to_mm = f32::max(to_mm, range_mm.1);
        }
        let upper_mm = f32::min(to_mm / (1.0 + DEPTH_MARGIN), depth_mm);
        if upper_mm >= from_mm / (1.0 - DEPTH_MARGIN) {
            largest_mm = f32::max(largest_mm, upper_mm);
        }
    }
    largest_mm
}

/// Stable depth ranges (from, to) in mm from up to four entries of the lobe table, sorted by their lower ends.
type Ranges = Vec<(f32, f32), { 4 * (FEW + 1) }>;

fn add_stable_ranges(
    ranges_mm: &mut Ranges,
    cut: &CutLobes<'_>,
    layer: usize,
    speed_index: usize,
    depth_to_mm: f32,
) -> Option<()> {
    let mut add = |from_mm: f32, to_mm: f32| {
        if from_mm < to_mm {
            let place = ranges_mm.iter().position(|&(other_mm, _)| from_mm < other_mm);
            let _ = ranges_mm.insert(place.unwrap_or(ranges_mm.len()), (from_mm, to_mm));
        }
    };
    let mut from_mm = 0.0;
    for interval in cut.stored(layer, speed_index)? {
        let interval = interval?;
        add(from_mm, interval.from.0);
        from_mm = interval.to.0;
    }
    add(from_mm, depth_to_mm);
    Some(())
}
