//! Simulated cuts as input of the signal chain.

use quietcut::case::Case;
use quietcut::simulate::{Accelerometer, Entry, TachometerModel, VirtualCut};
use quietcut_core::monitor::Settings;
use quietcut_core::units::{Degrees, Millimeters, Rpm};
use quietcut_core::working_point::{Limits, WorkingPoint};

use crate::acceptance::settings;
use crate::command;
use crate::outputs::{Step, steps};

/// Simulated cut of `kuka-kr90-acetal`; the clock of its sensor has an error of 2 %.
pub struct Cut {
    /// Settings of the signal chain for this cut.
    pub settings: Settings,
    /// Working point of the cut.
    pub working_point: WorkingPoint,
    /// Blocks of samples with their tachometer edges.
    pub steps: Vec<Step>,
}

impl Cut {
    /// Simulates a cut of this duration, including `entry`; `seed` sets the sensor noise.
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
        let sensed = cut
            .sense(&case, accelerometer, tachometer, seed)
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
            steps: steps(sensed),
        }
    }
}
