//! Lobe tables for tests, with given and with random content.

use proptest::prelude::*;
use quietcut_core::lobes::{
    Additions, Content, Interval, IntervalKind, Layer, LobeTable, TableError, Validity, encode_with,
    encoded_length_with,
};
use quietcut_core::units::{Degrees, Hertz, Millimeters, Rpm};
use quietcut_core::working_point::{Limits, WorkingPoint};

/// The content of a table with its own memory.
#[derive(Clone, Debug)]
pub(crate) struct Owned {
    pub(crate) limits: Option<Limits>,
    pub(crate) depth_from_mm: f32,
    pub(crate) depth_to_mm: f32,
    pub(crate) speeds: Vec<Rpm>,
    pub(crate) layers: Vec<(Validity, Vec<Vec<Interval>>)>,
}

impl Owned {
    pub(crate) fn encode(&self) -> Result<Vec<u8>, TableError> {
        self.encode_with(&Additions::default())
    }

    pub(crate) fn encode_with(&self, additions: &Additions) -> Result<Vec<u8>, TableError> {
        let columns: Vec<Vec<&[Interval]>> = self
            .layers
            .iter()
            .map(|(_, columns)| columns.iter().map(Vec::as_slice).collect())
            .collect();
        let layers: Vec<Layer> = self
            .layers
            .iter()
            .zip(&columns)
            .map(|((validity, _), columns)| Layer {
                validity: *validity,
                columns,
            })
            .collect();
        let content = Content {
            name: "kuka-kr90-acetal",
            teeth: 2,
            limits: self.limits,
            depth_from: Millimeters(self.depth_from_mm),
            depth_to: Millimeters(self.depth_to_mm),
            speeds: &self.speeds,
            layers: &layers,
        };
        let mut buffer = vec![0; encoded_length_with(&content, additions) as usize];
        let written = encode_with(&content, additions, &mut buffer)?.len();
        assert_eq!(written, buffer.len());
        Ok(buffer)
    }

    /// The content of a table as a reader of its bytes would encode it again.
    pub(crate) fn decode(table: &LobeTable) -> Self {
        let (from, to) = table.depths();
        let entries = |layer| {
            (0..table.speeds().len())
                .map(|speed| table.entry(layer, speed).unwrap().intervals().to_vec())
                .collect()
        };
        Self {
            limits: table.limits(),
            depth_from_mm: from.0,
            depth_to_mm: to.0,
            speeds: table.speeds().collect(),
            layers: table
                .layers()
                .enumerate()
                .map(|(layer, validity)| (validity, entries(layer)))
                .collect(),
        }
    }
}

/// Speed limits of the robot's spindle.
pub(crate) const LIMITS: Option<Limits> = Some(Limits {
    rpm_min: Rpm(600.0),
    rpm_max: Rpm(2400.0),
});

pub(crate) fn validity(feed_mm: f32) -> Validity {
    Validity {
        feed_from: Millimeters(feed_mm),
        feed_to: Millimeters(feed_mm),
        start: Degrees(90.0),
        exit: Degrees(180.0),
        posture: 0,
    }
}

pub(crate) fn working_point(validity: &Validity, depth_mm: f32) -> WorkingPoint {
    WorkingPoint {
        axial_depth: Millimeters(depth_mm),
        start: validity.start,
        exit: validity.exit,
        feed_per_tooth: validity.feed_from,
        posture: validity.posture,
    }
}

pub(crate) fn interval(from_mm: f32, to_mm: f32, kind: IntervalKind, chatter_hz: f32) -> Interval {
    Interval {
        from: Millimeters(from_mm),
        to: Millimeters(to_mm),
        kind,
        chatter: Hertz(chatter_hz),
    }
}

/// Half-immersion down-milling of acetal near its flip notch, with rounded limits of the case `kuka-kr90-acetal`.
pub(crate) fn acetal() -> Owned {
    let hopf = |from_mm, chatter_hz| interval(from_mm, 6.0, IntervalKind::Hopf, chatter_hz);
    let columns = vec![
        vec![hopf(1.723, 17.4)],
        vec![
            interval(1.575, 2.334, IntervalKind::Flip, 17.27),
            interval(2.712, 6.0, IntervalKind::Hopf, 19.0),
        ],
        vec![
            interval(1.327, 4.023, IntervalKind::Flip, 17.42),
            interval(4.023, 6.0, IntervalKind::Hopf, 19.2),
        ],
        vec![hopf(2.223, 20.0)],
        vec![],
    ];
    Owned {
        limits: LIMITS,
        depth_from_mm: 0.0,
        depth_to_mm: 6.0,
        speeds: [900.0, 1036.0, 1045.0, 1100.0, 3000.0].map(Rpm).to_vec(),
        layers: vec![(validity(0.15), columns)],
    }
}

pub(crate) fn kind() -> impl Strategy<Value = IntervalKind> {
    prop_oneof![
        Just(IntervalKind::Hopf),
        Just(IntervalKind::Flip),
        Just(IntervalKind::Fold),
        Just(IntervalKind::Undecided),
        Just(IntervalKind::Bistable)
    ]
}

/// Columns whose interval ends are multiples of 1/40 of the depth range, so that they often touch each other or the ends of the
/// range.
pub(crate) fn column(depth_from_mm: f32, depth_to_mm: f32) -> impl Strategy<Value = Vec<Interval>> {
    (
        prop::collection::btree_set(0_u8..=40, 0..8),
        prop::collection::vec((kind(), 0.0_f32..300.0, any::<bool>()), 8),
    )
        .prop_map(move |(ends, kinds)| {
            let at_mm = |step: u8| match step {
                40 => depth_to_mm,
                _ => depth_from_mm + (depth_to_mm - depth_from_mm) * f32::from(step) / 40.0,
            };
            let ends: Vec<u8> = ends.into_iter().collect();
            ends.windows(2)
                .zip(kinds)
                .filter(|(_, (_, _, is_there))| *is_there)
                .map(|(ends, (kind, hz, _))| interval(at_mm(ends[0]), at_mm(ends[1]), kind, hz))
                .collect()
        })
}

pub(crate) fn table() -> impl Strategy<Value = Owned> {
    (
        1_usize..6,
        1_usize..4,
        prop_oneof![Just(0.0_f32), 0.1_f32..1.0],
        1.5_f32..20.0,
    )
        .prop_flat_map(|(speeds, layers, depth_from_mm, depth_to_mm)| {
            let columns = prop::collection::vec(column(depth_from_mm, depth_to_mm), speeds);
            let steps = prop::collection::vec(0.5_f32..400.0, speeds);
            (steps, prop::collection::vec(columns, layers)).prop_map(move |(steps, layers)| {
                let speeds = steps.iter().scan(500.0, |rpm, step| {
                    *rpm += step;
                    Some(Rpm(*rpm))
                });
                let feeds = (1_u8..).map(|index| validity(0.05 * f32::from(index)));
                Owned {
                    limits: LIMITS,
                    depth_from_mm,
                    depth_to_mm,
                    speeds: speeds.collect(),
                    layers: feeds.zip(layers).collect(),
                }
            })
        })
}
