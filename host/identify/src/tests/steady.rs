//! Modes of thesis chapter 5 from virtual step-sine tests.

use std::collections::BTreeMap;
use std::path::Path;

use nalgebra::DVector;
use rayon::prelude::*;

use crate::dwells::dwell::{Dwell, DwellSegment, dwell_segments, pool_variances};
use crate::nonlinear::harmonic_balance::Grid;
use crate::nonlinear::law::{Law, NonlinearTerm, Role};
use crate::nonlinear::steady_fit::{Data, Fit};
use quietcut_model::structure::{Form, Structure};
use quietcut_recording::{Quantity, Recording};
use quietcut_simulate::rig::{Noise, Rig, Signal};
use quietcut_testkit::case;
use quietcut_testkit::rates::assert_share;

const EXTRAS: [NonlinearTerm; 2] = [NonlinearTerm::CubicStiffness, NonlinearTerm::CubicDamping];

/// Frequencies, within ±4 % of the natural frequency, and force levels of the test of a mode, as in the thesis.
pub(crate) fn test_plan(name: &str) -> (Vec<f64>, Vec<f64>) {
    let (first, last, levels) = match name {
        "kuka-kr90-y17-low" => (16.6, 17.9, vec![1.8, 5.8, 9.5]),
        "kuka-kr90-y17-high" => (16.6, 17.9, vec![12.6, 15.6, 17.2]),
        "kuka-kr90-x20" => (19.0, 21.0, vec![4.2, 9.8, 16.5]),
        "kuka-kr90-y9" => (8.0, 9.2, vec![4.2, 9.8, 16.5]),
        _ => (9.9, 11.0, vec![4.2, 9.8, 16.5]),
    };
    let count = 14;
    let frequencies = (0..count)
        .map(|k| first + (last - first) * f64::from(k) / f64::from(count - 1))
        .collect();
    (frequencies, levels)
}

/// Step-sine recordings without noise, one per force level.
pub(crate) fn step_sine(
    structure: &Structure,
    frequencies: &[f64],
    levels: &[f64],
    dwell_s: f64,
) -> Vec<Recording> {
    let direction = structure.directions[0];
    levels
        .par_iter()
        .map(|level| {
            let signal = Signal::step_sine(frequencies, &[*level], dwell_s, 1.0);
            let rig = Rig {
                measured: vec![Quantity::Displacement],
                ..Rig::new(direction, signal, 256.0)
            };
            rig.record(structure, Path::new("steps.csv")).unwrap().0
        })
        .collect()
}

pub(crate) fn truth(structure: &Structure, law: &Law) -> DVector<f64> {
    let Form::Matrices(m) = &structure.form else {
        panic!("matrices")
    };
    DVector::from_iterator(
        law.parameters.len(),
        law.parameters.iter().map(|parameter| match parameter.role {
            Role::Mass(i, j) => m.mass[(i, j)],
            Role::Damping(i, j) => m.damping[(i, j)],
            Role::Stiffness(i, j) => m.stiffness[(i, j)],
            Role::CubicStiffness(i) => m.cubic_stiffness.as_ref().unwrap()[(i, i)],
            Role::CubicDamping(i) => m.cubic_damping.as_ref().unwrap()[(i, i)],
            _ => 0.0,
        }),
    )
}

/// A recording of the last `samples` samples of every dwell in sequence, and the segments of the dwells in it.
fn last_of_each(recording: &Recording, dwells: usize, samples: usize) -> (Recording, Vec<DwellSegment>) {
    let found = dwell_segments(recording);
    assert_eq!(found.len(), dwells);
    let mut cut = recording.clone();
    for (channel, whole) in cut.channels.iter_mut().zip(&recording.channels) {
        channel.samples = found
            .iter()
            .flat_map(|stretch| whole.samples[stretch.to - samples..stretch.to].iter().copied())
            .collect();
    }
    let stretches = found
        .iter()
        .enumerate()
        .map(|(index, stretch)| DwellSegment {
            from: index * samples,
            to: (index + 1) * samples,
            ..*stretch
        })
        .collect();
    (cut, stretches)
}

struct Campaign {
    truth: DVector<f64>,
    fits: Vec<Fit>,
}

/// Fits of one mode with 1 % noise per time sample on force and motion, one for each seed.
fn campaign(name: &str, seeds: std::ops::Range<u64>) -> Campaign {
    let structure = case(name).structure.unwrap();
    let (frequencies, levels) = test_plan(name);
    let recordings = step_sine(&structure, &frequencies, &levels, 24.0);
    // The dwell of 4 s follows 20 s of settling: at decay rates above 0.8 /s the transient is far below 1 % noise.
    let plain: Vec<_> = recordings
        .iter()
        .map(|recording| last_of_each(recording, frequencies.len(), 1024))
        .collect();
    let law = Law::new(1, &EXTRAS);
    let grid = Grid::new(5, law.degree());
    let noise = Noise {
        relative: 0.01,
        ..Noise::default()
    };
    let fits = seeds
        .into_par_iter()
        .map(|seed| {
            let mut dwells = Vec::new();
            for (level, (recording, stretches)) in plain.iter().enumerate() {
                let mut noisy = recording.clone();
                noise.add(&mut noisy, seed * 16 + level as u64);
                let mut of_level: Vec<Dwell> = stretches
                    .iter()
                    .map(|stretch| Dwell::fit(&noisy, *stretch, grid.harmonics()).unwrap())
                    .collect();
                pool_variances(&mut of_level);
                dwells.extend(of_level);
            }
            let data = Data {
                law: &law,
                directions: &structure.directions,
                dwells: &dwells,
                grid: &grid,
            };
            let start = data.first_guess().unwrap();
            data.fit(start)
                .unwrap_or_else(|error| panic!("{name}, seed {seed}: {error}"))
        })
        .collect();
    Campaign {
        truth: truth(&structure, &law),
        fits,
    }
}

const MODES: [&str; 5] = [
    "kuka-kr90-x20",
    "kuka-kr90-y17-low",
    "kuka-kr90-y17-high",
    "kuka-kr90-y9",
    "kuka-kr90-z10",
];

/// Over all modes: worst relative error, share of intervals that contain the truth, and this share by parameter.
fn judge(seeds: std::ops::Range<u64>) -> (f64, f64, BTreeMap<String, f64>) {
    let count = (seeds.end - seeds.start) as f64;
    let law = Law::new(1, &EXTRAS);
    let (mut worst, mut pooled) = (0.0_f64, 0.0);
    let mut by_parameter = BTreeMap::new();
    for name in MODES {
        let Campaign { truth, fits } = campaign(name, seeds.clone());
        let misfit = fits.iter().map(|fit| fit.misfit).sum::<f64>() / count;
        for (p, parameter) in law.parameters.iter().enumerate() {
            let errors: Vec<f64> = fits.iter().map(|fit| fit.theta[p] - truth[p]).collect();
            let covered = fits
                .iter()
                .zip(&errors)
                .filter(|(fit, error)| error.abs() <= fit.half_width(p))
                .count() as f64;
            let largest = errors.iter().fold(0.0_f64, |a, e| a.max((e / truth[p]).abs()));
            let mean = errors.iter().sum::<f64>() / count / truth[p];
            println!(
                "{name} {}: covered {:.1} %, largest error {:.3} %, mean error {:.4} %, misfit {misfit:.3}",
                parameter.role.key(),
                100.0 * covered / count,
                100.0 * largest,
                100.0 * mean
            );
            worst = worst.max(largest);
            pooled += covered / count / (MODES.len() * law.parameters.len()) as f64;
            by_parameter.insert(format!("{name} {}", parameter.role.key()), covered / count);
        }
    }
    (worst, pooled, by_parameter)
}

/// Asserts for each parameter that its 90 % intervals contain the truth as often as they claim.
fn check_each(by_parameter: &BTreeMap<String, f64>, seeds: usize) {
    for (name, covered) in by_parameter {
        assert_share(name, 0.9, (covered * seeds as f64).round() as usize, seeds);
    }
}

/// Every parameter lies within 2 % of the truth, and its intervals have the stated coverage, with the force levels of the thesis
/// and 1 % noise per sample.
#[test]
fn modes_are_identified_within_two_percent() {
    let (worst, pooled, by_parameter) = judge(0..12);
    assert!(worst < 0.02, "{worst}");
    // 60 fits of 5 correlated parameters: the standard deviation of the share is about 3 %; three standard deviations are allowed.
    assert!((0.81..=0.97).contains(&pooled), "{pooled}");
    check_each(&by_parameter, 12);
}

/// Coverage of the intervals with 200 seeds, for each parameter: `cargo test --release -p quietcut-identify --lib intervals_cover
/// -- --ignored --nocapture`.
#[test]
#[ignore = "half a minute; the command is in its documentation"]
fn intervals_cover_the_truth_in_nine_of_ten_cases() {
    let (worst, pooled, by_parameter) = judge(0..200);
    println!(
        "pooled {:.2} %, worst error {:.3} %",
        100.0 * pooled,
        100.0 * worst
    );
    let percent = |share: f64| format!("{:.1} %", 100.0 * share);
    let mut figures = vec![
        (
            "90 % intervals that hold the truth, all together".to_owned(),
            percent(pooled),
        ),
        ("largest relative error of a parameter".to_owned(), percent(worst)),
    ];
    figures.extend(by_parameter.iter().map(|(name, covered)| {
        (
            format!("90 % intervals that hold the truth, {name}"),
            percent(*covered),
        )
    }));
    quietcut_testkit::results::Campaign {
        name: "periodic-fit",
        title: "One nonlinear mode from step-sine tests",
        command: "cargo test --release -p quietcut-identify --lib intervals_cover -- --ignored --nocapture",
        seeds: "0 to 199; noise with the standard deviation of 1 % of force and motion",
    }
    .record(&figures);
    assert!(worst < 0.02, "{worst}");
    assert!((0.88..=0.92).contains(&pooled), "{pooled}");
    check_each(&by_parameter, 200);
}
