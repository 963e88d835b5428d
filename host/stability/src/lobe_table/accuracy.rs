//! How far a table's answers between its entries are from the method's own, and entries that keep them on the safe side.

use quietcut_core::lobes::{Column, InterpolationError, LobeTable};
use quietcut_core::units::{Millimeters, Rpm};
use quietcut_core::working_point::WorkingPoint;

use super::encoding::towards;
use super::entries::{Entry, surely_stable, unstable, with_all_of};
use super::layers::{Family, Span};
use crate::error::StabilityError;
use crate::limits::speed_line::SpeedLine;

/// Where in a gap it is checked, in turn: refinement has looked at the middle.
const SHARES: [f64; 2] = [0.38, 0.62];

/// What is stated over what is found at the places checked.
const ROOM: f64 = 1.5;

/// Depths at which a table differs from the method, by their distance from the nearest limit of the method, mm.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Miss {
    /// Largest of depths that the table calls stable and the method does not.
    pub(super) unsafe_mm: f64,
    /// Largest of depths that the method calls stable and the table does not.
    pub(super) cautious_mm: f64,
}

impl Miss {
    /// Where two sets of stable depths up to `depth_mm` disagree; depth 0 is a limit where nothing is stable.
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
        // The last depth of a table is rounded, and may lie beyond.
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

/// The method's own lines in every gap between speeds, in every layer and half way between layers.
pub(super) struct Checks<'a> {
    spans: &'a [Span],
    speeds: &'a [f64],
    depth_mm: f64,
    /// By span and gap.
    lines: Vec<Vec<SpeedLine>>,
}

impl<'a> Checks<'a> {
    pub(super) fn new(spans: &'a [Span], speeds: &'a [f64], depth_mm: f64) -> Result<Self, StabilityError> {
        let between: Vec<f64> = speeds
            .windows(2)
            .zip(SHARES.iter().cycle())
            .map(|(pair, share)| pair[0] + (pair[1] - pair[0]) * share)
            .collect();
        let lines = spans.iter().map(|span| span.family.lines(&between, depth_mm));
        Ok(Self {
            spans,
            speeds,
            depth_mm,
            lines: lines.collect::<Result<_, _>>()?,
        })
    }

    /// By span and gap.
    fn misses(&self, table: &LobeTable<'_>) -> Vec<Vec<Miss>> {
        let miss = |span: &Span, line: &SpeedLine| {
            let told: Vec<[f64; 2]> = told(table, &span.family, line.rpm).map_or(Vec::new(), |column| {
                let stable = column.stable();
                stable
                    .map(|(from, to)| [f64::from(from.0), f64::from(to.0)])
                    .collect()
            });
            Miss::between(&surely_stable(line, self.depth_mm), &told, self.depth_mm)
        };
        let spans = self.spans.iter().zip(&self.lines);
        spans
            .map(|(span, lines)| lines.iter().map(|line| miss(span, line)).collect())
            .collect()
    }

    /// Makes the entries around every gap in which `table` calls something stable that is unstable, by more than
    /// `tolerance_mm`, unstable wherever one of them or the method in the gap is: steep flanks, and islands between entries.
    ///
    /// Lookups in such a gap, and in those beside it, then err to the safe side. `entries` are by layer and speed.
    pub(super) fn guard(&self, table: &LobeTable<'_>, entries: &mut [Vec<Vec<Entry>>], tolerance_mm: f64) {
        let before = entries.to_vec();
        for ((span, lines), misses) in self.spans.iter().zip(&self.lines).zip(self.misses(table)) {
            for (gap, (line, miss)) in lines.iter().zip(misses).enumerate() {
                if miss.unsafe_mm <= tolerance_mm {
                    continue;
                }
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
                    *entry = with_all_of(entry, &unstable(line, self.depth_mm));
                }
            }
        }
    }

    /// What is stated.
    ///
    /// In depth: the largest distance of a stable depth of the table from the method's, and in gaps where both have the same limits
    /// also of the method's from the table's, times 1.5, with the rounding of the entries. In speed: how far a gap reaches, with those
    /// beside it, in which a layer gives up more than twice the tolerance.
    pub(super) fn stated(&self, table: &LobeTable<'_>, tolerance_mm: f64) -> InterpolationError {
        let (mut depth, mut speed) = (0.0_f64, 0.0_f64);
        for (span, misses) in self.spans.iter().zip(self.misses(table)) {
            for (gap, miss) in misses.into_iter().enumerate() {
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
            depth: Millimeters((ROOM * depth + f64::from(table.depth_step().0)) as f32),
            // A gap as wide as the speed itself bounds nothing; refinement never leaves one.
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
