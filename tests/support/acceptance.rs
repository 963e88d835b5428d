//! Acceptance cuts of the chatter detector: a milling robot at ten spindle speeds, at 0.8 and 1.2 times its stability limit, with
//! entry, exit and all errors of the sensors.

use std::fmt;

use quietcut::case::Case;
use quietcut::simulate::{Accelerometer, TachometerModel, VirtualCut};
use quietcut_core::detector::Verdict;
use quietcut_core::monitor::Settings;
use quietcut_core::tachometer::Wheel;
use quietcut_core::working_point::Tool;

use crate::command;

/// Spindle speed in rev/min, stability limit in mm, kind of chatter at 1.2 times the limit and its frequency in Hz, from
/// `quietcut lobes kuka-kr90-acetal.toml --at`.
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

/// Depth relative to the stability limit at which the detector must not report chatter.
pub const BELOW: f64 = 0.8;
/// Depth relative to the stability limit at which the detector must report chatter.
pub const ABOVE: f64 = 1.2;

/// Acceptance cut with its sensors, which differ between the speeds.
pub struct AcceptanceCut {
    /// Case of the milling robot.
    pub case: Case,
    /// The cut.
    pub cut: VirtualCut,
    /// The accelerometer.
    pub accelerometer: Accelerometer,
    /// The tachometer.
    pub tachometer: TachometerModel,
    /// Seed of the sensor noise.
    pub seed: u64,
}

impl AcceptanceCut {
    /// Acceptance cut at the speed with this index in [`LIMITS`]; `share` is the depth relative to the limit.
    pub fn new(index: usize, share: f64) -> Self {
        let case = Case::read(command::cases().join("kuka-kr90-acetal.toml")).expect("a case");
        let (rpm, limit_mm, ..) = LIMITS[index];
        // Chatter grows by 1.5 to 3 % per tooth passing above the limit; 12 s of full engagement are at least 240 tooth passings.
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

    /// Settings of the signal chain: only sensors and number of teeth.
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

/// Settings of the signal chain for these sensors and the tool of the case.
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

/// Time from first contact to half immersion, s: tool radius divided by feed speed.
fn cut_way_s(rpm: f64) -> f64 {
    6.35 / (0.15 * 2.0 * rpm / 60.0)
}
