//! Error of a lobe table between its entries with respect to the method, and correction of entries to the safe side.

use quietcut_core::lobes::{Column, InterpolationError, LobeTable};
use quietcut_core::units::{Millimeters, Rpm};
use quietcut_core::working_point::WorkingPoint;

use super::encoding::towards;
use super::entries::{Entry, surely_stable, unstable, with_all_of};
use super::layers::{CheckedLayers, Family};
use crate::criteria::{CHECK_GROWTH, CHECK_STEP, LEAST_CHECKS, SUSPECT, TABLE_ROOM};
use crate::error::StabilityError;
use crate::limits::speed_line::SpeedLine;

/// Position of the checked speeds within the parts of a gap, alternating from gap to gap. It avoids the middle, which
/// refinement has tested, and is not symmetric, so that lobes symmetric about the gap are detected.
const OFFSETS: [f64; 2] = [0.38, 0.62];

/// Largest number of doublings of the checked speeds in a suspect gap: from two to five, eleven, 23.
const ROUNDS: usize = 3;

/// Largest disagreement between table and method, as distance of a depth from the nearest limit of the method, mm.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Miss {
    /// Largest distance over depths that are stable in the table only (unsafe side).
    pub(super) unsafe_mm: f64,
    /// Largest distance over depths that are stable by the method only (cautious side).
    pub(super) cautious_mm: f64,
}

impl Miss {
    /// Disagreement of two sets of stable depths up to `depth_mm`; depth 0 counts as a limit if nothing is stable.
    pub(super) fn between(truth: &[[f64; 2]], told: &[[f64; 2]], depth_mm: f64) -> Self {
        let ends = |set: &[[f64; 2]]| -> Vec<f64> { set.iter().flatten().copied().collect() };
        let mut limits: Vec<f64> = ends(truth)
            .into_iter()
            .filter(|&end| end > 0.0 && end < depth_mm)
            .collect();
        if truth.is_empty() {
            limits.push(0.0);
        }
        let mut all = ends(truth);
        all.extend(ends(told));
        all.extend([0.0, depth_mm]);
        // The last depth of a table is rounded and may lie beyond the last depth of the method.
        all.retain(|&end| end <= depth_mm);
        all.sort_by(f64::total_cmp);
        let is_in = |set: &[[f64; 2]], depth: f64| set.iter().any(|&[from, to]| from <= depth && depth <= to);
        let distance = |depth: f64| {
            let distances = limits.iter().map(|limit| (limit - depth).abs());
            distances.fold(f64::INFINITY, f64::min)
        };
        let mut miss = Self::default();
        for pair in all.windows(2).filter(|pair| pair[1] > pair[0]) {
            let middle = 0.5 * (pair[0] + pair[1]);
            let off = distance(pair[0]).max(distance(middle)).max(distance(pair[1]));
            match (is_in(truth, middle), is_in(told, middle)) {
                (false, true) => miss.unsafe_mm = miss.unsafe_mm.max(off),
                (true, false) => miss.cautious_mm = miss.cautious_mm.max(off),
                _ => {}
            }
        }
        miss
    }
}

impl Miss {
    /// The larger value on each side.
    fn max(self, other: Self) -> Self {
        Self {
            unsafe_mm: self.unsafe_mm.max(other.unsafe_mm),
            cautious_mm: self.cautious_mm.max(other.cautious_mm),
        }
    }

    /// True if one side is larger than `factor` times that of the other miss.
    fn exceeds(self, other: Self, factor: f64) -> bool {
        self.unsafe_mm > factor * other.unsafe_mm || self.cautious_mm > factor * other.cautious_mm
    }
}

/// Lines of the method at several speeds inside every gap of a table, in every layer and half way between layers.
pub(super) struct Checks<'a> {
    spans: &'a [CheckedLayers],
    speeds: &'a [f64],
    depth_mm: f64,
    /// Lines by layer span and gap, by ascending speed.
    lines: Vec<Vec<Vec<SpeedLine>>>,
}

impl<'a> Checks<'a> {
    /// Computes lines at two speeds per gap, or more if the gap is wide.
    pub(super) fn new(
        spans: &'a [CheckedLayers],
        speeds: &'a [f64],
        depth_mm: f64,
    ) -> Result<Self, StabilityError> {
        let places: Vec<Vec<f64>> = speeds
            .windows(2)
            .zip(OFFSETS.iter().cycle())
            .map(|(pair, offset)| {
                let width = pair[1] - pair[0];
                let count = (width / (CHECK_STEP * pair[0])).ceil().max(LEAST_CHECKS);
                // A table covers a few decades of speed at most, so that the count is small.
                (0..count as usize)
                    .map(|index| pair[0] + width * (index as f64 + offset) / count)
                    .collect()
            })
            .collect();
        let mut checks = Self {
            spans,
            speeds,
            depth_mm,
            lines: vec![vec![Vec::new(); places.len()]; spans.len()],
        };
        for span in 0..spans.len() {
            checks.add(span, &places)?;
        }
        Ok(checks)
    }

    /// Adds the lines of a span at given speeds by gap.
    fn add(&mut self, span: usize, places: &[Vec<f64>]) -> Result<(), StabilityError> {
        let all: Vec<f64> = places.iter().flatten().copied().collect();
        let lines = self.spans[span].family.lines(&all, self.depth_mm)?;
        let mut lines = lines.into_iter();
        for (own, places) in self.lines[span].iter_mut().zip(places) {
            own.extend(lines.by_ref().take(places.len()));
            own.sort_by(|a, b| a.rpm.total_cmp(&b.rpm));
        }
        Ok(())
    }

    /// Checks suspect gaps at more speeds, until the largest disagreement stops growing.
    ///
    /// # Errors
    /// As the method.
    pub(super) fn resolve(&mut self, table: &LobeTable<'_>, tolerance_mm: f64) -> Result<(), StabilityError> {
        let least = Miss {
            unsafe_mm: SUSPECT * tolerance_mm,
            cautious_mm: SUSPECT * tolerance_mm,
        };
        let misses = |checks: &Self| -> Vec<Vec<Miss>> {
            (0..checks.spans.len())
                .map(|span| checks.misses(table, span))
                .collect()
        };
        let mut worst = misses(self);
        let mut open: Vec<Vec<bool>> = worst
            .iter()
            .map(|gaps| gaps.iter().map(|miss| miss.exceeds(least, 1.0)).collect())
            .collect();
        for _ in 0..ROUNDS {
            if !open.iter().flatten().any(|&open| open) {
                break;
            }
            self.check_again(&open)?;
            let next = misses(self);
            let pairs = next.iter().flatten().zip(worst.iter().flatten());
            for (open, (next, worst)) in open.iter_mut().flatten().zip(pairs) {
                *open &= next.exceeds(worst.max(least), CHECK_GROWTH);
            }
            worst = next;
        }
        Ok(())
    }

    /// Midpoints between the checked speeds of a gap, including its ends.
    fn middles(&self, span: usize, gap: usize) -> Vec<f64> {
        let mut known = vec![self.speeds[gap]];
        known.extend(self.lines[span][gap].iter().map(|line| line.rpm));
        known.push(self.speeds[gap + 1]);
        known.windows(2).map(|pair| 0.5 * (pair[0] + pair[1])).collect()
    }

    /// Largest disagreement in every gap of a layer span.
    fn misses(&self, table: &LobeTable<'_>, span: usize) -> Vec<Miss> {
        let family = &self.spans[span].family;
        let miss = |line: &SpeedLine| {
            let told: Vec<[f64; 2]> = told(table, family, line.rpm).map_or(Vec::new(), |column| {
                let stable = column.stable();
                stable
                    .map(|(from, to)| [f64::from(from.0), f64::from(to.0)])
                    .collect()
            });
            Miss::between(&surely_stable(line, self.depth_mm), &told, self.depth_mm)
        };
        let worst = |lines: &Vec<SpeedLine>| lines.iter().map(miss).fold(Miss::default(), Miss::max);
        self.lines[span].iter().map(worst).collect()
    }

    /// Corrects gaps in which `table` calls depths stable that are unstable, by more than `tolerance_mm`. The entries
    /// around such a gap become unstable wherever one of them or the method in the gap is: this covers steep flanks and
    /// islands between entries.
    ///
    /// Lookups in such a gap, and in its neighbours, then err on the safe side. `entries` are by layer and speed.
    /// Returns the corrected gaps by span: their lines have shaped entries and are no independent check, so that
    /// [`check_again`](Self::check_again) adds others.
    pub(super) fn guard(
        &self,
        table: &LobeTable<'_>,
        entries: &mut [Vec<Vec<Entry>>],
        tolerance_mm: f64,
    ) -> Vec<Vec<bool>> {
        let before = entries.to_vec();
        let mut guarded = Vec::with_capacity(self.spans.len());
        for (index, span) in self.spans.iter().enumerate() {
            let misses = self.misses(table, index);
            for (gap, _) in misses
                .iter()
                .enumerate()
                .filter(|(_, miss)| miss.unsafe_mm > tolerance_mm)
            {
                let corners = || {
                    span.layers
                        .iter()
                        .flat_map(|&layer| [(layer, gap), (layer, gap + 1)])
                };
                for (layer, speed) in corners() {
                    let entry = &mut entries[layer][speed];
                    for (layer, speed) in corners() {
                        *entry = with_all_of(entry, &before[layer][speed]);
                    }
                    for line in &self.lines[index][gap] {
                        *entry = with_all_of(entry, &unstable(line, self.depth_mm));
                    }
                }
            }
            guarded.push(misses.iter().map(|miss| miss.unsafe_mm > tolerance_mm).collect());
        }
        guarded
    }

    /// Checks gaps (by span) at more speeds, half way between the checked ones.
    ///
    /// # Errors
    /// As the method.
    pub(super) fn check_again(&mut self, gaps: &[Vec<bool>]) -> Result<(), StabilityError> {
        for (span, gaps) in gaps.iter().enumerate() {
            let places = gaps.iter().enumerate();
            let places: Vec<Vec<f64>> = places
                .map(|(gap, again)| {
                    if *again {
                        self.middles(span, gap)
                    } else {
                        Vec::new()
                    }
                })
                .collect();
            self.add(span, &places)?;
        }
        Ok(())
    }

    /// Error that the table states.
    ///
    /// In depth: the largest distance of a stable depth of the table from the method's; in gaps where both have the
    /// same limits also of the method's from the table's. It is multiplied by 1.5, plus the rounding of the entries. In
    /// speed: the width of a gap, with its neighbours, in which a layer gives up more than twice the tolerance.
    pub(super) fn stated(&self, table: &LobeTable<'_>, tolerance_mm: f64) -> InterpolationError {
        let (mut depth, mut speed) = (0.0_f64, 0.0_f64);
        for (index, span) in self.spans.iter().enumerate() {
            for (gap, miss) in self.misses(table, index).into_iter().enumerate() {
                depth = depth.max(miss.unsafe_mm);
                if miss.cautious_mm <= 2.0 * tolerance_mm {
                    depth = depth.max(miss.cautious_mm);
                } else if span.layers.len() == 1 {
                    let (low, high) = (gap.saturating_sub(1), (gap + 2).min(self.speeds.len() - 1));
                    speed = speed.max((self.speeds[high] - self.speeds[low]) / self.speeds[low]);
                }
            }
        }
        InterpolationError {
            depth: Millimeters((TABLE_ROOM * depth + f64::from(table.depth_step().0)) as f32),
            // A gap as wide as the speed itself is no bound; refinement never leaves one.
            speed: speed.min(0.999) as f32,
        }
    }
}

fn told(table: &LobeTable<'_>, family: &Family, rpm: f64) -> Option<Column> {
    let point = WorkingPoint {
        axial_depth: Millimeters(0.0),
        start: family.validity.start,
        exit: family.validity.exit,
        feed_per_tooth: family.validity.feed_from,
        posture: family.validity.posture,
    };
    towards(table, family.direction_deg)
        .column(Rpm(rpm as f32), &point)
        .ok()
}
