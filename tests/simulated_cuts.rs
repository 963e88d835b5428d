//! Simulated cuts of the robot below and above its limit, with entry, exit and all faults of the sensors: no alarm
//! below, the right kind above, in time.

#![allow(clippy::unwrap_used)]

use quietcut::case::Case;
use quietcut::simulate::{Accelerometer, TachometerModel, VirtualCut};
use quietcut_core::detector::Verdict;
use quietcut_core::tachometer::Wheel;
use quietcut_tests::command::cases;
use quietcut_tests::virtual_cut::{Outcome, judged};

/// rev/min, limit in mm, what is heard above it.
const LIMITS: [(f64, f64, Verdict); 10] = [
    (600.0, 3.174, Verdict::Hopf),
    (800.0, 1.664, Verdict::Hopf),
    (900.0, 1.723, Verdict::Hopf),
    (1050.0, 1.356, Verdict::PeriodDoubling),
    (1100.0, 2.223, Verdict::Hopf),
    (1200.0, 2.041, Verdict::Hopf),
    (1400.0, 2.450, Verdict::Hopf),
    (1600.0, 2.953, Verdict::Hopf),
    (2000.0, 4.105, Verdict::Hopf),
    (2400.0, 5.443, Verdict::Hopf),
];

/// By when chatter must be called: the vibration over the forced one.
const IN_TIME: f64 = 5.0;

/// Where it is called later than that, and by when it is. At 1100 rev/min chatter turns by so nearly half a turn per
/// tooth that the two branches of period doubling and a slow torus look alike for hundreds of teeth: this falls short.
const LATE: (f64, f64) = (1100.0, 11.0);

/// The cut at this share of the limit; sensors differ from speed to speed.
fn cut(index: usize, share: f64) -> Outcome {
    let case = Case::read(cases().join("kuka-kr90-acetal.toml")).unwrap();
    let (rpm, limit_mm, _) = LIMITS[index];
    // Growth per tooth above the limit is 1.5 to 3 %: twelve seconds of full cut are 240 teeth at the least.
    let mut cut = VirtualCut::new(rpm, share * limit_mm, 20.0);
    cut.seconds = 2.0 * cut_way_s(rpm) + 12.0 + 2.0 * cut.air_s;
    let accelerometer = Accelerometer {
        range_g: [2.0, 4.0, 8.0, 16.0][index % 4],
        clock_error: [-0.03, 0.03, 0.011, -0.017, 0.0][index % 5],
        ..Accelerometer::IIS3DWB_16G
    };
    let tachometer = TachometerModel {
        wheel: if index.is_multiple_of(3) {
            Wheel {
                positions: 60,
                missing: 2,
            }
        } else {
            TachometerModel::ONE_MARK.wheel
        },
        ..TachometerModel::ONE_MARK
    };
    let seed = 1000 + index as u64;
    let outcome = judged(&case, &cut, accelerometer, tachometer, seed);
    println!("seed {seed}: {outcome}");
    outcome
}

/// From the first touch to half immersion: radius over feed speed.
fn cut_way_s(rpm: f64) -> f64 {
    6.35 / (0.15 * 2.0 * rpm / 60.0)
}

#[test]
fn a_fifth_below_the_limit_there_is_no_alarm() {
    let alarms: Vec<String> = (0..LIMITS.len())
        .map(|index| cut(index, 0.8))
        .filter(|outcome| outcome.first_alarm().is_some())
        .map(|outcome| outcome.to_string())
        .collect();
    assert!(alarms.is_empty(), "{}", alarms.join("\n"));
}

#[test]
fn a_fifth_above_the_limit_the_right_kind_is_called_in_time() {
    let missed: Vec<String> = (0..LIMITS.len())
        .map(|index| (index, cut(index, 1.2)))
        .filter(|(index, outcome)| {
            // Where loss of contact keeps the vibration below that, while it is cut at all.
            let ratio = if outcome.rpm == LATE.0 { LATE.1 } else { IN_TIME };
            let deadline_s = outcome.grown_to(ratio).unwrap_or(outcome.full_cut_s[1]);
            !outcome
                .first_alarm()
                .is_some_and(|(t, verdict)| t <= deadline_s && verdict == LIMITS[*index].2)
        })
        .map(|(_, outcome)| outcome.to_string())
        .collect();
    assert!(missed.is_empty(), "{}", missed.join("\n"));
}
