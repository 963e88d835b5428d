//! Tables to store.
#![allow(dead_code)] // Each test file uses its part of it.

use quietcut_core::lobes::{Content, Interval, Kind, Layer, LobeTable, Validity, encode, encoded_length};
use quietcut_core::units::{Degrees, Hertz, Millimeters, Rpm};

/// A table with a Hopf limit at this depth and as many speeds from 600 rev/min on, 10 rev/min apart.
pub(crate) fn table(name: &str, limit_mm: f32, speeds: u16) -> Vec<u8> {
    let hopf = [Interval {
        from: Millimeters(limit_mm),
        to: Millimeters(6.0),
        kind: Kind::Hopf,
        chatter: Hertz(17.4),
    }];
    let speeds: Vec<Rpm> = (0..speeds).map(|k| Rpm(600.0 + 10.0 * f32::from(k))).collect();
    let columns = vec![hopf.as_slice(); speeds.len()];
    let validity = Validity {
        feed_from: Millimeters(0.0),
        feed_to: Millimeters(0.3),
        start: Degrees(90.0),
        exit: Degrees(180.0),
        posture: 0,
    };
    let content = Content {
        name,
        teeth: 2,
        limits: None,
        depth_from: Millimeters(0.0),
        depth_to: Millimeters(6.0),
        speeds: &speeds,
        layers: &[Layer {
            validity,
            columns: &columns,
        }],
    };
    let mut buffer = vec![0; encoded_length(&content) as usize];
    encode(&content, &mut buffer).unwrap();
    buffer
}

/// The bytes of a table but for its generation and CRC.
pub(crate) fn content_of(table: &LobeTable) -> Vec<u8> {
    table.bytes()[32..].to_vec()
}
