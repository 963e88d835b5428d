//! Bistable depths below a subcritical flip, from the limits at one speed to the lookup in a table.

use quietcut_core::lobes::{IntervalKind, LobeTable, TabulatedStability, format};
use quietcut_core::units::{Degrees, Millimeters, Rpm};
use quietcut_core::working_point::WorkingPoint;

use super::entries::{self, Entry};
use super::{TableRequest, build_table};
use crate::limits::method::Method;
use crate::orbit::ForcedProblem;
use crate::spectrum::stability_loss::StabilityLoss;

const RPM: f64 = 2010.0;

#[test]
fn below_a_subcritical_flip_a_table_has_a_bistable_entry() {
    let case = quietcut_testkit::case("hardening-flip");
    let depth_mm = 2.0;
    let line = ForcedProblem::new(&case)
        .unwrap()
        .line(RPM, depth_mm, 40)
        .unwrap();
    let limit = line.first_limit.unwrap();
    assert_eq!(limit.kind, StabilityLoss::Flip);
    let [zone] = line.bistable_mm[..] else {
        panic!("{:?}", line.bistable_mm);
    };
    assert!(zone[0] < 0.9 * zone[1] && zone[1] == limit.depth_mm, "{zone:?}");
    assert_eq!(entries::surely_stable(&line, depth_mm), [[0.0, zone[0]]]);
    let entries = entries::unstable(&line, depth_mm);
    let ranges: Vec<[f64; 2]> = entries.iter().map(|entry| [entry.from_mm, entry.to_mm]).collect();
    assert_eq!(ranges, [zone, [zone[1], depth_mm]]);
    let kinds: Vec<IntervalKind> = entries.iter().map(|entry| entry.interval.kind).collect();
    assert_eq!(kinds, [IntervalKind::Bistable, IntervalKind::Flip]);
    // The second vibration has twice the tooth period.
    assert!((entries[0].interval.chatter.0 - 0.5 * (RPM / 60.0) as f32 * 3.0).abs() < 0.1);

    let request = TableRequest {
        rpm: Some((RPM - 1.0, RPM + 1.0)),
        depth_mm: Some(depth_mm),
        speeds: Some(2),
        ..TableRequest::default()
    };
    let bytes = build_table(std::slice::from_ref(&case), &request).unwrap().bytes;
    let table = LobeTable::parse(&bytes).unwrap();
    assert_eq!(table.header().unwrap().schema, format::SCHEMA);
    let at = |share: f64| {
        let cut = case.cut().unwrap();
        let point = WorkingPoint {
            axial_depth: Millimeters((zone[0] + share * (zone[1] - zone[0])) as f32),
            start: Degrees(cut.start_deg as f32),
            exit: Degrees(cut.exit_deg as f32),
            feed_per_tooth: Millimeters(cut.feed_per_tooth_mm as f32),
            posture: case.posture.index,
        };
        match table.lookup(Rpm(RPM as f32), &point) {
            TabulatedStability::Unstable { kind, .. } => Some(kind),
            TabulatedStability::Stable { .. } => None,
            TabulatedStability::NotKnown(why) => panic!("{why:?}"),
        }
    };
    // Interpolation between the speeds of the table moves the ends of the zone a little.
    assert_eq!(at(-0.1), None);
    assert_eq!(at(0.1), Some(IntervalKind::Bistable));
    assert_eq!(at(0.9), Some(IntervalKind::Bistable));
    assert_eq!(at(1.1), Some(IntervalKind::Flip));
}

fn entry(from_mm: f64, to_mm: f64, kind: IntervalKind) -> Entry {
    Entry::new([from_mm, to_mm], kind, None)
}

#[test]
fn in_a_union_unstable_prevails_over_bistable() {
    let own = [
        entry(1.0, 2.0, IntervalKind::Bistable),
        entry(2.0, 4.0, IntervalKind::Flip),
    ];
    let others = [
        entry(0.5, 1.5, IntervalKind::Bistable),
        entry(1.5, 3.0, IntervalKind::Hopf),
    ];
    let all: Vec<(f64, f64, IntervalKind)> = entries::with_all_of(&own, &others)
        .iter()
        .map(|entry| (entry.from_mm, entry.to_mm, entry.interval.kind))
        .collect();
    let bistable = IntervalKind::Bistable;
    assert_eq!(
        all,
        [
            (0.5, 1.0, bistable),
            (1.0, 1.5, bistable),
            (1.5, 2.0, IntervalKind::Hopf),
            (2.0, 4.0, IntervalKind::Flip)
        ]
    );
}
