//! A measured tachometer signal: a 60−2 wheel on a crankshaft, recorded with an oscilloscope at 10 kHz. Its base line varies
//! once per revolution.

#![allow(clippy::unwrap_used, clippy::panic)]

use quietcut_core::tachometer::{
    Edge, LevelDetector, LevelDetectorState, Tachometer, TachometerState, Wheel,
};
use quietcut_core::units::Nanoseconds;
use quietcut_testkit::measured;

/// The voltage samples of the recording.
fn levels() -> Vec<f32> {
    let path = measured("tachometer/crank_60-2.csv");
    let text = std::fs::read_to_string(&path).unwrap_or_else(|e| panic!("{}: {e}", path.display()));
    let column = |line: &str| line.split(',').nth(1).and_then(|field| field.trim().parse().ok());
    text.lines()
        .skip(1)
        .map(|line| column(line).unwrap_or_else(|| panic!("{line}")))
        .collect()
}

/// Spindle speed of each revolution, from voltages sampled at 10 kHz.
fn turn_speeds(levels: impl Iterator<Item = f32>) -> (Vec<f32>, TachometerState) {
    let tachometer = Tachometer::new(Wheel {
        positions: 60,
        missing: 2,
    })
    .unwrap();
    let mut state = TachometerState::default();
    // The threshold is a tenth of the amplitude of a tooth, one volt.
    let detector = LevelDetector { least_swing: 0.1 };
    let mut level_state = LevelDetectorState::default();
    let mut speeds = Vec::new();
    for (n, level) in levels.enumerate() {
        let Some(part) = detector.step(&mut level_state, level) else {
            continue;
        };
        let time = Nanoseconds(((n as f64 - f64::from(part)) * 1e5).round() as u64);
        let before = state.turns();
        tachometer.observe(&mut state, Edge { time });
        if state.turns() > before {
            speeds.extend(state.turn_speed().map(|speed| speed.0));
        }
    }
    (speeds, state)
}

#[test]
#[ignore = "measured records: QUIETCUT_DATA names their folder"]
fn measured_crank_wheel_runs_at_160_7_rpm() {
    let levels = levels();
    // A variable-reluctance sensor may have either polarity.
    for sign in [1.0, -1.0] {
        let (speeds, state) = turn_speeds(levels.iter().map(|level| sign * level));
        println!(
            "{speeds:?}, {} rejected, {} missed",
            state.rejected(),
            state.missed()
        );
        // The record has 16 gaps. The first comes before the regular interval is known, which leaves 14 complete revolutions.
        assert_eq!(speeds.len(), 14);
        assert_eq!((state.losses(), state.missed()), (0, 0));
        let mean = speeds.iter().sum::<f32>() / speeds.len() as f32;
        assert!((mean / 160.7 - 1.0).abs() < 0.003, "mean {mean}");
        for speed in speeds {
            assert!((160.0..161.6).contains(&speed), "{speed}");
        }
    }
}
