//! The schemas of the lobe table: frozen bytes, additions of schema 2, bistable intervals of schema 3, refused tables.
#![allow(clippy::unwrap_used, clippy::panic, clippy::indexing_slicing)]

// Not every test binary uses all of this module.
#[allow(dead_code)]
mod support;

use proptest::prelude::*;
use quietcut_core::checksum::crc32;
use quietcut_core::lobes::format::{SCHEMA, SCHEMA_ADDITIONS, SCHEMA_PLAIN};
use quietcut_core::lobes::{
    Additions, FEED_DIRECTION_SPAN, InterpolationError, IntervalKind, IntervalSlopes, LayerMode, Learned,
    LobeTable, MODES_MAX, NotKnown, Slopes, TableError, TabulatedStability, corrected_limit,
};
use quietcut_core::units::{Degrees, Hertz, Millimeters, Rpm};
use quietcut_core::working_point::WorkingPoint;
use support::{Owned, acetal, interval, table, validity, working_point};

/// Hexadecimal bytes of tables of all schemas, written when the schema was defined.
const FROZEN: &str = include_str!("lobe_table_schemas.txt");

const MODES: [LayerMode; 2] = [
    LayerMode {
        frequency: Hertz(16.99),
        damping_ratio: 0.0285,
    },
    LayerMode {
        frequency: Hertz(18.48),
        damping_ratio: 0.0996,
    },
];

/// Derivatives with a different number for every interval end, so that a confusion is found.
fn slopes(index: usize, modes: usize) -> IntervalSlopes {
    let end = |first: f32| {
        let mut slopes = Slopes {
            by_cutting_force: -first,
            ..Slopes::default()
        };
        for mode in 0..modes {
            slopes.by_frequency[mode] = first * 16.0 + mode as f32;
            slopes.by_damping_ratio[mode] = first + mode as f32 * 0.25;
        }
        slopes
    };
    IntervalSlopes {
        from: end(index as f32 + 1.0),
        to: end(-(index as f32) - 0.5),
    }
}

fn all_slopes(owned: &Owned, modes: usize) -> Vec<IntervalSlopes> {
    let intervals: usize = owned
        .layers
        .iter()
        .flat_map(|(_, columns)| columns)
        .map(Vec::len)
        .sum();
    (0..intervals).map(|index| slopes(index, modes)).collect()
}

/// The table of `acetal` with all additions of schema 2.
fn extended() -> Vec<u8> {
    let owned = acetal();
    let slopes = all_slopes(&owned, 2);
    let additions = Additions {
        interpolation_error: Some(InterpolationError {
            depth: Millimeters(0.0125),
            speed: 0.0005,
        }),
        feed_directions: &[Some(Degrees(-30.0))],
        modes: &[&MODES],
        slopes: &slopes,
    };
    owned.encode_with(&additions).unwrap()
}

/// The table of `acetal` with a bistable interval below its flip.
fn with_bistable() -> Owned {
    let mut owned = acetal();
    owned.layers[0].1[1].insert(0, interval(1.25, 1.575, IntervalKind::Bistable, 17.27));
    owned
}

fn hex(bytes: &[u8]) -> String {
    bytes.iter().map(|byte| format!("{byte:02x}")).collect()
}

#[test]
fn the_bytes_of_all_schemas_are_frozen() {
    let plain = acetal().encode().unwrap();
    let now = [
        format!("1 {}", hex(&plain)),
        format!("2 {}", hex(&extended())),
        format!("3 {}", hex(&with_bistable().encode().unwrap())),
    ];
    let frozen: Vec<&str> = FROZEN.lines().filter(|line| !line.starts_with('#')).collect();
    if now.iter().map(String::as_str).ne(frozen.iter().copied()) {
        println!("{}", now.join("\n"));
    }
    assert_eq!(now[0], frozen[0]);
    assert_eq!(now[1], frozen[1]);
    assert_eq!(now[2], frozen[2]);
    assert_eq!(
        frozen.len(),
        usize::from(SCHEMA),
        "a new schema needs its own frozen bytes"
    );
}

#[test]
fn a_table_without_additions_is_of_schema_1() {
    let owned = acetal();
    let plain = owned.encode_with(&Additions::default()).unwrap();
    assert_eq!(plain, owned.encode().unwrap());
    let table = LobeTable::parse(&plain).unwrap();
    assert_eq!(table.header().unwrap().schema, SCHEMA_PLAIN);
    assert_eq!(table.interpolation_error(), None);
    assert_eq!(
        (
            table.modes(0).len(),
            table.slopes(0, 0, 0),
            table.feed_direction(0)
        ),
        (0, None, None)
    );
}

#[test]
fn a_bistable_interval_needs_schema_3_and_is_not_stable() {
    let owned = with_bistable();
    let mut bytes = owned.encode().unwrap();
    let table = LobeTable::parse(&bytes).unwrap();
    assert_eq!(table.header().unwrap().schema, SCHEMA);
    let kinds: Vec<IntervalKind> = table
        .entry(0, 1)
        .unwrap()
        .intervals()
        .iter()
        .map(|interval| interval.kind)
        .collect();
    assert_eq!(
        kinds,
        [IntervalKind::Bistable, IntervalKind::Flip, IntervalKind::Hopf]
    );
    let at = |depth_mm: f32| table.lookup(Rpm(1036.0), &working_point(&validity(0.15), depth_mm));
    assert!(matches!(at(1.2), TabulatedStability::Stable { .. }));
    assert!(matches!(
        at(1.4),
        TabulatedStability::Unstable {
            kind: IntervalKind::Bistable,
            ..
        }
    ));
    assert!(matches!(
        at(1.7),
        TabulatedStability::Unstable {
            kind: IntervalKind::Flip,
            ..
        }
    ));
    // The kind of its interval is unknown in the schemas before.
    for schema in [SCHEMA_PLAIN, SCHEMA_ADDITIONS] {
        bytes[4..6].copy_from_slice(&schema.to_le_bytes());
        let crc = crc32([&bytes[..28], &bytes[32..]]);
        bytes[28..32].copy_from_slice(&crc.to_le_bytes());
        assert_eq!(
            LobeTable::parse(&bytes).unwrap_err(),
            TableError::IntervalOrder {
                layer: 0,
                speed: 1,
                interval: 0
            }
        );
    }
}

#[test]
fn additions_are_decoded_as_encoded() {
    let bytes = extended();
    let table = LobeTable::parse(&bytes).unwrap();
    assert_eq!(table.header().unwrap().schema, SCHEMA_ADDITIONS);
    let error = table.interpolation_error().unwrap();
    assert_eq!((error.depth, error.speed), (Millimeters(0.0125), 0.0005));
    assert!((table.feed_direction(0).unwrap().0 - 330.0).abs() < 1e-4);
    assert_eq!(table.modes(0).collect::<Vec<_>>(), MODES);
    let mut index = 0;
    for (speed, column) in acetal().layers[0].1.iter().enumerate() {
        for position in 0..column.len() {
            // The derivatives are exact in binary16.
            assert_eq!(table.slopes(0, speed, position), Some(slopes(index, 2)));
            index += 1;
        }
        assert_eq!(table.slopes(0, speed, column.len()), None);
    }
    // The additions after the intervals do not change the entries.
    let plain = acetal().encode().unwrap();
    let plain = LobeTable::parse(&plain).unwrap();
    for speed in 0..5 {
        assert_eq!(table.entry(0, speed), plain.entry(0, speed));
    }
}

#[test]
fn each_addition_that_cannot_be_is_refused_on_both_sides() {
    let owned = acetal();
    let slopes = all_slopes(&owned, 2);
    let with = |additions: Additions| owned.encode_with(&additions).unwrap_err();
    let none = Additions::default();
    assert_eq!(
        with(Additions {
            modes: &[&MODES],
            slopes: &slopes[1..],
            ..none
        }),
        TableError::Slopes { index: 5 }
    );
    assert!(matches!(
        with(Additions {
            modes: &[&MODES, &MODES],
            slopes: &slopes,
            ..none
        }),
        TableError::Slopes { .. }
    ));
    let many = [MODES[0]; MODES_MAX + 1];
    assert!(matches!(
        with(Additions {
            modes: &[&many],
            slopes: &slopes,
            ..none
        }),
        TableError::Slopes { .. }
    ));
    let mut wrong = slopes.clone();
    wrong[3].to.by_damping_ratio[1] = f32::NAN;
    assert_eq!(
        with(Additions {
            modes: &[&MODES],
            slopes: &wrong,
            ..none
        }),
        TableError::Slopes { index: 3 }
    );
    let undamped = [LayerMode {
        damping_ratio: 1.0,
        ..MODES[0]
    }];
    assert_eq!(
        with(Additions {
            modes: &[&undamped],
            slopes: &slopes,
            ..none
        }),
        TableError::Mode { layer: 0, mode: 0 }
    );
    for direction in [f32::NAN, f32::INFINITY, 1e9] {
        assert_eq!(
            with(Additions {
                feed_directions: &[Some(Degrees(direction))],
                ..none
            }),
            TableError::FeedDirection { layer: 0 }
        );
    }
    for (depth, speed) in [(-1.0, 0.0), (f32::NAN, 0.0), (0.0, 1.0), (0.0, -0.1)] {
        let error = InterpolationError {
            depth: Millimeters(depth),
            speed,
        };
        assert!(matches!(
            with(Additions {
                interpolation_error: Some(error),
                ..none
            }),
            TableError::InterpolationError { .. }
        ));
    }

    let good = extended();
    let forged = |offset: usize, with: &[u8]| {
        let mut bytes = good.clone();
        bytes[offset..offset + with.len()].copy_from_slice(with);
        let crc = crc32([&bytes[..28], &bytes[32..]]);
        bytes[28..32].copy_from_slice(&crc.to_le_bytes());
        LobeTable::parse(&bytes).unwrap_err()
    };
    assert_eq!(forged(38, &[7, 2]), TableError::Flags { found: 0x207 });
    assert_eq!(forged(38, &[3, 5]), TableError::Flags { found: 0x503 });
    assert!(matches!(forged(38, &[3, 1]), TableError::Arrays { .. }));
    assert_eq!(forged(96 + 17, &[2]), TableError::FeedDirection { layer: 0 });
    assert_eq!(
        forged(96 + 18, &[0xFF, 0xFF]),
        TableError::FeedDirection { layer: 0 }
    );
    // From the end: six intervals with 20 bytes of derivatives, two modes, the interpolation error.
    let slopes_at = good.len() - 6 * 20;
    let infinite = 0x7C00_u16.to_le_bytes();
    assert_eq!(
        forged(slopes_at + 2 * 20 + 18, &infinite),
        TableError::Slopes { index: 2 }
    );
    assert_eq!(
        forged(slopes_at - 8, &(-1.0_f32).to_le_bytes()),
        TableError::Mode { layer: 0, mode: 1 }
    );
    assert!(matches!(
        forged(slopes_at - 24, &f32::NAN.to_le_bytes()),
        TableError::InterpolationError { .. }
    ));
    // If these bytes claim schema 1, they are too long for its description.
    assert!(matches!(forged(4, &[1]), TableError::Arrays { .. }));
    for bit in 0..8 * good.len() {
        let mut damaged = good.clone();
        damaged[bit / 8] ^= 1 << (bit % 8);
        assert!(LobeTable::parse(&damaged).is_err(), "bit {bit}");
    }
}

proptest! {
    #[test]
    fn additions_damaged_after_their_check_are_read_without_panic(
        content in table(), modes in 1_usize..=MODES_MAX,
        damage in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 1..20),
        rpm in 400.0_f32..3000.0, direction in -400.0_f32..400.0,
    ) {
        let slopes = all_slopes(&content, modes);
        let layer_modes = [MODES[0]; MODES_MAX];
        let of_layers = vec![&layer_modes[..modes]; content.layers.len()];
        let directions = vec![Some(Degrees(30.0)); content.layers.len()];
        let additions = Additions { feed_directions: &directions, modes: &of_layers, slopes: &slopes, ..Additions::default() };
        let mut bytes = content.encode_with(&additions).unwrap();
        for (position, byte) in damage {
            let position = position.index(bytes.len());
            bytes[position] = byte;
        }
        if let Ok(table) = LobeTable::reopen(&bytes) {
            let learned = Learned { cutting_force: 0.1, ..Learned::default() };
            for (index, layer) in table.layers().enumerate().take(8) {
                let at = working_point(&layer, 1.0);
                let _ = table.lookup(Rpm(rpm), &at);
                let _ = table.towards(Degrees(direction)).column(Rpm(rpm), &at);
                let _ = table.corrected_entry(index, 0, &learned);
                let _ = table.modes(index).count();
            }
        }
    }

    #[test]
    fn corrected_limits_are_linear_and_stay_in_the_table(
        limit in 0.5_f32..5.0, frequency in -0.02_f32..0.02, damping in -0.2_f32..0.2, force in -0.2_f32..0.2,
        by in prop::array::uniform3(-50.0_f32..50.0),
    ) {
        let mut slopes = Slopes { by_cutting_force: by[2], ..Slopes::default() };
        slopes.by_frequency[1] = by[0];
        slopes.by_damping_ratio[1] = by[1];
        let mut learned = Learned { cutting_force: force, ..Learned::default() };
        learned.frequency[1] = frequency;
        learned.damping_ratio[1] = damping;
        let depths = (Millimeters(0.0), Millimeters(6.0));
        let found = corrected_limit(Millimeters(limit), &slopes, &learned, depths).0;
        let expected = (limit + by[0] * frequency + by[1] * damping + by[2] * force).clamp(0.0, 6.0);
        // Single-precision rounding of four terms below 20.
        prop_assert!((found - expected).abs() < 1e-5, "{} {}", found, expected);
    }
}

#[test]
fn a_corrected_entry_moves_its_ends_and_keeps_their_order() {
    let bytes = extended();
    let table = LobeTable::parse(&bytes).unwrap();
    // At 1 036 rev/min: a flip from 1.575 to 2.334 mm, a Hopf from 2.712 mm to the end. These are the intervals 1 and 2 of the
    // table.
    let learned = Learned {
        cutting_force: 0.1,
        ..Learned::default()
    };
    let before = table.entry(0, 1).unwrap();
    let after = table.corrected_entry(0, 1, &learned).unwrap();
    let (before, after) = (before.intervals(), after.intervals());
    // The shifts are −2 · 0.1, +1.5 · 0.1 and −3 · 0.1 mm; the end of the table is not shifted. The tolerance is the rounding of
    // sums below 6.
    let near = |a: f32, b: f32| (a - b).abs() < 1e-6;
    assert!(near(after[0].from.0, before[0].from.0 - 0.2) && near(after[0].to.0, before[0].to.0 + 0.15));
    assert!(after[1].from.0 >= after[0].to.0 && after[1].to == before[1].to);
    // An island is removed if its ends move past each other.
    let away = Learned {
        cutting_force: -0.5,
        ..Learned::default()
    };
    let closed = table.corrected_entry(0, 1, &away).unwrap();
    assert_eq!(closed.intervals().len(), 1);
    assert_eq!(closed.intervals()[0].kind, IntervalKind::Hopf);
    // Without derivatives the corrected entries equal the stored ones.
    let plain = acetal().encode().unwrap();
    let plain = LobeTable::parse(&plain).unwrap();
    assert_eq!(plain.corrected_entry(0, 1, &learned), plain.entry(0, 1));
}

#[test]
fn learned_changes_of_a_mode_are_relative() {
    let now = LayerMode {
        frequency: Hertz(17.16),
        damping_ratio: 0.0342,
    };
    let learned = Learned::of_mode(0, &MODES[0], &now);
    assert!((learned.frequency[0] - 0.17 / 16.99).abs() < 1e-6);
    assert!((learned.damping_ratio[0] - 0.2).abs() < 1e-6);
    assert_eq!(Learned::of_mode(MODES_MAX, &MODES[0], &now), Learned::default());
}

/// Layers for these feed directions. The limit is 1 mm plus a hundredth of the direction in degrees.
fn directed(directions: &[Option<f32>], feeds: &[f32]) -> Vec<u8> {
    let mut owned = acetal();
    owned.speeds.truncate(1);
    owned.layers = directions
        .iter()
        .flat_map(|direction| feeds.iter().map(move |feed| (direction, feed)))
        .map(|(direction, &feed)| {
            let limit_mm = 1.0 + direction.unwrap_or(0.0) * 0.01 + feed;
            (
                validity(feed),
                vec![vec![interval(limit_mm, 6.0, IntervalKind::Hopf, 17.0)]],
            )
        })
        .collect();
    let of_layers: Vec<Option<Degrees>> = directions
        .iter()
        .flat_map(|direction| feeds.iter().map(move |_| direction.map(Degrees)))
        .collect();
    let additions = Additions {
        feed_directions: &of_layers,
        ..Additions::default()
    };
    owned.encode_with(&additions).unwrap()
}

fn limit_towards(bytes: &[u8], direction: f32, feed: f32) -> Result<f32, NotKnown> {
    let at = WorkingPoint {
        feed_per_tooth: Millimeters(feed),
        ..working_point(&validity(0.15), 1.0)
    };
    let table = LobeTable::parse(bytes).unwrap();
    let column = table.towards(Degrees(direction)).column(Rpm(900.0), &at)?;
    Ok(column.first_limit().unwrap().from.0)
}

#[test]
fn between_feed_directions_limits_are_interpolated_and_far_from_them_not_known() {
    let bytes = directed(&[Some(0.0), Some(30.0), Some(60.0)], &[0.0]);
    let is = |found: Result<f32, NotKnown>, expected: f32| {
        // The tolerance is some steps of 6 mm/65 535. Within the direction tolerance the nearest layer is used.
        assert!((found.unwrap() - expected).abs() < 3e-4, "{found:?} {expected}");
    };
    is(limit_towards(&bytes, 0.0, 0.0), 1.0);
    is(limit_towards(&bytes, 10.0, 0.0), 1.1);
    is(limit_towards(&bytes, 405.0, 0.0), 1.45);
    is(limit_towards(&bytes, 60.4, 0.0), 1.6);
    is(limit_towards(&bytes, -0.4, 0.0), 1.0);
    for direction in [61.0, -1.0, 180.0, f32::NAN, f32::INFINITY] {
        assert!(
            matches!(
                limit_towards(&bytes, direction, 0.0),
                Err(NotKnown::FeedDirection { .. })
            ),
            "{direction}"
        );
    }
    // Directions that are too far apart are not interpolated.
    let sparse = directed(&[Some(0.0), Some(FEED_DIRECTION_SPAN.0 + 1.0)], &[0.0]);
    assert!(matches!(
        limit_towards(&sparse, 20.0, 0.0),
        Err(NotKnown::FeedDirection { .. })
    ));
    // Interpolation between directions on both sides of 0°.
    let across = directed(&[Some(350.0), Some(20.0)], &[0.0]);
    is(limit_towards(&across, 5.0, 0.0), 1.0 + 0.5 * (3.5 + 0.2));
    // The table is interpolated in feed or in direction, not in both at once.
    let both = directed(&[Some(0.0), Some(30.0)], &[0.1, 0.2]);
    is(limit_towards(&both, 30.0, 0.15), 1.45);
    is(limit_towards(&both, 15.0, 0.1), 1.25);
    assert!(matches!(
        limit_towards(&both, 15.0, 0.15),
        Err(NotKnown::FeedDirection { .. })
    ));
}

#[test]
fn without_a_set_direction_the_only_one_is_assumed_or_the_result_is_not_known() {
    let at = working_point(&validity(0.0), 0.5);
    let ask = |bytes: &[u8]| LobeTable::parse(bytes).unwrap().lookup(Rpm(900.0), &at);
    assert!(matches!(
        ask(&directed(&[Some(30.0)], &[0.0])),
        TabulatedStability::Stable { .. }
    ));
    assert!(matches!(
        ask(&directed(&[Some(30.0), Some(60.0)], &[0.0])),
        TabulatedStability::NotKnown(NotKnown::FeedDirectionNotTold)
    ));
    // A layer for any direction is used for every direction.
    let any = directed(&[None], &[0.0]);
    assert!((limit_towards(&any, 123.0, 0.0).unwrap() - 1.0).abs() < 3e-4);
}

#[test]
fn two_layers_for_the_same_direction_are_refused() {
    let mut owned = acetal();
    owned.layers.push(owned.layers[0].clone());
    let with = |directions: &[Option<Degrees>]| {
        let additions = Additions {
            feed_directions: directions,
            ..Additions::default()
        };
        owned.encode_with(&additions).map(|_| ())
    };
    assert_eq!(with(&[Some(Degrees(0.0)), Some(Degrees(30.0))]), Ok(()));
    let clash = Err(TableError::Layer { layer: 1 });
    assert_eq!(with(&[Some(Degrees(30.0)), Some(Degrees(30.0))]), clash);
    assert_eq!(with(&[None, Some(Degrees(30.0))]), clash);
    assert_eq!(
        with(&[Some(Degrees(30.0))]),
        Err(TableError::FeedDirection { layer: 1 })
    );
}
