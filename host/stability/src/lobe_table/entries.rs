//! Entries of a column of the lobe table: the unstable depths at one spindle speed.

use quietcut_core::lobes::{Interval, IntervalKind, format::MAX_INTERVALS};
use quietcut_core::units::{Hertz, Millimeters};

use crate::limits::speed_line::SpeedLine;
use crate::spectrum::stability_loss::StabilityLoss;

/// Entry of a lobe table: an interval of unstable depths, with both ends in full precision.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Entry {
    pub(super) interval: Interval,
    pub(super) from_mm: f64,
    pub(super) to_mm: f64,
}

/// Depth intervals, mm, up to `depth_mm` that are stable with a single stable orbit. Where two stable orbits exist,
/// stability depends on how the cut began.
pub(super) fn surely_stable(line: &SpeedLine, depth_mm: f64) -> Vec<[f64; 2]> {
    // Stable depths are cut at `depth_mm`, since a branch of forced orbits may extend one step beyond.
    let mut stable: Vec<[f64; 2]> = line
        .stable_mm
        .iter()
        .map(|&[from, to]| [from, to.min(depth_mm)])
        .filter(|[from, to]| from < to)
        .collect();
    for &[from, to] in &line.bistable_mm {
        stable = stable
            .into_iter()
            .flat_map(|[low, high]| [[low, high.min(from)], [low.max(to), high]])
            .filter(|[low, high]| low < high)
            .collect();
    }
    stable
}

/// Entries for the depths up to `depth_mm` at one spindle speed that are unstable or have two stable orbits, ascending.
pub(super) fn unstable(line: &SpeedLine, depth_mm: f64) -> Vec<Entry> {
    let mut entries: Vec<Entry> = Vec::new();
    let mut from_mm = 0.0;
    let ends = surely_stable(line, depth_mm)
        .into_iter()
        .chain([[depth_mm, depth_mm]]);
    for [stable_from, stable_to] in ends {
        if stable_from > from_mm {
            let switch = line.switches.iter().find(|switch| switch.depth_mm == from_mm);
            // If a second stable orbit begins at a depth without a stability switch, the jump to that orbit counts as a
            // fold.
            let is_jump = line.bistable_mm.iter().any(|interval| interval[0] == from_mm);
            let kind = match switch {
                Some(switch) => table_kind(switch.kind),
                None if is_jump => IntervalKind::Fold,
                None => IntervalKind::Undecided,
            };
            entries.push(Entry {
                interval: Interval {
                    from: Millimeters(from_mm as f32),
                    to: Millimeters(stable_from as f32),
                    kind,
                    chatter: Hertz(switch.and_then(|switch| switch.chatter_hz).unwrap_or(0.0) as f32),
                },
                from_mm,
                to_mm: stable_from,
            });
        }
        from_mm = stable_to;
    }
    limited(entries)
}

/// Union of the unstable depths of `entries` and `others`, limited to the capacity of a column; where both overlap, the
/// kind of stability loss is that of `entries`.
pub(super) fn with_all_of(entries: &[Entry], others: &[Entry]) -> Vec<Entry> {
    let mut all = entries.to_vec();
    for other in others {
        let mut from_mm = other.from_mm;
        let behind = entries.iter().filter(|own| own.to_mm > other.from_mm);
        for own in behind.take_while(|own| own.from_mm < other.to_mm) {
            all.extend(other.part(from_mm, own.from_mm));
            from_mm = own.to_mm;
        }
        all.extend(other.part(from_mm, other.to_mm));
    }
    all.sort_by(|a, b| a.from_mm.total_cmp(&b.from_mm));
    limited(all)
}

impl Entry {
    /// This entry with other ends, mm; `None` unless the first lies below the second.
    fn part(&self, from_mm: f64, to_mm: f64) -> Option<Self> {
        (from_mm < to_mm).then_some(Self {
            interval: Interval {
                from: Millimeters(from_mm as f32),
                to: Millimeters(to_mm as f32),
                ..self.interval
            },
            from_mm,
            to_mm,
        })
    }
}

/// Limits the unstable intervals to the capacity of a column: the narrowest stable gaps between them become unstable,
/// which errs on the safe side.
fn limited(mut entries: Vec<Entry>) -> Vec<Entry> {
    while entries.len() > MAX_INTERVALS {
        let gap = |i: usize| entries[i + 1].from_mm - entries[i].to_mm;
        let narrowest = (0..entries.len() - 1)
            .min_by(|&a, &b| gap(a).total_cmp(&gap(b)))
            .unwrap_or(0);
        let upper = entries.remove(narrowest + 1);
        entries[narrowest].to_mm = upper.to_mm;
        entries[narrowest].interval.to = upper.interval.to;
    }
    entries
}

fn table_kind(kind: StabilityLoss) -> IntervalKind {
    match kind {
        StabilityLoss::Hopf => IntervalKind::Hopf,
        StabilityLoss::Flip => IntervalKind::Flip,
        StabilityLoss::Fold => IntervalKind::Fold,
    }
}
