//! Entries of a column of the lobe table: the unstable depths at one spindle speed.

use quietcut_core::lobes::{Interval, IntervalKind, format::MAX_INTERVALS};
use quietcut_core::units::{Hertz, Millimeters};

use crate::limits::speed_line::{SpeedLine, union};
use crate::spectrum::stability_loss::StabilityLoss;

/// Entry of a lobe table: an interval of unstable depths, with both ends in full precision.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Entry {
    pub(super) interval: Interval,
    pub(super) from_mm: f64,
    pub(super) to_mm: f64,
}

/// Depth intervals, mm, up to `depth_mm` that are stable whatever disturbs the cut: with a single stable vibration. Where
/// two exist, stability depends on how the cut began, and on disturbances.
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

/// Entries for the depths up to `depth_mm` at one spindle speed that are unstable or bistable, ascending.
pub(super) fn unstable(line: &SpeedLine, depth_mm: f64) -> Vec<Entry> {
    let mut entries: Vec<Entry> = Vec::new();
    let mut from_mm = 0.0;
    let ends = surely_stable(line, depth_mm)
        .into_iter()
        .chain([[depth_mm, depth_mm]]);
    for [stable_from, stable_to] in ends {
        if stable_from > from_mm {
            parts(line, [from_mm, stable_from], &mut entries);
        }
        from_mm = stable_to;
    }
    limited(entries)
}

/// Appends the entries of a depth interval that is not surely stable: its bistable parts, and the unstable ones between
/// them, with the kind of the stability loss at their start.
fn parts(line: &SpeedLine, [from_mm, to_mm]: [f64; 2], entries: &mut Vec<Entry>) {
    let mut from_mm = from_mm;
    let switch_at = |depth_mm: f64| line.switches.iter().find(|switch| switch.depth_mm == depth_mm);
    for [low, high] in union(line.bistable_mm.clone()) {
        let (low, high) = (low.max(from_mm), high.min(to_mm));
        if low >= high {
            continue;
        }
        if low > from_mm {
            let switch = switch_at(from_mm);
            let kind = switch.map_or(IntervalKind::Undecided, |switch| table_kind(switch.kind));
            entries.push(Entry::new(
                [from_mm, low],
                kind,
                switch.and_then(|switch| switch.chatter_hz),
            ));
        }
        // The frequency of the second vibration is that of the loss at which the bistable interval ends.
        let chatter_hz = switch_at(high).and_then(|switch| switch.chatter_hz);
        entries.push(Entry::new([low, high], IntervalKind::Bistable, chatter_hz));
        from_mm = high;
    }
    if from_mm < to_mm {
        let switch = switch_at(from_mm);
        let kind = switch.map_or(IntervalKind::Undecided, |switch| table_kind(switch.kind));
        entries.push(Entry::new(
            [from_mm, to_mm],
            kind,
            switch.and_then(|switch| switch.chatter_hz),
        ));
    }
}

/// Union of the unstable and bistable depths of `entries` and `others`, limited to the capacity of a column. Where both
/// overlap, unstable prevails over bistable, and otherwise the kind of `entries`.
pub(super) fn with_all_of(entries: &[Entry], others: &[Entry]) -> Vec<Entry> {
    let mut all: Vec<Entry> = Vec::new();
    for is_bistable in [false, true] {
        for added in [entries, others] {
            let own = all.clone();
            let of_kind = |entry: &&Entry| (entry.interval.kind == IntervalKind::Bistable) == is_bistable;
            for entry in added.iter().filter(of_kind) {
                fill(&mut all, &own, entry);
            }
            all.sort_by(|a, b| a.from_mm.total_cmp(&b.from_mm));
        }
    }
    limited(all)
}

/// Appends the parts of an entry that the ascending entries `own` leave free.
fn fill(all: &mut Vec<Entry>, own: &[Entry], entry: &Entry) {
    let mut from_mm = entry.from_mm;
    let behind = own.iter().filter(|own| own.to_mm > entry.from_mm);
    for own in behind.take_while(|own| own.from_mm < entry.to_mm) {
        all.extend(entry.part(from_mm, own.from_mm));
        from_mm = own.to_mm;
    }
    all.extend(entry.part(from_mm, entry.to_mm));
}

impl Entry {
    pub(super) fn new([from_mm, to_mm]: [f64; 2], kind: IntervalKind, chatter_hz: Option<f64>) -> Self {
        Self {
            interval: Interval {
                from: Millimeters(from_mm as f32),
                to: Millimeters(to_mm as f32),
                kind,
                chatter: Hertz(chatter_hz.unwrap_or(0.0) as f32),
            },
            from_mm,
            to_mm,
        }
    }

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
        // What is unstable in one part must not be called bistable.
        if entries[narrowest].interval.kind == IntervalKind::Bistable {
            entries[narrowest].interval.kind = upper.interval.kind;
        }
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
