//! Speed and phase from edges, and edges from levels, for wheels with known motion.

#![allow(clippy::unwrap_used)]

use quietcut_core::tachometer::{
    Edge, EdgeKind, LevelDetector, LevelDetectorState, Tachometer, TachometerState, Turns, Wheel,
};
use quietcut_core::units::Nanoseconds;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

const ONE_MARK: Wheel = Wheel {
    positions: 1,
    missing: 0,
};
const SIXTY_LESS_TWO: Wheel = Wheel {
    positions: 60,
    missing: 2,
};

fn at(seconds: f64) -> Edge {
    Edge {
        time: Nanoseconds((seconds * 1e9).round() as u64),
    }
}

/// Times of the edges of a wheel with constant speed, from t = 0.1 s at angle 0, over `turns` revolutions.
fn even_edges(wheel: Wheel, turns_per_second: f64, turns: u32) -> Vec<f64> {
    (0..turns * u32::from(wheel.positions))
        .filter(|i| i % u32::from(wheel.positions) < u32::from(wheel.positions - wheel.missing))
        .map(|i| 0.1 + f64::from(i) / f64::from(wheel.positions) / turns_per_second)
        .collect()
}

/// Distance of two angles on the circle, in revolutions.
fn apart(angle: Turns, turns: f64) -> f64 {
    let difference = f64::from(angle.fraction()) / 4_294_967_296.0 - turns;
    difference - difference.round()
}

#[test]
fn phase_between_the_pulses_of_a_jittery_mark() {
    let tachometer = Tachometer::new(ONE_MARK).unwrap();
    let mut state = TachometerState::default();
    let seed = 11;
    println!("seed {seed}");
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let speed = 17.4167;
    let (mut worst, mut squares, mut claimed, mut count) = (0.0_f64, 0.0, 0.0, 0);
    let edges = even_edges(ONE_MARK, speed, 200);
    for (n, &time) in edges.iter().enumerate() {
        let jitter = random.random_range(-20e-6..20e-6);
        tachometer.observe(&mut state, at(time + jitter));
        if n < 20 {
            continue;
        }
        for part in 0..10 {
            let late = time + f64::from(part) / 10.0 / speed;
            let phase = tachometer.phase(&state, at(late).time).unwrap();
            let error = apart(phase.angle, (late - 0.1) * speed);
            worst = worst.max(error.abs());
            squares += error * error;
            claimed += f64::from(phase.deviation_turns).powi(2);
            count += 1;
        }
    }
    let (rms, claimed) = (
        (squares / f64::from(count)).sqrt(),
        (claimed / f64::from(count)).sqrt(),
    );
    // Uniform jitter of ±20 µs has 11.5 µs or 2.0e-4 revolutions rms. A line through about eight edges, extrapolated by at most
    // one interval, does not exceed it.
    assert!(rms < 2.0e-4 && worst < 8e-4, "rms {rms}, worst {worst}");
    assert!(
        claimed > 0.6 * rms && claimed < 1.7 * rms,
        "claims {claimed}, has {rms}"
    );
}

#[test]
fn double_and_missing_edges_change_nothing() {
    for wheel in [
        ONE_MARK,
        SIXTY_LESS_TWO,
        Wheel {
            positions: 4,
            missing: 0,
        },
        Wheel {
            positions: 36,
            missing: 1,
        },
    ] {
        let tachometer = Tachometer::new(wheel).unwrap();
        let mut state = TachometerState::default();
        let seed = 5;
        println!("seed {seed}, wheel {wheel:?}");
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        let speed = 20.0;
        let pitch = 1.0 / speed / f64::from(wheel.positions);
        let turns = 4000 / u32::from(wheel.positions) + 10;
        let (mut doubled, mut dropped) = (0, 0);
        let mut spared = 0;
        for (n, time) in even_edges(wheel, speed, turns).into_iter().enumerate() {
            spared += 1;
            let settled = n > 4 * usize::from(wheel.positions) && spared > 3;
            if settled && random.random_bool(0.02) {
                dropped += 1;
                spared = 0;
                continue;
            }
            tachometer.observe(&mut state, at(time));
            if settled && random.random_bool(0.02) {
                doubled += 1;
                spared = 0;
                let kind = tachometer.observe(&mut state, at(time + random.random_range(0.01..0.3) * pitch));
                assert_eq!(kind, EdgeKind::Rejected);
            }
            if settled {
                let phase = tachometer.phase(&state, at(time).time).unwrap();
                let error = apart(phase.angle, (time - 0.1) * speed);
                // The tolerance is 1 ns per edge and the f32 rounding of the period.
                let gap_origin = if wheel.missing > 0 || wheel.positions == 1 {
                    0.0
                } else {
                    error
                };
                assert!((error - gap_origin).abs() < 2e-6, "turn error {error} at {time}");
            }
        }
        assert!(doubled > 20 && dropped > 20);
        assert_eq!(state.losses(), 0);
        assert_eq!(state.rejected(), doubled);
    }
}

#[test]
fn a_stopped_spindle_loses_the_lock_and_regains_it() {
    let tachometer = Tachometer::new(ONE_MARK).unwrap();
    let mut state = TachometerState::default();
    for time in even_edges(ONE_MARK, 15.0, 30) {
        tachometer.observe(&mut state, at(time));
    }
    let last = 0.1 + 29.0 / 15.0;
    tachometer.expire(&mut state, at(last + 2.0 / 15.0).time);
    assert!(
        tachometer.speed(&state).is_some(),
        "two turns without an edge are bridged"
    );
    tachometer.expire(&mut state, at(last + 3.0 / 15.0).time);
    assert!(tachometer.speed(&state).is_none());
    assert_eq!(state.losses(), 1);
    for time in even_edges(ONE_MARK, 40.0, 10) {
        tachometer.observe(&mut state, at(time + 10.0));
    }
    let speed = tachometer.speed(&state).unwrap().0;
    assert!((speed - 2400.0).abs() < 0.01, "{speed}");
}

#[test]
fn a_missed_pulse_of_one_mark_does_not_halve_the_speed() {
    let tachometer = Tachometer::new(ONE_MARK).unwrap();
    let mut state = TachometerState::default();
    for (n, time) in even_edges(ONE_MARK, 50.0, 40).into_iter().enumerate() {
        if n % 7 == 6 {
            continue;
        }
        tachometer.observe(&mut state, at(time));
        if n > 3 {
            let speed = tachometer.speed(&state).unwrap().0;
            let turn = state.turn_speed().unwrap().0;
            assert!((speed - 3000.0).abs() < 1.0, "speed {speed} at pulse {n}");
            assert!((turn - 3000.0).abs() < 1.0, "turn {turn} at pulse {n}");
        }
    }
    // The lock needs three pulses.
    assert_eq!((state.turns(), state.losses()), (37, 0));
}

#[test]
fn twice_as_many_pulses_are_twice_the_speed() {
    let tachometer = Tachometer::new(ONE_MARK).unwrap();
    let mut state = TachometerState::default();
    let mut time = 0.1;
    for interval in [0.1; 20].into_iter().chain([0.05; 4]) {
        time += interval;
        tachometer.observe(&mut state, at(time));
    }
    assert!((tachometer.speed(&state).unwrap().0 - 1200.0).abs() < 1.0);
}

#[test]
fn intervals_without_order_do_not_end_the_search() {
    let tachometer = Tachometer::new(ONE_MARK).unwrap();
    let mut state = TachometerState::default();
    // A stop, pulses of a mark that swings before the sensor, and a new run-up.
    let mut time = 0.1;
    for interval in [0.01, 0.03, 0.2, 0.04, 0.5, 0.09, 0.3]
        .into_iter()
        .chain([0.02; 5])
    {
        time += interval;
        tachometer.observe(&mut state, at(time));
    }
    assert!((tachometer.speed(&state).unwrap().0 - 3000.0).abs() < 1.0);
}

#[test]
fn the_speed_is_known_before_the_gap_passes() {
    let tachometer = Tachometer::new(SIXTY_LESS_TWO).unwrap();
    let mut state = TachometerState::default();
    for time in even_edges(SIXTY_LESS_TWO, 20.0, 1).into_iter().take(6) {
        tachometer.observe(&mut state, at(time));
    }
    assert!((tachometer.speed(&state).unwrap().0 - 1200.0).abs() < 1.0);
    assert!(tachometer.phase(&state, at(0.11).time).is_none());
}

#[test]
fn speed_follows_a_ramp() {
    let tachometer = Tachometer::new(ONE_MARK).unwrap();
    let mut state = TachometerState::default();
    // From 600 to 1200 rev/min in 10 s: the angle is 10 t + 0.5 t² revolutions.
    for turn in 0..150 {
        let turn = f64::from(turn);
        let time = -10.0 + (100.0 + 2.0 * turn).sqrt();
        tachometer.observe(&mut state, at(time));
        if turn > 20.0 {
            let speed = f64::from(tachometer.speed(&state).unwrap().0);
            let truth = 60.0 * (10.0 + time);
            // The line covers about eight past revolutions, so that the speed lags by about half of them.
            assert!((speed - truth).abs() / truth < 0.05, "{speed} for {truth}");
        }
    }
    assert_eq!(state.losses(), 0);
    assert!(state.change_per_turn().unwrap() > 0.002);
}

/// Voltage of a variable-reluctance sensor on a 60−2 wheel: a sine per tooth, one large pulse over the gap, a base line that
/// varies once per revolution, and noise.
fn reluctance_level(turns: f64, base: f64) -> f64 {
    let position = turns.rem_euclid(1.0) * 60.0;
    let tau = std::f64::consts::TAU;
    let pulses = if position < 57.5 {
        (tau * position).sin()
    } else {
        0.0
    };
    // Over the gap the flux falls and rises once, with three times the amplitude.
    let gap = if (57.5..60.0).contains(&position) {
        -3.0 * (tau * (position - 57.5) / 2.5).sin()
    } else {
        0.0
    };
    pulses + gap + base * (tau * turns).sin()
}

#[test]
fn edges_are_found_on_a_swinging_base_line() {
    let tachometer = Tachometer::new(SIXTY_LESS_TWO).unwrap();
    for (base, noise) in [(0.0, 0.0), (2.0, 0.05), (4.0, 0.1)] {
        let mut state = TachometerState::default();
        let detector = LevelDetector { least_swing: 0.3 };
        let mut level_state = LevelDetectorState::default();
        let seed = 3;
        println!("seed {seed}, base line ±{base}, noise {noise}");
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        let (rate, speed) = (10_000.0, 160.7 / 60.0);
        let mut speeds = Vec::new();
        for n in 0..80_000 {
            let time = f64::from(n) / rate;
            let level = reluctance_level(time * speed + 0.3, base) + noise * random.random_range(-1.0..1.0);
            let Some(part) = detector.step(&mut level_state, level as f32) else {
                continue;
            };
            let before = state.turns();
            tachometer.observe(&mut state, at(1.0 + (f64::from(n) - f64::from(part)) / rate));
            if state.turns() > before {
                speeds.push(state.turn_speed().unwrap().0);
            }
        }
        assert!(speeds.len() >= 18, "{} turns", speeds.len());
        for speed in speeds {
            // Noise of a tenth of the slope, 2π per pitch of 6.2 ms, moves an edge by 0.1 ms; a revolution takes 373 ms.
            assert!((speed - 160.7).abs() < 0.16, "{speed}");
        }
        assert_eq!(state.losses(), 0);
    }
}

/// Level of a sensor with one mark per revolution: a pulse of a tenth of a revolution with inclined edges, from 0 to 1.
fn pulse_level(turns: f64) -> f64 {
    let position = turns.rem_euclid(1.0);
    let side = |from: f64| ((position - from) / 0.02).clamp(0.0, 1.0);
    side(0.5) - side(0.6)
}

/// Times of the edges, in samples, of a pulse every 200 samples. The record begins at the fraction `start` of a revolution.
fn pulse_edges(start: f64, noise: f64, seed: u64) -> Vec<f64> {
    // The noise has up to four fifths of the smallest accepted peak-to-peak amplitude.
    let detector = LevelDetector {
        least_swing: (2.5 * noise) as f32,
    };
    let mut state = LevelDetectorState::default();
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let edges = (0..4000).filter_map(|n| {
        let level = pulse_level(start + f64::from(n) / 200.0) + noise * random.random_range(-1.0..1.0);
        let part = detector.step(&mut state, level as f32)?;
        Some(f64::from(n) - f64::from(part))
    });
    edges.collect()
}

#[test]
fn a_record_may_begin_anywhere_on_a_pulse() {
    let seed = rand::random();
    println!("seed {seed}");
    for step in 0..200 {
        let start = f64::from(step) / 200.0;
        let edges = pulse_edges(start, 0.02, seed);
        let because = format!("begun at {start} of a turn: {edges:?}");
        // Twenty revolutions. A record that begins on a rising edge may have a part of this edge at both ends, or at none.
        let is_on_side = (0.5..0.52).contains(&start);
        let possible = if is_on_side { 19..=21 } else { 20..=20 };
        assert!(possible.contains(&edges.len()), "{because}");
        // The first edge is found near the foot of the pulse, the second where a part of the amplitude was seen: an error of 4
        // samples.
        for pair in edges.windows(2) {
            assert!((pair[1] - pair[0] - 200.0).abs() < 4.0, "{because}");
        }
        // All later edges are at half the amplitude: noise of 0.02 at both ends, and an amplitude known to 0.04, on a slope of
        // 0.25 per sample.
        for pair in edges.windows(2).skip(2) {
            assert!((pair[1] - pair[0] - 200.0).abs() < 0.5, "{because}");
        }
    }
}

#[test]
fn edges_are_found_again_after_the_signal_becomes_smaller() {
    let detector = LevelDetector { least_swing: 0.05 };
    let mut state = LevelDetectorState::default();
    let mut late = 0;
    for n in 0..20_000 {
        let size = if n < 6000 { 1.0 } else { 0.1 };
        let edge = detector.step(&mut state, (size * pulse_level(f64::from(n) / 200.0)) as f32);
        late += usize::from(edge.is_some() && n >= 15_000);
    }
    // After two pauses of eight revolutions, the estimated amplitude is below twice the small one.
    assert_eq!(late, 25);
}

#[test]
fn wheels_that_cannot_be_are_refused() {
    for wheel in [
        Wheel {
            positions: 0,
            missing: 0,
        },
        Wheel {
            positions: 5,
            missing: 2,
        },
        Wheel {
            positions: 2,
            missing: 3,
        },
    ] {
        assert!(Tachometer::new(wheel).is_none(), "{wheel:?}");
    }
}
