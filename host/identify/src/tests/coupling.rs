//! Two close modes, 9 Hz in y and 10.5 Hz in z, coupled by a nonlinear potential.

use std::path::Path;

use rayon::prelude::*;

use crate::dwells::dwell::{Dwell, dwell_segments, pool_variances};
use crate::nonlinear::harmonic_balance::Grid;
use crate::nonlinear::law::{Law, NonlinearTerm, Role};
use crate::nonlinear::steady_fit::Data;
use quietcut_model::case::Case;
use quietcut_model::structure::{Direction, Structure};
use quietcut_recording::{Quantity, Recording};
use quietcut_simulate::Effects;
use quietcut_simulate::rig::{Noise, Rig, Signal};

const DIRECTIONS: [Direction; 2] = [Direction::Y, Direction::Z];

/// The modes of thesis chapter 5 at 9 and 10.5 Hz on one machine, with a weak linear coupling.
fn structure() -> Structure {
    let text = r#"
        [structure]
        kind = "matrices"
        directions = ["y", "z"]
        mass = [[268.0, 6.0], [6.0, 243.0]]
        damping = [[580.0, 20.0], [20.0, 420.0]]
        stiffness = [[816000.0, 15000.0], [15000.0, 1080000.0]]
        cubic_damping = [[6.06e6, 0.0], [0.0, 3.33e6]]
        cubic_stiffness = [[-3.23e12, 0.0], [0.0, -2.71e12]]
    "#;
    Case::parse(Path::new("close.toml"), text)
        .unwrap()
        .structure
        .unwrap()
}

const COUPLING: [&str; 3] = [
    "mode-coupling=-5e12",
    "mode-coupling.kxxy_n_per_m2=1.5e8",
    "mode-coupling.directions=y,z",
];

fn step_sine(direction: Direction, level: f64) -> Recording {
    let frequencies: Vec<f64> = (0..17).map(|k| 8.0 + 0.2 * f64::from(k)).collect();
    let rig = Rig {
        effects: Effects::parse(COUPLING).unwrap(),
        measured: vec![Quantity::Displacement],
        ..Rig::new(
            direction,
            Signal::step_sine(&frequencies, &[level], 22.0, 1.0),
            128.0,
        )
    };
    rig.record(&structure(), Path::new("a.csv")).unwrap().0
}

/// The last 5 s of every dwell; in the 17 s before them the slower mode decays to e⁻¹⁴.
fn dwells(recording: &Recording, noise: f64, seed: u64, harmonics: usize) -> Vec<Dwell> {
    let mut noisy = recording.clone();
    Noise {
        relative: noise,
        ..Noise::default()
    }
    .add(&mut noisy, seed);
    let mut dwells: Vec<Dwell> = dwell_segments(&noisy)
        .into_iter()
        .filter_map(|mut stretch| {
            stretch.from = stretch.to.saturating_sub(640);
            Dwell::fit(&noisy, stretch, harmonics)
        })
        .collect();
    assert_eq!(dwells.len(), 17);
    pool_variances(&mut dwells);
    dwells
}

fn data<'a>(law: &'a Law, dwells: &'a [Dwell], grid: &'a Grid) -> Data<'a> {
    Data {
        law,
        directions: &DIRECTIONS,
        dwells,
        grid,
    }
}

/// Largest |X/F| in the excited direction, measured and predicted.
fn peaks(data: &Data<'_>, theta: &nalgebra::DVector<f64>, direction: usize) -> [f64; 2] {
    let width = data.grid.width();
    let mut peaks = [0.0_f64; 2];
    for dwell in data.dwells {
        let force = dwell.force().unwrap().amplitude(1);
        let line = dwell
            .motions
            .iter()
            .find(|line| line.direction == DIRECTIONS[direction])
            .unwrap();
        peaks[0] = peaks[0].max(line.amplitude(1) / force);
        let x = data.predicted(dwell, theta).unwrap();
        let place = direction * width + 1;
        peaks[1] = peaks[1].max(x[place].hypot(x[place + 1]) / force);
    }
    peaks
}

#[test]
fn coupled_modes_predict_peaks_at_untested_forces() {
    let tests: Vec<(Direction, f64)> = DIRECTIONS
        .iter()
        .flat_map(|direction| [4.0, 7.5, 10.0, 13.0, 16.0].map(|level| (*direction, level)))
        .collect();
    let recordings: Vec<Recording> = tests
        .par_iter()
        .map(|(direction, level)| step_sine(*direction, *level))
        .collect();
    let coupled = Law::new(
        2,
        &[
            NonlinearTerm::CubicStiffness,
            NonlinearTerm::CubicDamping,
            NonlinearTerm::ModeCoupling,
        ],
    );
    let grid = Grid::new(5, coupled.degree());
    let held_out = |level: f64| level == 7.5 || level == 13.0;
    let mut seen = Vec::new();
    for (index, ((_, level), recording)) in tests.iter().zip(&recordings).enumerate() {
        if !held_out(*level) {
            seen.extend(dwells(recording, 0.01, index as u64, grid.harmonics()));
        }
    }
    let fitted = data(&coupled, &seen, &grid);
    let fit = fitted.fit(fitted.first_guess().unwrap()).unwrap();
    println!("misfit {:.3}", fit.misfit);
    for (role, truth) in [
        (Role::QuarticCoupling(0, 1), -5e12),
        (Role::CubicCoupling(0, 1), 1.5e8),
        (Role::CubicStiffness(0), -3.23e12),
        (Role::CubicStiffness(1), -2.71e12),
    ] {
        let index = coupled.index(role).unwrap();
        let (found, half) = (fit.theta[index], fit.half_width(index));
        println!(
            "{role:?}: {found:.4e} ± {half:.1e}, {:+.2} %",
            100.0 * (found / truth - 1.0)
        );
        assert!(
            (found - truth).abs() < (3.0 * half).max(0.02 * truth.abs()),
            "{role:?}: {found}"
        );
    }
    let apart = Law::new(2, &[NonlinearTerm::CubicStiffness, NonlinearTerm::CubicDamping]);
    let without = data(&apart, &seen, &grid);
    let other = without.fit(without.first_guess().unwrap());
    for ((direction, level), recording) in tests.iter().zip(&recordings).filter(|(test, _)| held_out(test.1))
    {
        let new = dwells(recording, 0.0, 0, grid.harmonics());
        let axis = usize::from(*direction == Direction::Z);
        let [measured, predicted] = peaks(&data(&coupled, &new, &grid), &fit.theta, axis);
        let uncoupled = other
            .as_ref()
            .map(|fit| peaks(&data(&apart, &new, &grid), &fit.theta, axis)[1] / measured - 1.0);
        println!(
            "{direction} at {level} N: peak {:.3} µm/N, predicted {:+.3} %, without coupling {:+.2?}",
            1e6 * measured,
            100.0 * (predicted / measured - 1.0),
            uncoupled
        );
        assert!((predicted / measured - 1.0).abs() < 0.03);
    }
}
