//! Error of a lobe table between its entries with respect to the method, and correction of entries to the safe side.

use quietcut_core::lobes::{Column, InterpolationError, LobeTable};
use quietcut_core::units::{Millimeters, Rpm};
use quietcut_core::working_point::WorkingPoint;

use super::encoding::towards;
use super::entries::{Entry, surely_stable, unstable, with_all_of};
use super::layers::{CheckedLayers, TableLayer};
use crate::criteria::{CHECK_GROWTH, CHECK_STEP, LEAST_CHECKS, SUSPECT, TABLE_ROOM};
use crate::error::StabilityError;
use crate::limits::speed_line::SpeedLine;

/// Fractions that place the checked speeds in a gap between two speeds of a table, alternating from gap to gap: the gap
/// is divided into as many equal parts as it has checked speeds, and each checked speed lies at this fraction of its
/// part. The fractions avoid the middle of the gap, which refinement has tested, and are not symmetric about it, so
/// that lobes that are symmetric about the middle are detected.
const OFFSETS: [f64; 2] = [0.38, 0.62];

/// Largest number of times that a suspect gap between two speeds of a table is checked at further speeds, half way
/// between those checked before: two speeds become five, eleven, 23.
const ROUNDS: usize = 3;

/// Largest disagreement between lobe table and method: distance, mm, from a depth on whose stability they differ to the
/// nearest limit of the method.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Disagreement {
    /// Largest distance, mm, from a depth that is stable in the table only to the nearest limit of the method (unsafe
    /// side).
    pub(super) unsafe_mm: f64,
    /// Largest distance, mm, from a depth that is stable by the method only to the nearest limit of the method
    /// (cautious side).
    pub(super) cautious_mm: f64,
}

impl Disagreement {
    /// Disagreement between the stable depths of the method (`truth`) and of the table, up to `depth_mm`; depth 0
    /// counts as a limit if the method finds nothing stable. A distance is infinite if the method has no limit.
    pub(super) fn between(truth: &[[f64; 2]], tabulated: &[[f64; 2]], depth_mm: f64) -> Self {
        let ends = |set: &[[f64; 2]]| -> Vec<f64> { set.iter().flatten().copied().collect() };
        let mut limits: Vec<f64> = ends(truth)
            .into_iter()
            .filter(|&end| end > 0.0 && end < depth_mm)
            .collect();
        if truth.is_empty() {
            limits.push(0.0);
        }
        let mut all = ends(truth);
        all.extend(ends(tabulated));
        all.extend([0.0, depth_mm]);
        // The last depth of a lobe table is rounded and may lie beyond the last depth of the method.
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
            match (is_in(truth, middle), is_in(tabulated, middle)) {
                (false, true) => miss.unsafe_mm = miss.unsafe_mm.max(off),
                (true, false) => miss.cautious_mm = miss.cautious_mm.max(off),
                _ => {}
            }
        }
        miss
    }
}

impl Disagreement {
    /// Componentwise maximum of two disagreements, of the unsafe and of the cautious side.
    fn max(self, other: Self) -> Self {
        Self {
            unsafe_mm: self.unsafe_mm.max(other.unsafe_mm),
            cautious_mm: self.cautious_mm.max(other.cautious_mm),
        }
    }

    /// True if this disagreement is more than `factor` times `other`, on the unsafe or on the cautious side.
    fn exceeds(self, other: Self, factor: f64) -> bool {
        self.unsafe_mm > factor * other.unsafe_mm || self.cautious_mm > factor * other.cautious_mm
    }
}

/// Stability computed by the method at several spindle speeds between every two neighbouring speeds of a table, in
/// every layer and half way between neighbouring layers. The interpolated table is compared with it.
pub(super) struct Checks<'a> {
    checked_layers: &'a [CheckedLayers],
    speeds: &'a [f64],
    depth_mm: f64,
    /// Limits by the method at the checked speeds, by checked layers and gap of the table, each by ascending speed.
    lines: Vec<Vec<Vec<SpeedLine>>>,
}

impl<'a> Checks<'a> {
    /// Computes the limits by the method at two spindle speeds in every gap of the table, or at more if the gap is
    /// wide.
    pub(super) fn new(
        checked_layers: &'a [CheckedLayers],
        speeds: &'a [f64],
        depth_mm: f64,
    ) -> Result<Self, StabilityError> {
        let places: Vec<Vec<f64>> = speeds
            .windows(2)
            .zip(OFFSETS.iter().cycle())
            .map(|(pair, offset)| {
                let width = pair[1] - pair[0];
                let count = (width / (CHECK_STEP * pair[0])).ceil().max(LEAST_CHECKS);
                // A table covers a few decades of speed at most, so that the number of checked speeds is small.
                (0..count as usize)
                    .map(|index| pair[0] + width * (index as f64 + offset) / count)
                    .collect()
            })
            .collect();
        let mut checks = Self {
            checked_layers,
            speeds,
            depth_mm,
            lines: vec![vec![Vec::new(); places.len()]; checked_layers.len()],
        };
        for layers in 0..checked_layers.len() {
            checks.add(layers, &places)?;
        }
        Ok(checks)
    }

    /// Computes the limits by the method for one of the checked layers at further spindle speeds, given by gap of the
    /// table.
    fn add(&mut self, layers: usize, places: &[Vec<f64>]) -> Result<(), StabilityError> {
        let all: Vec<f64> = places.iter().flatten().copied().collect();
        let lines = self.checked_layers[layers]
            .table_layer
            .lines(&all, self.depth_mm)?;
        let mut lines = lines.into_iter();
        for (own, places) in self.lines[layers].iter_mut().zip(places) {
            own.extend(lines.by_ref().take(places.len()));
            own.sort_by(|a, b| a.rpm.total_cmp(&b.rpm));
        }
        Ok(())
    }

    /// Checks suspect gaps of the table at more speeds, until the largest disagreement between table and method in a
    /// gap grows by no more than the factor [`CHECK_GROWTH`], at most [`ROUNDS`] times. A gap is suspect if table and
    /// method disagree by more than [`SUSPECT`] of the tolerance.
    ///
    /// # Errors
    /// The method cannot compute the limits at a checked speed.
    pub(super) fn resolve(&mut self, table: &LobeTable<'_>, tolerance_mm: f64) -> Result<(), StabilityError> {
        let least = Disagreement {
            unsafe_mm: SUSPECT * tolerance_mm,
            cautious_mm: SUSPECT * tolerance_mm,
        };
        let misses = |checks: &Self| -> Vec<Vec<Disagreement>> {
            (0..checks.checked_layers.len())
                .map(|layers| checks.misses(table, layers))
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

    /// Speeds half way between neighbouring checked speeds of a gap of the table; the ends of the gap count as checked.
    fn middles(&self, layers: usize, gap: usize) -> Vec<f64> {
        let mut known = vec![self.speeds[gap]];
        known.extend(self.lines[layers][gap].iter().map(|line| line.rpm));
        known.push(self.speeds[gap + 1]);
        known.windows(2).map(|pair| 0.5 * (pair[0] + pair[1])).collect()
    }

    /// Largest disagreement between table and method in every gap, for one of the checked layers.
    fn misses(&self, table: &LobeTable<'_>, layers: usize) -> Vec<Disagreement> {
        let table_layer = &self.checked_layers[layers].table_layer;
        let miss = |line: &SpeedLine| {
            let tabulated: Vec<[f64; 2]> =
                column_of(table, table_layer, line.rpm).map_or(Vec::new(), |column| {
                    let stable = column.stable();
                    stable
                        .map(|(from, to)| [f64::from(from.0), f64::from(to.0)])
                        .collect()
                });
            Disagreement::between(&surely_stable(line, self.depth_mm), &tabulated, self.depth_mm)
        };
        let worst = |lines: &Vec<SpeedLine>| {
            lines
                .iter()
                .map(miss)
                .fold(Disagreement::default(), Disagreement::max)
        };
        self.lines[layers].iter().map(worst).collect()
    }

    /// Corrects gaps in which `table` calls depths stable that are unstable, by more than `tolerance_mm`. The entries
    /// at both ends of such a gap, in all layers that are checked together, become unstable at every depth at which one
    /// of them is, or the method at a checked speed in the gap: this covers steep flanks and islands between entries.
    ///
    /// Lookups in such a gap, and in its neighbours, become more cautious. `entries` are by layer and speed. Returns,
    /// by checked layers and gap, whether the gap is corrected: the limits at the checked speeds of corrected gaps have
    /// shaped entries and are no independent check, so that [`check_again`](Self::check_again) adds other speeds.
    pub(super) fn guard(
        &self,
        table: &LobeTable<'_>,
        entries: &mut [Vec<Vec<Entry>>],
        tolerance_mm: f64,
    ) -> Vec<Vec<bool>> {
        let before = entries.to_vec();
        let mut guarded = Vec::with_capacity(self.checked_layers.len());
        for (index, checked) in self.checked_layers.iter().enumerate() {
            let misses = self.misses(table, index);
            for (gap, _) in misses
                .iter()
                .enumerate()
                .filter(|(_, miss)| miss.unsafe_mm > tolerance_mm)
            {
                let corners = || {
                    checked
                        .layers
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

    /// Checks gaps of the table (by checked layers) at more speeds, half way between the checked ones.
    ///
    /// # Errors
    /// The method cannot compute the limits at a checked speed.
    pub(super) fn check_again(&mut self, gaps: &[Vec<bool>]) -> Result<(), StabilityError> {
        for (layers, gaps) in gaps.iter().enumerate() {
            let places = gaps.iter().enumerate();
            let places: Vec<Vec<f64>> = places
                .map(|(gap, again)| {
                    if *again {
                        self.middles(layers, gap)
                    } else {
                        Vec::new()
                    }
                })
                .collect();
            self.add(layers, &places)?;
        }
        Ok(())
    }

    /// Error that the table states.
    ///
    /// Error in depth: the largest distance by which stable depths of the table lie beyond limits of the method. In
    /// gaps where the table is cautious by no more than twice the tolerance, that distance counts as well. The result
    /// is multiplied by [`TABLE_ROOM`], plus the depth step to which entries are rounded. Error in speed: the largest
    /// width, relative to the speed, of a gap together with its neighbours in which the table at a layer is cautious by
    /// more than twice the tolerance; such gaps half way between layers do not count.
    pub(super) fn stated(&self, table: &LobeTable<'_>, tolerance_mm: f64) -> InterpolationError {
        let (mut depth, mut speed) = (0.0_f64, 0.0_f64);
        for (index, checked) in self.checked_layers.iter().enumerate() {
            for (gap, miss) in self.misses(table, index).into_iter().enumerate() {
                depth = depth.max(miss.unsafe_mm);
                if miss.cautious_mm <= 2.0 * tolerance_mm {
                    depth = depth.max(miss.cautious_mm);
                } else if checked.layers.len() == 1 {
                    let (low, high) = (gap.saturating_sub(1), (gap + 2).min(self.speeds.len() - 1));
                    speed = speed.max((self.speeds[high] - self.speeds[low]) / self.speeds[low]);
                }
            }
        }
        InterpolationError {
            depth: Millimeters((TABLE_ROOM * depth + f64::from(table.depth_step().0)) as f32),
            // A relative error in speed of 1 or more would be no bound: at most 0.999 is stated. Only a table of few
            // speeds over a wide range has such gaps.
            speed: speed.min(0.999) as f32,
        }
    }
}

/// Column of the lobe table at the checked speed `rpm`, rev/min. `None` if the table has none there, which counts as
/// unstable at every depth, as on the device.
fn column_of(table: &LobeTable<'_>, table_layer: &TableLayer, rpm: f64) -> Option<Column> {
    let point = WorkingPoint {
        axial_depth: Millimeters(0.0),
        start: table_layer.validity.start,
        exit: table_layer.validity.exit,
        feed_per_tooth: table_layer.validity.feed_from,
        posture: table_layer.validity.posture,
    };
    towards(table, table_layer.direction_deg)
        .column(Rpm(rpm as f32), &point)
        .ok()
}
