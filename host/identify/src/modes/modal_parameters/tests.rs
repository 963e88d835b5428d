use std::path::Path;

use num_complex::Complex64;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

use super::*;
use crate::modes::{Options, Receptances, identify};
use quietcut_frf::{Frf, FrfTable};

/// Stiffness, mass and damping of the oscillators in x and y.
const OSCILLATORS: [(f64, f64, f64); 2] = [(2e7, 2.0, 120.0), (5e7, 3.0, 300.0)];

/// Model of two oscillators in x and y, turned by 20°, from receptances with noise of 1 % of their RMS.
fn model(seed: u64) -> ModalModel {
    let (sin, cos) = 20.0_f64.to_radians().sin_cos();
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let frequency_hz: Vec<f64> = (0..500).map(|line| 300.0 + f64::from(line)).collect();
    let axes = [Direction::X, Direction::Y];
    let shapes = [[cos, sin], [-sin, cos]];
    let (mut entries, mut deviation) = (Vec::new(), Vec::new());
    for (p, response) in axes.into_iter().enumerate() {
        for (q, force) in axes.into_iter().enumerate() {
            let exact: Vec<Complex64> = frequency_hz
                .iter()
                .map(|hertz| {
                    let omega = TAU * hertz;
                    let one =
                        |(k, m, c): (f64, f64, f64)| Complex64::new(k - m * omega * omega, c * omega).inv();
                    let part = |mode: usize| one(OSCILLATORS[mode]) * shapes[mode][p] * shapes[mode][q];
                    part(0) + part(1)
                })
                .collect();
            let power = exact.iter().map(|h| h.norm_sqr()).sum::<f64>() / exact.len() as f64;
            let noise = 0.01 * power.sqrt();
            let mut normal = || -> f64 { StandardNormal.sample(&mut random) };
            let receptance = exact
                .iter()
                .map(|h| h + noise * Complex64::new(normal(), normal()));
            entries.push(Frf {
                response,
                force,
                receptance: receptance.collect(),
                coherence: None,
                folding: None,
            });
            deviation.push(vec![noise; exact.len()]);
        }
    }
    let table = FrfTable::new(Path::new("frf.csv"), frequency_hz, entries).unwrap();
    let data = Receptances::new(&table, Some(&deviation), None).unwrap();
    identify(&data, &Options::default()).unwrap()
}

#[test]
fn modal_mass_damping_and_stiffness_are_those_of_the_oscillators_within_their_intervals() {
    const SEEDS: u64 = 100;
    let (mut held, mut all) = (0, 0);
    for seed in 0..SEEDS {
        let model = model(seed);
        assert_eq!(model.modes.len(), 2, "seed {seed}");
        for (index, (k, m, c)) in OSCILLATORS.into_iter().enumerate() {
            let found = model.modal_parameters(index).unwrap();
            assert_eq!(found.direction, [Direction::X, Direction::Y][index]);
            assert!(found.phase_rad.abs() < 0.02, "seed {seed}: {found:?}");
            // At the drive point the shape is cos 20°: 1/cos² = 1.132 times the mass of the oscillator.
            let factor = 1.0 / 20.0_f64.to_radians().cos().powi(2);
            for ([value, std], truth) in [
                (found.stiffness_n_per_m, factor * k),
                (found.mass_kg, factor * m),
                (found.damping_ns_per_m, factor * c),
            ] {
                all += 1;
                held += usize::from((value - truth).abs() < 1.645 * std);
                assert!((value / truth - 1.0).abs() < 0.02, "seed {seed}: {value} {truth}");
            }
        }
    }
    // Mass, stiffness and damping of a mode share their errors: two modes of a hundred tests are the independent draws.
    let share = held as f64 / all as f64;
    println!("{held} of {all}, seeds 0 to {SEEDS}");
    quietcut_testkit::rates::assert_pooled_share("90 % intervals of modal parameters", 0.9, share, 200);
}

#[test]
fn shapes_at_right_angles_have_no_assurance() {
    let mac = model(1).modal_assurance().unwrap();
    assert!((mac[(0, 0)] - 1.0).abs() < 1e-12 && (mac[(1, 1)] - 1.0).abs() < 1e-12);
    // Noise of 1 % at some twenty lines turns a shape by less than 1 %, and the assurance is the square.
    assert!(mac[(0, 1)] < 1e-4, "{mac}");
}
