//! Tests of a mode that is tapped, with the faults that laboratories make.

use std::f64::consts::TAU;
use std::path::Path;

use num_complex::Complex64;
use quietcut_model::structure::Direction;
use quietcut_recording::{Channel, Quantity, Recording, Sidecar, TestKind};

use crate::measurement::measure;
use crate::measurement_settings::MeasurementSettings;
use crate::table::{Frf, FrfTable};
use crate::test_plausibility::table_doubts;

const RATE: f64 = 512.0;
const SAMPLES: usize = 8192;

/// Five impacts of eight samples on a mode of 20 Hz with 2 % damping, and its acceleration, both with a little noise.
fn tap() -> (Vec<f64>, Vec<f64>) {
    let (omega, damping, mass) = (TAU * 20.0, 0.02, 50.0);
    let mut force = vec![0.0; SAMPLES];
    for impact in 0..5 {
        for k in 0..=8 {
            force[200 + impact * 1600 + k] = 300.0 * (TAU * k as f64 / 16.0).sin().max(0.0);
        }
    }
    let mut acceleration = vec![0.0; SAMPLES];
    let (mut x, mut v) = (0.0, 0.0);
    // Steps of a hundredth of a sample make the errors of the semi-implicit Euler method small.
    let step = 0.01 / RATE;
    for (k, force) in force.iter().enumerate() {
        acceleration[k] = force / mass - omega * omega * x - 2.0 * damping * omega * v;
        for _ in 0..100 {
            v += step * (force / mass - omega * omega * x - 2.0 * damping * omega * v);
            x += step * v;
        }
    }
    let mut state = 1_u64;
    for sample in force.iter_mut().chain(&mut acceleration) {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
        *sample += 0.02 * ((state >> 40) as f64 / f64::from(1 << 24) - 0.5);
    }
    (force, acceleration)
}

fn recording(force: Vec<f64>, acceleration: Vec<f64>, kind: Option<TestKind>) -> Recording {
    let channel = |name: &str, quantity, samples| Channel {
        name: name.into(),
        quantity,
        samples,
    };
    Recording {
        path: "tap.csv".into(),
        sample_rate_hz: RATE,
        start_s: 0.0,
        since_s: 0.0,
        channels: vec![
            channel("fx", Quantity::Force, force),
            channel("ax", Quantity::Acceleration, acceleration),
        ],
        sidecar: Sidecar {
            kind,
            ..Sidecar::default()
        },
    }
}

fn said(force: Vec<f64>, acceleration: Vec<f64>, kind: Option<TestKind>) -> Result<String, String> {
    let settings = MeasurementSettings {
        band_hz: Some((10.0, 30.0)),
        ..MeasurementSettings::default()
    };
    measure(&[recording(force, acceleration, kind)], &settings)
        .map(|measured| measured.warnings.join("\n"))
        .map_err(|error| error.to_string())
}

/// Words of the warnings and refusals of this file.
const ALL: [&str; 8] = [
    "swapped",
    "inverted",
    "hum",
    "spike",
    "clipped",
    "little of the response",
    "implausibly",
    "periodic",
];

fn only(found: &str, expected: &[&str]) {
    for word in ALL {
        assert_eq!(found.contains(word), expected.contains(&word), "{word}: {found}");
    }
}

#[test]
fn a_good_tap_test_has_no_doubt() {
    let (force, acceleration) = tap();
    for kind in [Some(TestKind::Hammer), None] {
        only(&said(force.clone(), acceleration.clone(), kind).unwrap(), &[]);
    }
}

#[test]
fn swapped_force_and_acceleration_are_refused() {
    let (force, acceleration) = tap();
    for kind in [Some(TestKind::Hammer), None] {
        let what = said(acceleration.clone(), force.clone(), kind).unwrap_err();
        assert!(
            what.contains("swapped") && what.contains("--map fx=ax:m/s^2,ax=fx:N"),
            "{what}"
        );
    }
}

#[test]
fn an_inverted_sensor_is_named() {
    let (force, acceleration) = tap();
    let inverted: Vec<f64> = acceleration.iter().map(|sample| -sample).collect();
    only(
        &said(force, inverted, Some(TestKind::Hammer)).unwrap(),
        &["inverted"],
    );
}

#[test]
fn hum_larger_than_the_signal_is_named() {
    let (force, acceleration) = tap();
    let largest = acceleration
        .iter()
        .fold(0.0_f64, |peak, sample| peak.max(sample.abs()));
    for hertz in [50.02, 59.97] {
        let hum = |(k, sample): (usize, &f64)| sample + largest * (TAU * hertz * k as f64 / RATE).sin();
        let with_hum = acceleration.iter().enumerate().map(hum).collect();
        let found = said(force.clone(), with_hum, Some(TestKind::Hammer)).unwrap();
        assert!(found.contains("ax is mostly hum"), "{found}");
        assert!(
            found.contains(if hertz < 55.0 { "at 50 Hz" } else { "at 60 Hz" }),
            "{found}"
        );
    }
}

#[test]
fn a_spike_and_a_dead_sensor_are_named() {
    let (force, mut acceleration) = tap();
    let mut state = 7_u64;
    let dead = acceleration
        .iter()
        .map(|_| {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
            1e-2 * ((state >> 40) as f64 / f64::from(1 << 24) - 0.5)
        })
        .collect();
    let found = said(force.clone(), dead, Some(TestKind::Hammer)).unwrap();
    assert!(
        found.contains("little of the response comes from the force"),
        "{found}"
    );
    acceleration[3000] = 1e4;
    let found = said(force, acceleration, Some(TestKind::Hammer)).unwrap();
    assert!(
        found.contains("ax has a spike of one sample at 5.8594 s"),
        "{found}"
    );
}

#[test]
fn clipped_samples_are_named() {
    let (force, acceleration) = tap();
    let largest = acceleration
        .iter()
        .fold(0.0_f64, |peak, sample| peak.max(sample.abs()));
    let clipped = acceleration
        .iter()
        .map(|sample| sample.clamp(-0.4 * largest, 0.4 * largest))
        .collect();
    let found = said(force, clipped, Some(TestKind::Hammer)).unwrap_err();
    assert!(
        found.contains("ax is clipped") && found.contains("in all 5 impacts"),
        "{found}"
    );
}

#[test]
fn a_unit_that_no_structure_has_is_named() {
    let (force, acceleration) = tap();
    let force = force.iter().map(|sample| 1e-6 * sample).collect();
    let found = said(force, acceleration, Some(TestKind::Hammer)).unwrap();
    assert!(found.contains("implausibly large"), "{found}");
}

#[test]
fn an_ordinary_cut_is_no_test_of_a_structure() {
    let (_, acceleration) = tap();
    let force = |k: usize| {
        let turn = (30.0 * k as f64 / RATE).fract();
        if turn < 0.25 {
            100.0 * (TAU * turn).sin()
        } else {
            0.0
        }
    };
    let force: Vec<f64> = (0..SAMPLES).map(force).collect();
    for kind in [Some(TestKind::Cutting), None] {
        let found = said(force.clone(), acceleration.clone(), kind).unwrap();
        assert!(
            found.contains("periodic") && found.contains("quietcut diagnose") && found.contains("replay"),
            "{found}"
        );
    }
    // An acceleration of −df/dt gives the receptance i/ω, which has the sign of an inverted sensor. In a cut the receptance
    // between the lines is noise, and its sign says nothing: no second warning stands beside the first.
    let rate_of = |signal: &[f64]| -> Vec<f64> {
        let next = signal.iter().cycle().skip(1);
        signal.iter().zip(next).map(|(now, next)| now - next).collect()
    };
    let found = said(force.clone(), rate_of(&force), Some(TestKind::Cutting)).unwrap();
    assert!(
        found.contains("periodic") && !found.contains("inverted"),
        "{found}"
    );
    let (impacts, _) = tap();
    let found = said(impacts.clone(), rate_of(&impacts), Some(TestKind::Hammer)).unwrap();
    assert!(found.contains("inverted"), "{found}");
}

/// A single mode with noise of an accelerometer at the first lines, and the same with its sign or its phase turned.
#[test]
fn the_sign_of_a_table_is_judged_at_its_resonance() {
    let frequency_hz: Vec<f64> = (1..400).map(f64::from).collect();
    let of = |turned: &dyn Fn(Complex64) -> Complex64| {
        let value = |&hertz: &f64| {
            let mode = 1e-6 / Complex64::new(1.0 - (hertz / 200.0).powi(2), 0.04 * hertz / 200.0);
            turned(mode) + Complex64::new(0.0, 1e-3 / (hertz * hertz))
        };
        let entry = Frf {
            response: Direction::X,
            force: Direction::X,
            receptance: frequency_hz.iter().map(value).collect(),
            coherence: None,
            folding: None,
        };
        let table = FrfTable::new(Path::new("a.csv"), frequency_hz.clone(), vec![entry]).unwrap();
        table_doubts(&table).join("; ")
    };
    assert_eq!(of(&|h| h), "");
    for turned in [of(&|h| -h), of(&|h| h.conj())] {
        assert!(
            turned.contains("inverted sensor") && turned.contains("at 200.000 Hz"),
            "{turned}"
        );
    }
}
