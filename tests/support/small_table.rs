//! Artificial lobe tables of any size.
// Some test crates include this file as a private module.
#![allow(unreachable_pub, clippy::expect_used)]

use quietcut_core::lobes::{Content, Interval, IntervalKind, Layer, Validity, encode, encoded_length};
use quietcut_core::units::{Degrees, Hertz, Millimeters, Rpm};

/// A table with a Hopf limit at this depth. It has `speeds` grid speeds from 600 rev/min on, 10 rev/min apart.
pub fn table(name: &str, limit_mm: f32, speeds: u16) -> Vec<u8> {
    let hopf = [Interval {
        from: Millimeters(limit_mm),
        to: Millimeters(6.0),
        kind: IntervalKind::Hopf,
        chatter: Hertz(17.4),
    }];
    let speeds: Vec<Rpm> = (0..speeds).map(|k| Rpm(600.0 + 10.0 * f32::from(k))).collect();
    // At every third speed the limit is larger, so that advice has a stable speed.
    let quiet = [Interval {
        from: Millimeters(4.0),
        ..hopf[0]
    }];
    let columns: Vec<&[Interval]> = (0..speeds.len())
        .map(|k| {
            if k % 3 == 2 {
                quiet.as_slice()
            } else {
                hopf.as_slice()
            }
        })
        .collect();
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
    encode(&content, &mut buffer)
        .expect("a table that can be")
        .to_vec()
}
