//! Looks up a large lobe table and computes one digest of the answers, as [`chain_bits`](super::chain_bits) does for the signal
//! chain.

use quietcut_core::advice::{Action, Advice, advise};
use quietcut_core::detector::{Judgement, Reason, Verdict};
use quietcut_core::lobes::{
    Content, Interval, IntervalKind, Layer, LobeTable, TabulatedStability, Validity, encode,
};
use quietcut_core::units::{Degrees, Hertz, Millimeters, Rpm};
use quietcut_core::working_point::{Tool, WorkingPoint};

const SPEEDS: usize = 600;
const LAYERS: usize = 6;
/// Length in bytes of the table that [`encode`] writes for 600 speeds, 6 layers and 3 intervals per column.
const LENGTH: usize = 96_252;

/// Memory for the table and for the content from which it is encoded.
pub struct Memory {
    intervals: [[Interval; 3]; SPEEDS],
    bytes: [u8; LENGTH],
}

impl Memory {
    /// Empty memory.
    pub const fn new() -> Self {
        let nothing = Interval {
            from: Millimeters(0.0),
            to: Millimeters(0.0),
            kind: IntervalKind::Hopf,
            chatter: Hertz(0.0),
        };
        Self {
            intervals: [[nothing; 3]; SPEEDS],
            bytes: [0; LENGTH],
        }
    }

    /// Encodes a table of eight lobes from 600 to 2 397 rev/min, with a narrow flip and a narrow fold interval below each limit.
    pub fn table(&mut self) -> Option<LobeTable<'_>> {
        for (index, column) in self.intervals.iter_mut().enumerate() {
            // Falls from 1 in a pocket to 0 in the middle of a lobe and rises again.
            let depth_of_lobe = ((index % 75) as f32 / 37.5 - 1.0).abs();
            let limit_mm = 0.5 + 1.5 * depth_of_lobe * depth_of_lobe;
            let interval = |from_mm: f32, to_mm, kind| Interval {
                from: Millimeters(from_mm),
                to: Millimeters(to_mm),
                kind,
                chatter: Hertz(17.0 + depth_of_lobe),
            };
            *column = [
                interval(0.8 * limit_mm, 0.81 * limit_mm, IntervalKind::Flip),
                interval(0.9 * limit_mm, 0.91 * limit_mm, IntervalKind::Fold),
                interval(limit_mm, 6.0, IntervalKind::Hopf),
            ];
        }
        let mut columns: [&[Interval]; SPEEDS] = [&[]; SPEEDS];
        for (column, intervals) in columns.iter_mut().zip(&self.intervals) {
            *column = intervals;
        }
        let speeds: [Rpm; SPEEDS] = core::array::from_fn(|index| Rpm(600.0 + 3.0 * index as f32));
        let layers: [Layer<'_>; LAYERS] = core::array::from_fn(|layer| {
            let feed = Millimeters(0.05 * (layer + 1) as f32);
            let validity = Validity {
                feed_from: feed,
                feed_to: feed,
                start: Degrees(90.0),
                exit: Degrees(180.0),
                posture: 0,
            };
            Layer {
                validity,
                columns: &columns,
            }
        });
        let content = Content {
            name: "eight-lobes",
            teeth: 2,
            limits: None,
            depth_from: Millimeters(0.0),
            depth_to: Millimeters(6.0),
            speeds: &speeds,
            layers: &layers,
        };
        let bytes = encode(&content, &mut self.bytes).ok()?;
        LobeTable::parse(bytes).ok()
    }
}

impl Default for Memory {
    fn default() -> Self {
        Self::new()
    }
}

/// Working point with this depth and a feed between those of two layers.
pub fn cut(depth_mm: f32) -> WorkingPoint {
    WorkingPoint {
        axial_depth: Millimeters(depth_mm),
        start: Degrees(90.0),
        exit: Degrees(180.0),
        feed_per_tooth: Millimeters(0.12),
        posture: 0,
    }
}

/// Advice for chatter at this speed and depth.
pub fn advice(table: &LobeTable<'_>, rpm: f32, depth_mm: f32) -> Advice {
    let judgement = Judgement {
        verdict: Verdict::Hopf,
        reason: Reason::Growing,
        chatter: Some(Hertz(17.5)),
        multiplier_abs: None,
        confidence: 1.0,
    };
    advise(
        &judgement,
        Rpm(rpm),
        Some(table),
        Some(&cut(depth_mm)),
        None,
        &Tool { teeth: 2 },
    )
}

/// Digest of lookups and advice over the whole table.
pub fn of_table(table: &LobeTable<'_>) -> u32 {
    let mut digest = 2_166_136_261_u32;
    let mut word = |word: u32| digest = (digest ^ word).wrapping_mul(16_777_619);
    for step in 0..50_u16 {
        let rpm = 601.0 + 35.7 * f32::from(step);
        for depth_mm in [0.42, 1.1, 3.0] {
            match table.lookup(Rpm(rpm), &cut(depth_mm)) {
                TabulatedStability::Stable { margin } => word(margin.0.to_bits()),
                TabulatedStability::Unstable {
                    kind,
                    chatter,
                    margin,
                } => {
                    word(kind as u32);
                    word(chatter.0.to_bits());
                    word(margin.0.to_bits());
                }
                TabulatedStability::NotKnown(_) => word(u32::MAX),
            }
            if step % 10 == 0 {
                let advice = advice(table, rpm, depth_mm);
                word(u32::from(advice.action == Action::Speed));
                word(advice.speed.0.to_bits());
                word(advice.depth.map_or(0, |depth| depth.0.to_bits()));
            }
        }
    }
    digest
}
