//! The cuts that quietcut must judge right: a robot at ten speeds, a fifth below and above its limit, with entry and exit
//! and all faults of the sensors.

use std::fmt;

use quietcut::case::Case;
use quietcut::simulate::{Accelerometer, TachometerModel, VirtualCut};
use quietcut_core::detector::Verdict;
use quietcut_core::monitor::Settings;
use quietcut_core::tachometer::Wheel;
use quietcut_core::working_point::Tool;

use crate::command;

/// rev/min, limit in mm, what is heard a fifth above it, and at how many hertz: `lobes kuka-kr90-acetal.toml --at`.
pub const LIMITS: [(f64, f64, Verdict, f64); 10] = [
    (600.0, 3.174, Verdict::Hopf, 16.91),
    (800.0, 1.664, Verdict::Hopf, 17.30),
    (900.0, 1.723, Verdict::Hopf, 17.48),
    (1050.0, 1.356, Verdict::PeriodDoubling, 17.50),
    (1100.0, 2.223, Verdict::Hopf, 17.69),
    (1200.0, 2.041, Verdict::Hopf, 17.77),
    (1400.0, 2.450, Verdict::Hopf, 18.08),
    (1600.0, 2.953, Verdict::Hopf, 18.35),
    (2000.0, 4.105, Verdict::Hopf, 18.78),
    (2400.0, 5.443, Verdict::Hopf, 19.13),
];

/// The share of the limit at which there is no alarm.
pub const BELOW: f64 = 0.8;
/// The share of the limit at which chatter is called.
pub const ABOVE: f64 = 1.2;

/// A cut and who listens to it; sensors differ from speed to speed.
pub struct AcceptanceCut {
    /// The robot.
    pub case: Case,
    /// The cut.
    pub cut: VirtualCut,
    /// The accelerometer.
    pub accelerometer: Accelerometer,
    /// The tachometer.
    pub tachometer: TachometerModel,
    /// Makes the noise of the sensors repeat.
    pub seed: u64,
}

impl AcceptanceCut {
    /// The cut at the speed with this index in [`LIMITS`], at this share of the limit.
    pub fn new(index: usize, share: f64) -> Self {
        let case = Case::read(command::cases().join("kuka-kr90-acetal.toml")).expect("a case");
        let (rpm, limit_mm, ..) = LIMITS[index];
        // Growth per tooth above the limit is 1.5 to 3 %: twelve seconds of full cut are 240 teeth at the least.
        let mut cut = VirtualCut::new(rpm, share * limit_mm, 20.0);
        cut.seconds = 2.0 * cut_way_s(rpm) + 12.0 + 2.0 * cut.air_s;
        let accelerometer = Accelerometer {
            range_g: [2.0, 4.0, 8.0, 16.0][index % 4],
            clock_error: [-0.03, 0.03, 0.011, -0.017, 0.0][index % 5],
            ..Accelerometer::IIS3DWB_16G
        };
        let wheel = if index.is_multiple_of(3) {
            Wheel {
                positions: 60,
                missing: 2,
            }
        } else {
            TachometerModel::ONE_MARK.wheel
        };
        Self {
            case,
            cut,
            accelerometer,
            tachometer: TachometerModel {
                wheel,
                ..TachometerModel::ONE_MARK
            },
            seed: 1000 + index as u64,
        }
    }

    /// What the pipeline is told: nothing but sensors and teeth.
    pub fn settings(&self) -> Settings {
        settings(&self.case, self.accelerometer, self.tachometer)
    }
}

impl fmt::Display for AcceptanceCut {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (rpm, depth_mm) = (self.cut.spindle_rpm, self.cut.depth_mm);
        write!(f, "{rpm} rev/min, {depth_mm:.3} mm, seed {}", self.seed)
    }
}

/// Settings for these sensors and the tool of the case.
pub fn settings(case: &Case, accelerometer: Accelerometer, tachometer: TachometerModel) -> Settings {
    let teeth = case.tool().expect("a tool").teeth;
    Settings {
        sensor: accelerometer.sensor(),
        tool: Tool {
            teeth: u8::try_from(teeth).expect("a few teeth"),
        },
        wheel: Some(tachometer.wheel),
        assumed_speed: None,
        limits: None,
    }
}

/// From the first touch to half immersion: radius over feed speed.
fn cut_way_s(rpm: f64) -> f64 {
    6.35 / (0.15 * 2.0 * rpm / 60.0)
}
