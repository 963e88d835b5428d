//! Simulated cuts as steps of a pipeline, and lobe tables to go with them.

use quietcut::case::Case;
use quietcut::simulate::{Accelerometer, Entry, TachometerModel, VirtualCut};
use quietcut_core::lobes::{Content, Interval, Kind, Layer, Validity, encode, encoded_length};
use quietcut_core::monitor::Settings;
use quietcut_core::units::{Degrees, Hertz, Millimeters, Rpm};
use quietcut_core::working_point::{Limits, WorkingPoint};

use crate::acceptance::settings;
use crate::command;
use crate::said::{Step, steps};

/// A cut of `kuka-kr90-acetal`, heard by a sensor whose clock is off by 2 %.
pub struct Cut {
    /// Settings for it.
    pub settings: Settings,
    /// The working point.
    pub working_point: WorkingPoint,
    /// Blocks with their edges.
    pub steps: Vec<Step>,
}

impl Cut {
    /// Cuts for so long, `entry` included; `seed` makes the noise of the sensors repeat.
    pub fn new(entry: Entry, spindle_rpm: f64, depth_mm: f64, seconds: f64, seed: u64) -> Self {
        let case = Case::read(command::cases().join("kuka-kr90-acetal.toml")).expect("a case");
        let accelerometer = Accelerometer {
            clock_error: 0.02,
            ..Accelerometer::IIS3DWB_16G
        };
        let tachometer = TachometerModel::ONE_MARK;
        let cut = VirtualCut {
            entry,
            ..VirtualCut::new(spindle_rpm, depth_mm, seconds)
        };
        let heard = cut
            .hear(&case, accelerometer, tachometer, seed)
            .expect("a cut that can be simulated");
        let cut = case.cut().expect("a cut");
        Self {
            settings: Settings {
                limits: Some(Limits {
                    rpm_min: Rpm(600.0),
                    rpm_max: Rpm(2400.0),
                }),
                ..settings(&case, accelerometer, tachometer)
            },
            working_point: WorkingPoint {
                axial_depth: Millimeters(depth_mm as f32),
                start: Degrees(cut.start_deg as f32),
                exit: Degrees(cut.exit_deg as f32),
                feed_per_tooth: Millimeters(cut.feed_per_tooth_mm as f32),
                posture: 0,
            },
            steps: steps(heard),
        }
    }
}

/// A table with a Hopf limit at this depth from 600 rev/min on, 10 rev/min apart: `speeds` gives its length.
pub fn table(name: &str, limit_mm: f32, speeds: u16) -> Vec<u8> {
    let hopf = [Interval {
        from: Millimeters(limit_mm),
        to: Millimeters(6.0),
        kind: Kind::Hopf,
        chatter: Hertz(17.4),
    }];
    let speeds: Vec<Rpm> = (0..speeds).map(|k| Rpm(600.0 + 10.0 * f32::from(k))).collect();
    // Every third speed is quiet to a larger depth, so that there is something to advise.
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
