//! The lobe table: bytes, refused tables, lookups.
#![allow(clippy::unwrap_used, clippy::panic)]

mod support;

use proptest::prelude::*;
use quietcut_core::checksum::crc32;
use quietcut_core::lobes::format::{HEADER_LENGTH, MAX_INTERVALS};
use quietcut_core::lobes::{
    Column, Content, Header, Interval, IntervalKind, Layer, LobeTable, NotKnown, TableError,
    TabulatedStability, encode, encoded_length,
};
use quietcut_core::units::{Degrees, Hertz, Millimeters, Rpm};
use quietcut_core::working_point::WorkingPoint;
use support::{LIMITS, Owned, acetal, interval, table, validity, working_point};

fn is_stable(column: &Column, depth_mm: f32) -> bool {
    matches!(
        column.at(Millimeters(depth_mm)),
        TabulatedStability::Stable { .. }
    )
}

proptest! {
    #[test]
    fn decoded_entries_err_by_less_than_a_step_to_the_unstable_side(content in table()) {
        let bytes = content.encode().unwrap();
        let table = LobeTable::parse(&bytes).unwrap();
        prop_assert_eq!(table.name(), "kuka-kr90-acetal");
        prop_assert_eq!(table.teeth(), 2);
        prop_assert_eq!(table.limits(), LIMITS);
        prop_assert_eq!(table.speeds().collect::<Vec<_>>(), content.speeds.clone());
        // The tolerance is one depth step, 1/50 step for snapping, and the rounding of an f32 of the largest depth.
        let step_mm = table.depth_step().0;
        let (outward_mm, inward_mm) = (1.02 * step_mm, 0.02 * step_mm + 2e-7 * content.depth_to_mm);
        for (layer, (validity, columns)) in content.layers.iter().enumerate() {
            prop_assert_eq!(table.layers().nth(layer), Some(*validity));
            for (speed, column) in columns.iter().enumerate() {
                let entry = table.entry(layer, speed).unwrap();
                // Touching intervals of equal kind and frequency are merged.
                prop_assert!(entry.intervals().len() <= column.len());
                if entry.intervals().len() < column.len() { continue }
                for (read, written) in entry.intervals().iter().zip(column) {
                    prop_assert_eq!(read.kind, written.kind);
                    let from_mm = written.from.0 - read.from.0;
                    let to_mm = read.to.0 - written.to.0;
                    // An interval that touches the preceding one begins at the rounded end of the preceding one.
                    prop_assert!((-inward_mm - step_mm..=outward_mm).contains(&from_mm), "{} {}", read.from, written.from);
                    prop_assert!((-inward_mm..=outward_mm).contains(&to_mm), "{} {}", read.to, written.to);
                    // The tolerance is half a step and rounding. A frequency above 0 is not rounded to 0.
                    let tolerance_hz = table.chatter_error().0 * 2.0 + 1e-4;
                    prop_assert!((read.chatter.0 - written.chatter.0).abs() <= tolerance_hz);
                }
            }
        }
    }

    #[test]
    fn reading_and_writing_again_keeps_the_bytes(content in table()) {
        let bytes = content.encode().unwrap();
        let once = Owned::decode(&LobeTable::parse(&bytes).unwrap()).encode().unwrap();
        let twice = Owned::decode(&LobeTable::parse(&once).unwrap()).encode().unwrap();
        prop_assert_eq!(once, twice);
    }

    #[test]
    fn a_flipped_bit_is_refused(content in table(), position in any::<prop::sample::Index>(), bit in 0..8) {
        let mut bytes = content.encode().unwrap();
        let position = position.index(bytes.len());
        bytes[position] ^= 1_u8 << bit;
        prop_assert!(LobeTable::parse(&bytes).is_err());
    }

    #[test]
    fn bytes_damaged_after_their_check_are_read_without_panic(
        content in table(), damage in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 1..20),
        rpm in 400.0_f32..3000.0, depth_mm in -1.0_f32..25.0,
    ) {
        let mut bytes = content.encode().unwrap();
        for (position, byte) in damage {
            let position = position.index(bytes.len());
            bytes[position] = byte;
        }
        if let Ok(table) = LobeTable::reopen(&bytes) {
            for layer in table.layers() {
                let _ = table.lookup(Rpm(rpm), &working_point(&layer, depth_mm));
            }
        }
    }

    #[test]
    fn at_grid_speeds_the_column_equals_the_entry(content in table()) {
        let bytes = content.encode().unwrap();
        let table = LobeTable::parse(&bytes).unwrap();
        for (layer, validity) in table.layers().enumerate() {
            for (speed, rpm) in table.speeds().enumerate() {
                let column = table.column(rpm, &working_point(&validity, 1.0)).unwrap();
                prop_assert_eq!(Some(column), table.entry(layer, speed));
            }
        }
    }

    #[test]
    fn between_different_columns_a_depth_is_stable_if_it_is_in_both(
        content in table(), position in 0.0_f32..1.0, depth in 0.0_f32..1.0,
    ) {
        if content.speeds.len() < 2 { return Ok(()) }
        let bytes = content.encode().unwrap();
        let table = LobeTable::parse(&bytes).unwrap();
        let depth_mm = content.depth_from_mm + depth * (content.depth_to_mm - content.depth_from_mm);
        let at = working_point(&validity(0.05), depth_mm);
        let (a, b) = (table.entry(0, 0).unwrap(), table.entry(0, 1).unwrap());
        let rpm = content.speeds[0].0 + position * (content.speeds[1].0 - content.speeds[0].0);
        let between = table.column(Rpm(rpm), &at).unwrap();
        match (is_stable(&a, depth_mm), is_stable(&b, depth_mm)) {
            (true, true) => prop_assert!(is_stable(&between, depth_mm)),
            (false, false) => prop_assert!(!is_stable(&between, depth_mm)),
            _ => {}
        }
    }

    #[test]
    fn a_limit_moves_monotonously_between_its_neighbours(
        limits_mm in prop::array::uniform4(0.5_f32..5.0), steps in prop::collection::vec(0.0_f32..1.0, 2..20),
    ) {
        let columns = limits_mm.map(|mm| vec![interval(mm, 6.0, IntervalKind::Hopf, 20.0 * mm)]);
        let [a, b, c, d] = columns;
        let content = Owned {
            limits: LIMITS,
            depth_from_mm: 0.0, depth_to_mm: 6.0, speeds: vec![Rpm(1000.0), Rpm(1100.0)],
            layers: vec![(validity(0.1), vec![a, b]), (validity(0.2), vec![c, d])],
        };
        let bytes = content.encode().unwrap();
        let table = LobeTable::parse(&bytes).unwrap();
        let limit = |rpm: f32, feed_mm: f32| {
            let mut at = working_point(&validity(0.1), 1.0);
            at.feed_per_tooth = Millimeters(feed_mm);
            let column = table.column(Rpm(rpm), &at).unwrap();
            let first = column.first_limit().unwrap();
            (first.from.0, first.chatter.0)
        };
        let mut sorted = steps;
        sorted.sort_by(f32::total_cmp);
        // Rounding of the interpolation between two f32 depths.
        let rounding_mm = 1e-6;
        for pair in sorted.windows(2) {
            let along = |from: (f32, f32), to: (f32, f32), earlier: (f32, f32), later: (f32, f32)| {
                (later.0 - earlier.0) * (to.0 - from.0).signum() >= -rounding_mm
                    && (later.1 - earlier.1) * (to.1 - from.1).signum() >= -20.0 * rounding_mm
            };
            let [x, y] = [1000.0 + 100.0 * pair[0], 1000.0 + 100.0 * pair[1]];
            prop_assert!(along(limit(1000.0, 0.1), limit(1100.0, 0.1), limit(x, 0.1), limit(y, 0.1)));
            let [x, y] = [0.1 + 0.1 * pair[0], 0.1 + 0.1 * pair[1]];
            prop_assert!(along(limit(1050.0, 0.1), limit(1050.0, 0.2), limit(1050.0, x), limit(1050.0, y)));
        }
    }
}

#[test]
fn every_flipped_bit_and_every_other_length_is_refused() {
    let bytes = acetal().encode().unwrap();
    for bit in 0..8 * bytes.len() {
        let mut damaged = bytes.clone();
        damaged[bit / 8] ^= 1 << (bit % 8);
        assert!(LobeTable::parse(&damaged).is_err(), "bit {bit}");
    }
    for length in 0..bytes.len() {
        assert!(LobeTable::parse(&bytes[..length]).is_err(), "length {length}");
    }
    let longer = [bytes.as_slice(), &[0]].concat();
    let [header, found] = [bytes.len() as u32, longer.len() as u32];
    assert_eq!(
        LobeTable::parse(&longer).unwrap_err(),
        TableError::Length { header, found }
    );
}

#[test]
fn each_fault_has_its_own_error() {
    let good = acetal().encode().unwrap();
    // Changes bytes of the content and corrects the CRC, so that only the check of the content can find the error.
    let forged = |offset: usize, with: &[u8]| {
        let mut bytes = good.clone();
        bytes[offset..offset + with.len()].copy_from_slice(with);
        let crc = crc32([&bytes[..28], &bytes[32..]]);
        bytes[28..32].copy_from_slice(&crc.to_le_bytes());
        LobeTable::parse(&bytes).unwrap_err()
    };
    assert_eq!(forged(0, b"PNG!"), TableError::Magic { found: *b"PNG!" });
    assert_eq!(forged(4, &[4, 0]), TableError::Schema { found: 4, known: 3 });
    assert!(
        matches!(forged(6, &[1]), TableError::Crc { .. }),
        "a header that is not zero where it must be"
    );
    assert_eq!(
        forged(8, &[9, 0, 0, 0]),
        TableError::TooShort { needed: 96, found: 9 }
    );
    assert!(matches!(
        forged(8, &[0, 1, 0, 0]),
        TableError::Length { header: 256, .. }
    ));
    assert_eq!(forged(32, &[0]), TableError::Teeth);
    assert_eq!(forged(33, &[33]), TableError::Name { length: 33 });
    assert_eq!(forged(64, &[0xFF]), TableError::Name { length: 16 });
    assert!(matches!(forged(34, &[2]), TableError::Arrays { .. }));
    assert!(matches!(
        forged(40, &f32::NAN.to_le_bytes()),
        TableError::Limits { .. }
    ));
    assert!(matches!(
        forged(48, &7.0_f32.to_le_bytes()),
        TableError::Depths { .. }
    ));
    assert!(matches!(
        forged(56, &f32::INFINITY.to_le_bytes()),
        TableError::Chatter { .. }
    ));
    assert_eq!(
        forged(96, &(-1.0_f32).to_le_bytes()),
        TableError::Layer { layer: 0 }
    );
    let second_speed = 96 + 24 + 4;
    assert_eq!(
        forged(second_speed, &900.0_f32.to_le_bytes()),
        TableError::SpeedOrder {
            index: 1,
            found: Rpm(900.0)
        }
    );
    let columns = 96 + 24 + 5 * 4;
    assert_eq!(
        forged(columns, &[1]),
        TableError::ColumnOrder { layer: 0, speed: 0 }
    );
    let intervals = columns + 6 * 2;
    assert_eq!(
        forged(intervals + 6, &[4]),
        TableError::IntervalOrder {
            layer: 0,
            speed: 0,
            interval: 0
        },
        "a kind that does not exist"
    );
    assert_eq!(
        forged(intervals + 8, &[0xFF, 0xFF]),
        TableError::IntervalOrder {
            layer: 0,
            speed: 1,
            interval: 0
        }
    );

    let mut damaged = good.clone();
    damaged[70] ^= 1;
    let TableError::Crc { header, computed } = LobeTable::parse(&damaged).unwrap_err() else {
        panic!("a CRC error")
    };
    assert_ne!(header, computed);
}

#[test]
fn content_that_is_no_table_is_refused() {
    let error = |change: fn(&mut Owned)| {
        let mut content = acetal();
        change(&mut content);
        content.encode().unwrap_err()
    };
    assert_eq!(
        error(|c| c.speeds[2] = Rpm(1036.0)),
        TableError::SpeedOrder {
            index: 2,
            found: Rpm(1036.0)
        }
    );
    assert!(matches!(
        error(|c| c.speeds[2] = Rpm(f32::NAN)),
        TableError::SpeedOrder { index: 2, .. }
    ));
    assert_eq!(
        error(|c| c.layers[0].1.truncate(3)),
        TableError::Columns {
            layer: 0,
            found: 3,
            speeds: 5
        }
    );
    assert_eq!(
        error(|c| c.layers.clear()),
        TableError::Count { speeds: 5, layers: 0 }
    );
    assert_eq!(
        error(|c| c.layers.push(c.layers[0].clone())),
        TableError::Layer { layer: 1 }
    );
    let near = |c: &mut Owned| {
        let mut layer = c.layers[0].clone();
        layer.0.exit = Degrees(180.4);
        c.layers.push(layer);
    };
    assert_eq!(error(near), TableError::Layer { layer: 1 });
    let order = |interval| TableError::IntervalOrder {
        layer: 0,
        speed: 1,
        interval,
    };
    assert_eq!(error(|c| c.layers[0].1[1][1].from = Millimeters(2.0)), order(1));
    assert_eq!(error(|c| c.layers[0].1[1][1].to = Millimeters(6.5)), order(1));
    assert_eq!(
        error(|c| c.layers[0].1[1][0].from = Millimeters(f32::NAN)),
        order(0)
    );
    assert_eq!(
        error(|c| c.layers[0].1[1][0].chatter = Hertz(-1.0)),
        TableError::Chatter { found: Hertz(-1.0) }
    );
    let many = |c: &mut Owned| {
        c.layers[0].1[4] = (0..13_u8)
            .map(|k| {
                interval(
                    f32::from(k) / 4.0,
                    f32::from(k) / 4.0 + 0.1,
                    IntervalKind::Fold,
                    0.0,
                )
            })
            .collect();
    };
    assert_eq!(
        error(many),
        TableError::TooManyIntervals {
            layer: 0,
            speed: 4,
            found: 13
        }
    );

    let content = Content {
        name: "a name that is longer than thirty-two bytes",
        teeth: 2,
        limits: None,
        depth_from: Millimeters(0.0),
        depth_to: Millimeters(1.0),
        speeds: &[Rpm(1000.0)],
        layers: &[Layer {
            validity: validity(0.1),
            columns: &[&[]],
        }],
    };
    assert_eq!(
        encode(&content, &mut [0; 500]).unwrap_err(),
        TableError::Name { length: 43 }
    );
    let content = Content {
        name: "short",
        ..content
    };
    let needed = encoded_length(&content);
    assert_eq!(
        encode(&content, &mut [0; 50]).unwrap_err(),
        TableError::Buffer { needed, found: 50 }
    );
    let mut buffer = [0; 500];
    let bytes = encode(&content, &mut buffer).unwrap();
    assert_eq!(LobeTable::parse(bytes).unwrap().limits(), None);
}

#[test]
fn an_interval_thinner_than_a_step_is_kept() {
    let mut content = acetal();
    let sliver = |from_mm: f32, to_mm: f32| interval(from_mm, to_mm, IntervalKind::Flip, 17.0);
    content.layers[0].1[0] = vec![
        interval(1.0, 2.0, IntervalKind::Hopf, 20.0),
        sliver(2.0, 2.000_001),
        interval(3.0, 5.999_99, IntervalKind::Hopf, 20.0),
        sliver(5.999_99, 6.0),
    ];
    let bytes = content.encode().unwrap();
    let table = LobeTable::parse(&bytes).unwrap();
    let entry = table.entry(0, 0).unwrap();
    let kinds: Vec<IntervalKind> = entry.intervals().iter().map(|i| i.kind).collect();
    assert_eq!(
        kinds,
        [
            IntervalKind::Hopf,
            IntervalKind::Flip,
            IntervalKind::Hopf,
            IntervalKind::Flip
        ]
    );
}

#[test]
fn the_generation_of_a_slot_is_under_the_checksum() {
    let bytes = acetal().encode().unwrap();
    let header = Header::read(&bytes).unwrap();
    assert_eq!((header.generation, header.length as usize), (0, bytes.len()));
    let renewed = header.with_generation(7, &bytes[HEADER_LENGTH..]);
    let slot = [&renewed.to_bytes(), &bytes[HEADER_LENGTH..]].concat();
    assert_eq!(LobeTable::parse(&slot).unwrap().header().unwrap().generation, 7);
    let old_crc = Header {
        generation: 8,
        ..renewed
    };
    let slot = [&old_crc.to_bytes(), &bytes[HEADER_LENGTH..]].concat();
    assert!(matches!(LobeTable::parse(&slot), Err(TableError::Crc { .. })));
}

#[test]
fn six_layers_of_six_hundred_speeds_take_about_a_hundred_kilobytes() {
    let island = [
        interval(1.0, 1.2, IntervalKind::Flip, 17.0),
        interval(1.4, 1.6, IntervalKind::Fold, 17.0),
        interval(2.0, 6.0, IntervalKind::Hopf, 19.0),
    ];
    let columns = vec![island.to_vec(); 600];
    let content = Owned {
        limits: LIMITS,
        depth_from_mm: 0.0,
        depth_to_mm: 6.0,
        speeds: (0..600_u16).map(|k| Rpm(600.0 + 3.0 * f32::from(k))).collect(),
        layers: (1..=6_u8)
            .map(|k| (validity(0.05 * f32::from(k)), columns.clone()))
            .collect(),
    };
    assert_eq!(
        content.encode().unwrap().len(),
        96 + 6 * 24 + 600 * 4 + 6 * 601 * 2 + 6 * 600 * 3 * 8
    );
}

/// Tolerance for rounding to a depth step of 6 mm/65 535.
const STEP_MM: f32 = 1e-4;

fn assert_unstable(answer: TabulatedStability, expected: IntervalKind, hz: f32, depth_margin_mm: f32) {
    let TabulatedStability::Unstable {
        kind,
        chatter,
        margin,
    } = answer
    else {
        panic!("{answer:?}")
    };
    assert_eq!(kind, expected);
    assert!((chatter.0 - hz).abs() < 0.01, "{chatter} for {hz}");
    assert!(
        (margin.0 - depth_margin_mm).abs() < 2.0 * STEP_MM,
        "{margin} for {depth_margin_mm}"
    );
}

#[test]
fn a_flip_island_at_a_speed_of_the_grid() {
    let bytes = acetal().encode().unwrap();
    let table = LobeTable::parse(&bytes).unwrap();
    let at = |depth_mm| table.lookup(Rpm(1036.0), &working_point(&validity(0.15), depth_mm));
    let assert_stable = |depth_mm: f32, margin_mm: f32| match at(depth_mm) {
        TabulatedStability::Stable { margin } => {
            assert!((margin.0 - margin_mm).abs() < 2.0 * STEP_MM, "{margin}")
        }
        other => panic!("{other:?}"),
    };
    assert_stable(0.0, 1.575);
    assert_stable(1.5, 0.075);
    assert_unstable(at(1.6), IntervalKind::Flip, 17.27, 0.025);
    assert_stable(2.4, 0.066);
    assert_unstable(at(3.0), IntervalKind::Hopf, 19.0, 0.288);
    assert_unstable(at(6.0), IntervalKind::Hopf, 19.0, 0.0);
    let column = table
        .column(Rpm(1036.0), &working_point(&validity(0.15), 0.0))
        .unwrap();
    let stable: Vec<(f32, f32)> = column.stable().map(|(from, to)| (from.0, to.0)).collect();
    assert_eq!(stable.len(), 2);
    for ((from, to), (low, high)) in stable.into_iter().zip([(0.0, 1.575), (2.334, 2.712)]) {
        assert!((from - low).abs() < STEP_MM && (to - high).abs() < STEP_MM);
    }
    assert!(column.is_stable_within(Millimeters(2.34), Millimeters(2.7)));
    assert!(!column.is_stable_within(Millimeters(1.5), Millimeters(2.4)));
    assert!(!column.is_stable_within(Millimeters(2.4), Millimeters(2.8)));
}

#[test]
fn kinds_that_touch_are_one_unstable_range() {
    let bytes = acetal().encode().unwrap();
    let table = LobeTable::parse(&bytes).unwrap();
    // At 1 045 rev/min 4.0 mm lies in a flip interval and depths above 4.023 mm in a Hopf interval, so that the nearest stable
    // depth is 1.327 mm.
    let answer = table.lookup(Rpm(1045.0), &working_point(&validity(0.15), 4.0));
    assert_unstable(answer, IntervalKind::Flip, 17.42, 2.0);
}

#[test]
fn between_a_flip_island_and_none_the_island_remains_unstable() {
    let bytes = acetal().encode().unwrap();
    let table = LobeTable::parse(&bytes).unwrap();
    // Between 900 (Hopf from 1.723 mm) and 1 036 rev/min (flip 1.575 to 2.334 mm, Hopf from 2.712 mm), a depth is unstable if it
    // is unstable in one of both columns.
    let at = |depth_mm| table.lookup(Rpm(1000.0), &working_point(&validity(0.15), depth_mm));
    assert!(matches!(at(1.5), TabulatedStability::Stable { .. }));
    assert!(matches!(
        at(1.6),
        TabulatedStability::Unstable {
            kind: IntervalKind::Flip,
            ..
        }
    ));
    assert!(matches!(
        at(2.5),
        TabulatedStability::Unstable {
            kind: IntervalKind::Hopf,
            ..
        }
    ));
    // Between 1 100 (Hopf from 2.223 mm) and 3 000 rev/min (no interval), a depth is unstable if it is unstable in one of both
    // columns.
    let at = |depth_mm| table.lookup(Rpm(2999.0), &working_point(&validity(0.15), depth_mm));
    assert!(matches!(at(2.2), TabulatedStability::Stable { .. }));
    assert!(matches!(
        at(2.3),
        TabulatedStability::Unstable {
            kind: IntervalKind::Hopf,
            ..
        }
    ));
}

#[test]
fn outside_of_the_table_the_answer_is_not_known() {
    let mut content = acetal();
    let mut independent = content.layers[0].clone();
    independent.0.posture = 2;
    independent.0.feed_to = Millimeters(0.3);
    content.layers.push(independent);
    let mut second_feed = content.layers[0].clone();
    second_feed.0.feed_from = Millimeters(0.25);
    second_feed.0.feed_to = Millimeters(0.25);
    content.layers.push(second_feed);
    let bytes = content.encode().unwrap();
    let table = LobeTable::parse(&bytes).unwrap();
    let base = working_point(&validity(0.15), 1.0);
    let ask = |rpm, at| match table.lookup(Rpm(rpm), &at) {
        TabulatedStability::NotKnown(why) => Some(why),
        _ => None,
    };
    assert_eq!(ask(1000.0, base), None);

    let speed = |asked| {
        Some(NotKnown::Speed {
            asked: Rpm(asked),
            from: Rpm(900.0),
            to: Rpm(3000.0),
        })
    };
    assert_eq!(ask(899.9, base), speed(899.9));
    assert_eq!(ask(3000.1, base), speed(3000.1));
    assert!(matches!(ask(f32::NAN, base), Some(NotKnown::Speed { .. })));
    assert_eq!(ask(900.0, base), None);
    assert_eq!(ask(3000.0, base), None);

    let depth = |mm| {
        ask(
            1000.0,
            WorkingPoint {
                axial_depth: Millimeters(mm),
                ..base
            },
        )
    };
    for mm in [-0.1, 6.1, f32::NAN] {
        assert!(matches!(depth(mm), Some(NotKnown::Depth { .. })), "{mm}");
    }
    let feed = |mm| {
        ask(
            1000.0,
            WorkingPoint {
                feed_per_tooth: Millimeters(mm),
                ..base
            },
        )
    };
    let range = |asked| {
        let [asked, from, to] = [asked, 0.15, 0.25].map(Millimeters);
        Some(NotKnown::Feed { asked, from, to })
    };
    assert_eq!(feed(0.2), None);
    assert_eq!(feed(0.14), range(0.14));
    assert_eq!(feed(0.26), range(0.26));
    assert!(matches!(feed(f32::NAN), Some(NotKnown::Feed { .. })));

    let exit = |degrees| {
        ask(
            1000.0,
            WorkingPoint {
                exit: Degrees(degrees),
                ..base
            },
        )
    };
    assert_eq!(exit(180.4), None);
    assert_eq!(
        exit(179.0),
        Some(NotKnown::Immersion {
            start: Degrees(90.0),
            exit: Degrees(179.0)
        })
    );
    assert_eq!(
        ask(1000.0, WorkingPoint { posture: 1, ..base }),
        Some(NotKnown::Posture { asked: 1 })
    );
    // The layer of posture 2 is valid for all feeds per tooth from 0.15 to 0.3 mm.
    let posture_2 = WorkingPoint {
        posture: 2,
        feed_per_tooth: Millimeters(0.3),
        ..base
    };
    assert_eq!(ask(1000.0, posture_2), None);
}

#[test]
fn an_undecided_depth_is_not_known() {
    let mut content = acetal();
    content.layers[0].1[3] = vec![interval(0.0, 6.0, IntervalKind::Undecided, 0.0)];
    content.layers[0].1[0].insert(0, interval(1.7, 1.723, IntervalKind::Undecided, 0.0));
    let bytes = content.encode().unwrap();
    let table = LobeTable::parse(&bytes).unwrap();
    let ask = |rpm, depth_mm| table.lookup(Rpm(rpm), &working_point(&validity(0.15), depth_mm));
    let undecided = TabulatedStability::NotKnown(NotKnown::Undecided);
    assert_eq!(ask(1100.0, 1.0), undecided);
    assert_eq!(ask(900.0, 1.71), undecided);
    assert!(matches!(
        ask(900.0, 1.8),
        TabulatedStability::Unstable {
            kind: IntervalKind::Hopf,
            ..
        }
    ));
    // A depth that is stable in one neighbour and undecided in the other is not known.
    assert_eq!(ask(1090.0, 1.0), undecided);
    assert_eq!(ask(1050.0, 1.0), undecided);
}

#[test]
fn a_full_column_grows_to_the_unstable_side() {
    // Twelve islands overlap twelve others, at two speeds and two feeds. They combine to 48 intervals, more than a column holds.
    let islands = |shift_mm: f32| -> Vec<Interval> {
        (0..MAX_INTERVALS as u8)
            .map(|k| {
                interval(
                    f32::from(k) * 0.4 + shift_mm,
                    f32::from(k) * 0.4 + shift_mm + 0.05,
                    IntervalKind::Flip,
                    10.0 + f32::from(k),
                )
            })
            .collect()
    };
    let content = Owned {
        limits: LIMITS,
        depth_from_mm: 0.0,
        depth_to_mm: 6.0,
        speeds: vec![Rpm(1000.0), Rpm(1100.0)],
        layers: vec![
            (validity(0.1), vec![islands(0.01), islands(0.11)]),
            (validity(0.2), vec![islands(0.21), islands(0.31)]),
        ],
    };
    let bytes = content.encode().unwrap();
    let table = LobeTable::parse(&bytes).unwrap();
    for (_, columns) in &content.layers {
        for island in columns.iter().flatten() {
            let middle_mm = 0.5 * (island.from.0 + island.to.0);
            let at = WorkingPoint {
                feed_per_tooth: Millimeters(0.15),
                ..working_point(&validity(0.1), middle_mm)
            };
            assert!(
                matches!(
                    table.lookup(Rpm(1050.0), &at),
                    TabulatedStability::Unstable { .. }
                ),
                "{middle_mm}"
            );
        }
    }
}
