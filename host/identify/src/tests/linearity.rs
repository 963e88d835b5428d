//! A linear rig is recognized as linear, and each nonlinear rig by its kind of nonlinearity.

use std::path::Path;

use rayon::prelude::*;

use crate::dwells::dwell::{Dwell, dwell_segments, pool_variances};
use crate::dwells::steady::windows;
use crate::nonlinear::describing::Nonlinearity;
use crate::nonlinear::homogeneity::regions;
use crate::nonlinear::linearity::{self, Verdict};
use quietcut_model::structure::{Direction, Form, Structure};
use quietcut_recording::{Quantity, Recording};
use quietcut_simulate::Effects;
use quietcut_simulate::rig::{Noise, Rig, Signal};
use quietcut_testkit::case;

fn linear() -> Structure {
    let mut structure = case("kuka-kr90-y17-low").structure.unwrap();
    if let Form::Matrices(matrices) = &mut structure.form {
        (matrices.cubic_damping, matrices.cubic_stiffness) = (None, None);
    }
    structure
}

/// Step-sine recordings at five force levels and five frequencies, without noise.
fn steps(structure: &Structure, effects: &[&str], direction: Direction, center_hz: f64) -> Vec<Recording> {
    let frequencies: Vec<f64> = (0..5)
        .map(|k| center_hz * (0.97 + 0.015 * f64::from(k)))
        .collect();
    [1.5, 3.0, 6.0, 10.0, 16.0]
        .par_iter()
        .map(|level| {
            let rig = Rig {
                effects: Effects::parse(effects.iter().copied()).unwrap(),
                measured: vec![Quantity::Displacement],
                ..Rig::new(
                    direction,
                    Signal::step_sine(&frequencies, &[*level], 24.0, 1.0),
                    256.0,
                )
            };
            rig.record(structure, Path::new("a.csv")).unwrap().0
        })
        .collect()
}

fn verdict(recordings: &[Recording], seed: u64) -> Verdict {
    let noise = Noise {
        relative: 0.01,
        ..Noise::default()
    };
    let mut dwells = Vec::new();
    for (level, recording) in recordings.iter().enumerate() {
        let mut noisy = recording.clone();
        noise.add(&mut noisy, 64 * seed + level as u64);
        let mut of_level: Vec<Dwell> = dwell_segments(&noisy)
            .into_iter()
            .filter_map(|mut stretch| {
                stretch.from = stretch.to.saturating_sub(1024);
                Dwell::fit(&noisy, stretch, 5)
            })
            .collect();
        pool_variances(&mut of_level);
        dwells.extend(of_level);
    }
    linearity::verdict(&dwells).unwrap()
}

#[test]
fn linear_rigs_are_recognized_98_times_in_a_hundred() {
    let one = steps(&linear(), &[], Direction::Y, 17.45);
    // Three complex modes without a mass matrix: the thesis's robot in process.
    let three = steps(
        &case("kuka-kr90-acetal").structure.unwrap(),
        &[],
        Direction::Y,
        17.0,
    );
    for (name, recordings) in [("one mode", one), ("complex modes", three)] {
        let called: usize = (0..100_u64)
            .into_par_iter()
            .map(|seed| usize::from(verdict(&recordings, seed).linear))
            .sum();
        println!("{name}: called linear {called} times");
        assert!(called >= 98, "{name}: {called}");
    }
}

#[test]
fn nonlinear_rigs_are_recognized_by_their_kind() {
    let rigs: [(&[&str], &[Nonlinearity]); 8] = [
        (&["cubic-stiffness=-3e12"], &[Nonlinearity::CubicStiffness]),
        (&["cubic-stiffness=3e12"], &[Nonlinearity::CubicStiffness]),
        (&["cubic-damping=3e6"], &[Nonlinearity::CubicDamping]),
        (
            &["quadratic-stiffness=1.5e9"],
            &[Nonlinearity::QuadraticStiffness],
        ),
        (
            &[
                "softening-hardening=-1e13",
                "softening-hardening.k5_n_per_m5=1e21",
            ],
            &[Nonlinearity::SofteningHardening],
        ),
        (&["coulomb-friction=0.8"], &[Nonlinearity::CoulombFriction]),
        (
            &["backlash=0.02", "backlash.stiffness_fraction=0.1"],
            &[Nonlinearity::Backlash],
        ),
        (
            &["hysteresis=1.5e5", "hysteresis.yield_m=1e-5"],
            &[Nonlinearity::Hysteresis],
        ),
    ];
    let mut wrong = Vec::new();
    for (effects, kinds) in rigs {
        let recordings = steps(&linear(), effects, Direction::Y, 17.45);
        for seed in 0..5 {
            let found = verdict(&recordings, seed);
            if seed == 0 {
                println!(
                    "{effects:?}: {:?}, misfit {:.1} to {:.2}",
                    found.kinds, found.linear_misfit, found.explained_misfit
                );
            }
            if found.linear || found.kinds != kinds {
                wrong.push((effects, seed, found.kinds));
            }
        }
    }
    // The mode of the thesis has cubic stiffness and cubic damping.
    let both = steps(
        &case("kuka-kr90-y17-low").structure.unwrap(),
        &[],
        Direction::Y,
        17.45,
    );
    let mut found = verdict(&both, 1).kinds;
    found.sort();
    println!("cubic spring and damper: {found:?}");
    assert!(wrong.is_empty(), "{wrong:?}");
    assert_eq!(found, [Nonlinearity::CubicStiffness, Nonlinearity::CubicDamping]);
}

#[test]
fn regions_and_jumps_of_a_rising_force_are_found() {
    // Simulated amplitudes in three regions, with a jump of a fifth between the second and the third.
    let points: Vec<(f64, f64)> = (0..60)
        .map(|k| {
            let f = 0.25 * f64::from(k + 1);
            let x = match f {
                f if f < 5.0 => 2.0 * f,
                f if f < 10.0 => 10.0 + 0.8 * (f - 5.0),
                f => 17.0 + 1.5 * (f - 10.0),
            };
            (f, x + 0.01 * (f64::from(k) * 12.9898).sin())
        })
        .collect();
    let (found, jumps) = regions(&points);
    assert_eq!(found.len(), 3, "{found:?}");
    assert!((found[0].slope - 2.0).abs() < 0.02 && (found[1].slope - 0.8).abs() < 0.02);
    assert_eq!(jumps.len(), 1, "{jumps:?}");
    assert!((jumps[0] - 10.0).abs() < 0.3);
    let straight: Vec<(f64, f64)> = points
        .iter()
        .enumerate()
        .map(|(k, (f, _))| (*f, 2.0 * f + 0.01 * (k as f64 * 12.9898).sin()))
        .collect();
    assert_eq!((regions(&straight).0.len(), regions(&straight).1.len()), (1, 0));
}

#[test]
fn a_tone_of_rising_force_shows_homogeneity() {
    let tone = Signal::tones(&[17.0], [0.0, 20.0], 153.0, 1);
    let rig = |effects: &[&str]| Rig {
        effects: Effects::parse(effects.iter().copied()).unwrap(),
        measured: vec![Quantity::Displacement],
        ..Rig::new(Direction::Y, tone.clone(), 256.0)
    };
    let points = |effects: &[&str]| {
        let recording = rig(effects).record(&linear(), Path::new("a.csv")).unwrap().0;
        let windows = windows(&recording, 3, 10.0);
        let points: Vec<(f64, f64)> = windows
            .iter()
            .map(|dwell| (dwell.forces[0].amplitude(1), dwell.motions[0].amplitude(1)))
            .collect();
        points
    };
    let (found, jumps) = regions(&points(&[])[10..]);
    println!("linear: {found:?} {jumps:?}");
    assert!(jumps.is_empty());
    let slopes = |points: &[(f64, f64)]| {
        let (found, _) = regions(points);
        found[0].slope / found[found.len() - 1].slope
    };
    assert!((slopes(&points(&[])[10..]) - 1.0).abs() < 0.02);
    // With cubic damping the response grows less than the force.
    assert!(slopes(&points(&["cubic-damping=3e7"])[10..]) > 1.3);
}

#[test]
fn forward_and_backward_sweeps_of_a_linear_rig_agree_and_of_others_do_not() {
    use crate::nonlinear::sweep::{Spectra, compare};
    let sweep = |effects: &[&str], ends: [f64; 2], amplitude_n: f64| {
        // Sweep rate of the thesis: 6 Hz per minute.
        let signal = Signal::Sweep {
            first_hz: ends[0],
            last_hz: ends[1],
            amplitude_n,
            seconds: 50.0,
        };
        let rig = Rig {
            effects: Effects::parse(effects.iter().copied()).unwrap(),
            measured: vec![Quantity::Displacement],
            ..Rig::new(Direction::Y, signal, 128.0)
        };
        rig.record(&linear(), Path::new("a.csv")).unwrap().0
    };
    let noise = Noise {
        relative: 0.01,
        ..Noise::default()
    };
    let spectra = |recording: &Recording, seed: u64| {
        let mut noisy = recording.clone();
        noise.add(&mut noisy, seed);
        let samples = |name: &str| noisy.channel(name).unwrap().samples.clone();
        Spectra::new(&samples("fy"), &samples("y"), 128.0)
    };
    let (up, down) = ([15.0, 20.0], [20.0, 15.0]);
    let plain = [sweep(&[], up, 9.0), sweep(&[], down, 9.0), sweep(&[], up, 3.0)];
    let same: usize = (0..100)
        .map(|seed| {
            let [a, b, c] = [0, 1, 2].map(|i| spectra(&plain[i], 3 * seed + i as u64));
            let both = compare(&a, &b).unwrap().same && compare(&a, &c).unwrap().same;
            usize::from(both)
        })
        .sum();
    println!("sweeps of a linear rig agree {same} times");
    assert!(same >= 98, "{same}");
    for effects in [
        ["cubic-stiffness=-3e12"],
        ["cubic-damping=3e6"],
        ["coulomb-friction=0.8"],
    ] {
        let (a, b) = (sweep(&effects, up, 9.0), sweep(&effects, down, 3.0));
        let found = compare(&spectra(&a, 1), &spectra(&b, 2)).unwrap();
        println!("{effects:?}: {found:?}");
        assert!(!found.same, "{effects:?}");
    }
    // With a softening spring a forward sweep differs from a backward sweep.
    let (a, b) = (
        sweep(&["cubic-stiffness=-3e12"], up, 9.0),
        sweep(&["cubic-stiffness=-3e12"], down, 9.0),
    );
    let found = compare(&spectra(&a, 1), &spectra(&b, 2)).unwrap();
    println!("forward and backward: {found:?}");
    assert!(!found.same);
}

#[test]
fn cross_receptances_of_symmetric_matrices_are_reciprocal() {
    use crate::nonlinear::reciprocity::compare;
    let record = |asymmetry: f64, seed: u64| -> Vec<Dwell> {
        let mut structure = case("kuka-kr90-half").structure.unwrap();
        if let Form::Matrices(m) = &mut structure.form {
            for matrix in [&mut m.mass, &mut m.damping, &mut m.stiffness] {
                *matrix = 0.5 * (matrix.clone() + matrix.transpose());
            }
            m.stiffness[(0, 1)] += 4e4 + asymmetry;
            m.stiffness[(1, 0)] += 4e4 - asymmetry;
        }
        let frequencies: Vec<f64> = (0..6).map(|k| 16.6 + 0.4 * f64::from(k)).collect();
        let mut dwells = Vec::new();
        for (index, direction) in [Direction::X, Direction::Y].into_iter().enumerate() {
            let rig = Rig {
                measured: vec![Quantity::Displacement],
                ..Rig::new(
                    direction,
                    Signal::step_sine(&frequencies, &[5.0], 24.0, 1.0),
                    256.0,
                )
            };
            let mut recording = rig.record(&structure, Path::new("a.csv")).unwrap().0;
            let noise = Noise {
                relative: 0.01,
                ..Noise::default()
            };
            noise.add(&mut recording, 2 * seed + index as u64);
            dwells.extend(dwell_segments(&recording).into_iter().filter_map(|mut stretch| {
                stretch.from = stretch.to.saturating_sub(1024);
                Dwell::fit(&recording, stretch, 3)
            }));
        }
        dwells
    };
    let directions = [Direction::X, Direction::Y];
    for seed in 0..10 {
        let found = compare(&record(0.0, seed), directions).unwrap();
        assert!(found.reciprocal, "{seed}: {found:?}");
    }
    let found = compare(&record(1e4, 1), directions).unwrap();
    println!("{found:?}");
    assert!(!found.reciprocal);
}
