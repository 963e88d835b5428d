//! Folding of short impacts in unfiltered samples: the true error lies within the stated one.

use std::f64::consts::{PI, TAU};

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::*;
use quietcut_recording::{Channel, Quantity, RecordedChannel, Sidecar, TestKind};

const RATE: f64 = 512.0;

/// Steps of the response for one sample.
const FINE: usize = 64;

/// One mode in y: natural frequency 17.4 Hz, damping ratio 2 %, mass 60 kg.
const HERTZ: f64 = 17.4;
const DAMPING: f64 = 0.02;
const MASS_KG: f64 = 60.0;

fn receptance(hertz: f64) -> Complex64 {
    let (own, omega) = (TAU * HERTZ, TAU * hertz);
    (MASS_KG * Complex64::new(own * own - omega * omega, 2.0 * DAMPING * own * omega)).inv()
}

/// Force and displacement of half-sine impacts (start, s) as a converter without filter samples them.
fn hammer_test(starts_s: &[f64], length_s: f64, seconds: f64) -> Recording {
    let own = TAU * HERTZ;
    let pole = Complex64::new(-DAMPING * own, own * (1.0 - DAMPING * DAMPING).sqrt());
    // x = Im(q)/(m ω_d) with q' = λq + f, since the impulse response is Im(e^{λt})/(m ω_d).
    let step_s = 1.0 / (RATE * FINE as f64);
    let (decay, half) = ((pole * step_s).exp(), (pole * (0.5 * step_s)).exp());
    let force_at = |t: f64| -> f64 {
        let pulse = |start: &f64| {
            let since = t - start;
            if (0.0..length_s).contains(&since) {
                300.0 * (PI * since / length_s).sin()
            } else {
                0.0
            }
        };
        starts_s.iter().map(pulse).sum()
    };
    let mut state = Complex64::ZERO;
    let (mut force, mut moved) = (Vec::new(), Vec::new());
    for step in 0..(seconds * RATE) as usize * FINE {
        let t = step as f64 * step_s;
        if step % FINE == 0 {
            force.push(force_at(t));
            moved.push(state.im / (MASS_KG * pole.im));
        }
        state = decay * state + half * (step_s * force_at(t + 0.5 * step_s));
    }
    let channel = |name: &str, quantity, samples| Channel {
        name: name.into(),
        quantity,
        samples,
    };
    Recording {
        path: "taps.csv".into(),
        start_s: 0.0,
        since_s: 0.0,
        sample_rate_hz: RATE,
        channels: vec![
            channel("fy", Quantity::Force, force),
            channel("y", Quantity::Displacement, moved),
        ],
        sidecar: Sidecar {
            kind: Some(TestKind::Hammer),
            ..Sidecar::default()
        },
    }
}

/// Relative error of |H| at its peak line, and the error that is stated for it.
fn true_and_stated(recording: &Recording) -> (f64, f64) {
    let measurement = measure(std::slice::from_ref(recording), &MeasurementSettings::default()).unwrap();
    let entry = &measurement.table.entries()[0];
    let size = |line: usize| entry.receptance[line].norm();
    let peak = (0..entry.receptance.len())
        .max_by(|&a, &b| size(a).total_cmp(&size(b)))
        .unwrap();
    let truth = receptance(measurement.table.frequency_hz()[peak]).norm();
    (
        (size(peak) / truth - 1.0).abs(),
        measurement.table.entries()[0]
            .folding
            .as_ref()
            .map_or(0.0, |folding| folding[peak]),
    )
}

#[test]
fn the_error_by_folding_is_within_the_stated_one_and_not_far_below() {
    let mut worst = 0.0_f64;
    for seed in 0..40 {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        // Half sines of 3 to 10 samples.
        let length_s = rng.random_range(0.006..0.02);
        let starts: Vec<f64> = (0..3)
            .map(|k| 1.0 + 12.0 * f64::from(k) + rng.random_range(0.0..0.01))
            .collect();
        let (error, stated) = true_and_stated(&hammer_test(&starts, length_s, 37.0));
        assert!(
            error <= stated,
            "seed {seed}: {length_s} s: {error} stated {stated}"
        );
        worst = worst.max(error / stated);
    }
    assert!(worst > 0.2, "the bound is {:.1} times too wide", 1.0 / worst);
}

#[test]
fn a_filter_that_the_sidecar_states_leaves_no_folding() {
    let mut recording = hammer_test(&[1.0, 13.0, 25.0], 0.01, 37.0);
    assert!(true_and_stated(&recording).1 > 0.0);
    for name in ["fy", "y"] {
        let filtered = RecordedChannel {
            anti_aliasing: Some(true),
            ..RecordedChannel::default()
        };
        recording.sidecar.channels.insert(name.into(), filtered);
    }
    assert_eq!(true_and_stated(&recording).1, 0.0);
}

#[test]
fn fewer_than_three_impacts_have_no_coherence_and_no_deviation() {
    for (starts, has) in [
        (&[1.0][..], false),
        (&[1.0, 13.0], false),
        (&[1.0, 13.0, 25.0], true),
    ] {
        let recording = hammer_test(starts, 0.02, 37.0);
        let measurement = measure(std::slice::from_ref(&recording), &MeasurementSettings::default()).unwrap();
        assert_eq!(measurement.table.entries()[0].coherence.is_some(), has);
        assert_eq!(measurement.has_deviation, [has]);
        let warned = measurement
            .warnings
            .iter()
            .any(|said| said.contains("no coherence and no interval"));
        assert_eq!(warned, !has, "{:?}", measurement.warnings);
    }
}
