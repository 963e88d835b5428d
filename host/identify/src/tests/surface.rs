//! Restoring-force surfaces from virtual tests.

use std::path::Path;

use crate::nonlinear::restoring_force::{ForceTerm, Options, Record, Surface};
use quietcut_model::structure::Direction;
use quietcut_recording::{Quantity, Recording};
use quietcut_simulate::rig::{Noise, Rig, Signal};
use quietcut_testkit::case;

const TERMS: [ForceTerm; 5] = [
    ForceTerm::Mass,
    ForceTerm::Damping,
    ForceTerm::Stiffness,
    ForceTerm::CubicStiffness,
    ForceTerm::CubicDamping,
];
/// True m, c, k, k3, c3 of the mode at 17.5 Hz, the set for lower forces.
const TRUTH: [f64; 5] = [188.0, 305.0, 2.26e6, -5.05e12, 2.53e6];

fn recording(signal: Signal, noise: f64, seed: u64) -> Recording {
    let structure = case("kuka-kr90-y17-low").structure.unwrap();
    let mut recording = Rig::new(Direction::Y, signal, 1024.0)
        .record(&structure, Path::new("a.csv"))
        .unwrap()
        .0;
    Noise {
        relative: noise,
        ..Noise::default()
    }
    .add(&mut recording, seed);
    recording
}

/// Eleven tones from 16.8 to 17.8 Hz, as for thesis Figs 5.1 and 5.2.
fn tones() -> Signal {
    let frequencies: Vec<f64> = (0..11).map(|k| 16.8 + 0.1 * f64::from(k)).collect();
    Signal::tones(&frequencies, [4.0, 4.0], 100.0, 3)
}

fn surface(recording: &Recording, channel: &str, options: &Options) -> Surface {
    let motion = recording.channel(channel).unwrap();
    Record {
        force: &recording.channel("fy").unwrap().samples,
        motion: &motion.samples,
        quantity: motion.quantity,
        rate_hz: recording.sample_rate_hz,
    }
    .surface(options)
    .unwrap()
}

fn options(mass_kg: Option<f64>) -> Options {
    Options {
        terms: TERMS.to_vec(),
        mass_kg,
        band_hz: None,
        trim_s: 2.0,
    }
}

fn within(surface: &Surface, share: [f64; 5], what: &str) {
    for ((term, truth), share) in TERMS.iter().zip(TRUTH).zip(share) {
        let Some(found) = surface.value(*term) else {
            continue;
        };
        let error = found / truth - 1.0;
        println!("{what} {}: {:+.3} %", term.key(), 100.0 * error);
        assert!(error.abs() < share, "{what} {}: {found} {truth}", term.key());
    }
}

#[test]
fn the_law_comes_from_displacement_or_acceleration_alone() {
    for (channel, noise) in [("y", 0.0), ("ay", 0.0), ("y", 0.01), ("ay", 0.01)] {
        let recording = recording(tones(), noise, 5);
        let found = surface(&recording, channel, &options(None));
        within(
            &found,
            [0.01, 0.03, 0.01, 0.05, 0.05],
            &format!("{channel}, noise {noise}, band {:?}", found.band_hz),
        );
    }
}

#[test]
fn slices_show_the_cubic_spring_and_damper() {
    for noise in [0.0, 0.01] {
        let recording = recording(tones(), noise, 6);
        let found = surface(&recording, "y", &options(None));
        let (stiffness, damping) = (
            found.stiffness_slice(0.02).unwrap(),
            found.damping_slice(0.02).unwrap(),
        );
        println!(
            "noise {noise}: k3 {:+.2} %, c3 {:+.2} % from {} and {} samples",
            100.0 * (stiffness.cubic.0 / TRUTH[3] - 1.0),
            100.0 * (damping.cubic.0 / TRUTH[4] - 1.0),
            stiffness.points.len(),
            damping.points.len()
        );
        assert!((stiffness.cubic.0 / TRUTH[3] - 1.0).abs() < 0.05);
        assert!((damping.cubic.0 / TRUTH[4] - 1.0).abs() < 0.05);
        assert!((stiffness.linear.0 / TRUTH[2] - 1.0).abs() < 0.01);
    }
}

#[test]
fn a_free_decay_with_given_mass_gives_the_law() {
    let release = Signal::Release {
        force_n: 220.0,
        pull_s: 2.0,
        seconds: 8.0,
    };
    let mut recording = recording(release, 0.0, 1);
    // The record starts 50 ms after the release, when the force is zero.
    let from = ((1.2 * 2.0 + 0.05) * 1024.0) as usize;
    for channel in &mut recording.channels {
        channel.samples.drain(..from);
    }
    let found = surface(
        &recording,
        "y",
        &Options {
            trim_s: 0.1,
            ..options(Some(TRUTH[0]))
        },
    );
    within(&found, [0.01, 0.05, 0.01, 0.05, 0.05], "free");
    let nothing = Record {
        force: &vec![0.0; recording.len()],
        motion: &recording.channel("y").unwrap().samples,
        quantity: Quantity::Displacement,
        rate_hz: 1024.0,
    };
    assert!(nothing.surface(&options(None)).is_err());
}
