//! Modes from receptances of known structures.

use std::f64::consts::TAU;
use std::path::Path;

use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

use super::*;
use quietcut_frf::{Frf, FrfTable};
use quietcut_model::case::{Case, Parameter};
use quietcut_model::structure::{Direction, Form, Mode, Structure};
use quietcut_testkit::case;

const AXES: [Direction; 3] = [Direction::X, Direction::Y, Direction::Z];

/// Receptances of a structure at `frequency_hz`, with noise whose RMS is the fraction `noise` of the RMS of each receptance.
fn table(
    structure: &Structure,
    frequency_hz: &[f64],
    forces: &[Direction],
    noise: f64,
    seed: u64,
) -> (FrfTable, Vec<Vec<f64>>) {
    let first_order = structure.first_order().unwrap();
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let mut entries = Vec::new();
    let mut deviation = Vec::new();
    for response in AXES
        .into_iter()
        .filter(|axis| structure.directions.contains(axis))
    {
        for &force in forces {
            let (p, q) = (response.axis().unwrap(), force.axis().unwrap());
            let clean: Vec<Complex64> = frequency_hz
                .iter()
                .map(|hertz| first_order.receptance(TAU * hertz).unwrap()[(p, q)])
                .collect();
            let size = (clean.iter().map(|h| h.norm_sqr()).sum::<f64>() / clean.len() as f64).sqrt();
            let mut normal = || -> f64 { StandardNormal.sample(&mut random) };
            let receptance = clean
                .iter()
                .map(|h| h + noise * size * Complex64::new(normal(), normal()))
                .collect();
            deviation.push(vec![noise * size; frequency_hz.len()]);
            entries.push(Frf {
                response,
                force,
                receptance,
                coherence: None,
                folding: None,
            });
        }
    }
    (
        FrfTable::new(Path::new("a.csv"), frequency_hz.to_vec(), entries).unwrap(),
        deviation,
    )
}

fn grid(first: f64, last: f64, count: usize) -> Vec<f64> {
    (0..count)
        .map(|k| first + (last - first) * k as f64 / (count - 1) as f64)
        .collect()
}

fn modes_of(structure: &Structure) -> Vec<Mode> {
    let Form::Modes(modes) = &structure.form else {
        panic!("no modes")
    };
    modes.clone()
}

/// The shapes of a mode with the scale and phase that identification gives them.
fn normalized(mode: &Mode) -> (Vec<Complex64>, Vec<Complex64>) {
    let (mut right, mut left) = (mode.right.clone(), mode.left.clone());
    let shared: Vec<(usize, usize)> = (0..right.len()).map(|i| (i, i)).collect();
    shape::normalize(&mut right, &mut left, &shared);
    (right, left)
}

#[test]
fn the_modes_of_table_7_1_are_identified_from_their_receptances() {
    let structure = case("kuka-kr90-acetal").structure.unwrap();
    let (table, _) = table(&structure, &grid(10.0, 28.0, 181), &AXES, 0.0, 1);
    let data = Receptances::new(&table, None, None).unwrap();
    let found = identify(&data, &Options::default()).unwrap();
    let truth = modes_of(&structure);
    assert_eq!(found.modes.len(), truth.len(), "{:?}", found.rejected);
    for (mode, truth) in found.modes.iter().zip(&truth) {
        // The error is rounding and the termination of the iteration.
        assert!((mode.mode.frequency_hz / truth.frequency_hz - 1.0).abs() < 1e-6);
        assert!((mode.mode.damping_ratio / truth.damping_ratio - 1.0).abs() < 1e-5);
        let (right, left) = normalized(truth);
        for (a, b) in mode
            .mode
            .right
            .iter()
            .zip(&right)
            .chain(mode.mode.left.iter().zip(&left))
        {
            assert!((a - b).norm() < 1e-4 * right[1].norm(), "{a} {b}");
        }
    }
    assert!(found.fit_error < 1e-5, "{}", found.fit_error);
}

#[test]
fn intervals_cover_the_truth_as_often_as_they_say() {
    let structure = case("kuka-kr90-acetal").structure.unwrap();
    let truth = modes_of(&structure);
    let (mut covered, mut all, mut missed) = (0, 0, 0);
    const SEEDS: u64 = 60;
    for seed in 0..SEEDS {
        let (table, deviation) = table(&structure, &grid(10.0, 28.0, 145), &AXES, 0.03, seed);
        // Every second seed leaves the standard deviations of the receptances unstated.
        let stated = (seed % 2 == 0).then_some(deviation.as_slice());
        let data = Receptances::new(&table, stated, None).unwrap();
        let found = identify(&data, &Options::default()).unwrap();
        if found.modes.len() != truth.len() {
            missed += 1;
            continue;
        }
        for (mode, truth) in found.modes.iter().zip(&truth) {
            let (right, left) = normalized(truth);
            let mut count = |value: f64, truth: f64, deviation: f64| {
                all += 1;
                covered += usize::from((value - truth).abs() < 1.644_85 * deviation);
            };
            count(mode.mode.frequency_hz, truth.frequency_hz, mode.frequency_std_hz);
            count(
                mode.mode.damping_ratio,
                truth.damping_ratio,
                mode.damping_ratio_std,
            );
            let shapes = [
                (&mode.mode.right, &right, &mode.right_std),
                (&mode.mode.left, &left, &mode.left_std),
            ];
            for (values, truth, deviations) in shapes {
                for ((value, truth), [re, im]) in values.iter().zip(truth).zip(deviations) {
                    count(value.re, truth.re, *re);
                    count(value.im, truth.im, *im);
                }
            }
        }
        if let Some(misfit) = found.misfit {
            // χ² per degree of freedom from 2 × 9 × 145 values has a standard deviation of 3 %.
            assert!((misfit - 1.0).abs() < 0.12, "seed {seed}: {misfit}");
        }
    }
    let share = f64::from(covered as u32) / f64::from(all as u32);
    // The 28 numbers of a seed are correlated: if they were one number, the share of 60 seeds would scatter by 0.04.
    assert!(
        missed <= 1 && (0.85..0.95).contains(&share),
        "{share} of {all}, {missed} missed"
    );
}

/// The residue of a mode follows from entries of two shapes whose errors depend on each other: the interval of the residue
/// needs their covariance.
#[test]
fn a_written_case_states_the_covariance_from_which_residues_follow() {
    let structure = case("kuka-kr90-acetal").structure.unwrap();
    let truth = modes_of(&structure);
    let seeds = 200;
    let (mut covered, mut independent, mut all) = (0, 0, 0);
    for seed in 0..seeds {
        let (table, deviation) = table(&structure, &grid(10.0, 28.0, 145), &AXES, 0.03, 1000 + seed);
        let data = Receptances::new(&table, Some(&deviation), None).unwrap();
        let found = identify(&data, &Options::default()).unwrap();
        if found.modes.len() != truth.len() {
            continue;
        }
        let text = crate::case_file::text_of_modes("found", &found).unwrap();
        let written = Case::parse(Path::new("found.toml"), &text).unwrap();
        assert!(written.deviations.is_empty());
        let known = written.covariance.as_ref().unwrap();
        assert_eq!(known.parameters.len(), 2 * (2 + 4 * 3));
        let std = |parameter: Parameter| {
            let at = known.parameters.iter().position(|known| *known == parameter);
            known.covariance[(at.unwrap(), at.unwrap())].sqrt()
        };
        for (index, mode) in found.modes.iter().enumerate() {
            for (parameter, stated) in [
                (Parameter::Frequency(index), mode.frequency_std_hz),
                (Parameter::DampingRatio(index), mode.damping_ratio_std),
                (Parameter::Left(index, 2, true), mode.left_std[2][1]),
                (Parameter::Right(index, 1, false), mode.right_std[1][0]),
            ] {
                assert!((std(parameter) / stated - 1.0).abs() < 1e-9, "{parameter:?}");
            }
        }
        // The real part of the residue of y by y of the first mode, and its gradient.
        let residue = |mode: &Mode| mode.right[1] * mode.left[1];
        let (r, l) = (found.modes[0].mode.right[1], found.modes[0].mode.left[1]);
        let gradient = [
            (Parameter::Right(0, 1, false), l.re),
            (Parameter::Right(0, 1, true), -l.im),
            (Parameter::Left(0, 1, false), r.re),
            (Parameter::Left(0, 1, true), -r.im),
        ];
        let (mut variance, mut without) = (0.0, 0.0);
        for (a, by_a) in gradient {
            for (b, by_b) in gradient {
                let place = |parameter| known.parameters.iter().position(|known| *known == parameter);
                let entry = known.covariance[(place(a).unwrap(), place(b).unwrap())] * by_a * by_b;
                variance += entry;
                without += if a == b { entry } else { 0.0 };
            }
        }
        let error = (residue(&found.modes[0].mode) - residue(&truth[0])).re.abs();
        all += 1;
        covered += usize::from(error < 1.644_85 * f64::sqrt(variance));
        independent += usize::from(error < 1.644_85 * f64::sqrt(without));
    }
    println!(
        "seeds 1000 to {}: {covered} of {all}; as if independent {independent}",
        999 + seeds
    );
    assert!(all > 190);
    quietcut_testkit::rates::assert_share("intervals of a residue", 0.9, covered, all);
    assert!(independent < covered);
}

fn mode(hertz: f64, damping: f64, right: [[f64; 2]; 3], left: [[f64; 2]; 3]) -> Mode {
    let shape = |entries: [[f64; 2]; 3]| {
        entries
            .map(|[re, im]| Complex64::new(1e-3 * re, 1e-3 * im))
            .to_vec()
    };
    Mode {
        frequency_hz: hertz,
        damping_ratio: damping,
        right: shape(right),
        left: shape(left),
    }
}

fn structure(modes: Vec<Mode>) -> Structure {
    Structure {
        directions: AXES.to_vec(),
        form: Form::Modes(modes),
    }
}

#[test]
fn close_modes_are_separated_and_modes_outside_the_band_are_residuals() {
    // Two close modes a third of a half-power bandwidth apart with different shapes, one mode far below and one far above.
    let close = [
        mode(
            17.2,
            0.02,
            [[3.0, -3.0], [1.0, 0.5], [0.4, 0.1]],
            [[2.5, -2.0], [1.5, 0.0], [0.2, 0.3]],
        ),
        mode(
            17.45,
            0.025,
            [[0.5, 0.2], [4.0, -4.5], [1.0, -0.5]],
            [[-0.3, 0.5], [3.5, -4.0], [0.6, -1.0]],
        ),
    ];
    let mut all = close.to_vec();
    all.push(mode(4.0, 0.03, [[2.0, -2.0]; 3], [[2.0, -2.0]; 3]));
    all.push(mode(70.0, 0.03, [[9.0, -9.0]; 3], [[9.0, -9.0]; 3]));
    for seed in 0..10 {
        let (table, deviation) = table(
            &structure(all.clone()),
            &grid(12.0, 24.0, 241),
            &AXES,
            0.005,
            seed,
        );
        let data = Receptances::new(&table, Some(&deviation), None).unwrap();
        let found = identify(&data, &Options::default()).unwrap();
        assert_eq!(found.modes.len(), 2, "seed {seed}: {:?}", found.modes);
        for (found, truth) in found.modes.iter().zip(&close) {
            let off = (found.mode.frequency_hz - truth.frequency_hz).abs();
            // Five standard deviations, plus the error of two real constants for the modes outside the band.
            assert!(
                off < 5.0 * found.frequency_std_hz + 1e-3,
                "seed {seed}: {off} {found:?}"
            );
            let off = (found.mode.damping_ratio - truth.damping_ratio).abs();
            assert!(
                off < 5.0 * found.damping_ratio_std + 1e-4,
                "seed {seed}: {off} {found:?}"
            );
        }
    }
}

#[test]
fn noise_is_rejected_as_a_mode_with_a_reason() {
    let lone = [mode(17.0, 0.03, [[3.0, -3.0]; 3], [[3.0, -3.0]; 3])];
    for seed in 0..20 {
        let (table, deviation) = table(
            &structure(lone.to_vec()),
            &grid(10.0, 26.0, 161),
            &AXES,
            0.1,
            seed,
        );
        let data = Receptances::new(&table, Some(&deviation), None).unwrap();
        let found = identify(&data, &Options::default()).unwrap();
        assert_eq!(found.modes.len(), 1, "seed {seed}: {:?}", found.modes);
        assert!(
            found
                .rejected
                .iter()
                .any(|pole| pole.why.contains("negative damping")),
            "seed {seed}"
        );
        let said = found.rejected.iter().all(|pole| !pole.why.is_empty());
        assert!(
            said && found.rejected.len() > 3,
            "seed {seed}: {:?}",
            found.rejected
        );
    }
}

#[test]
fn one_force_gives_right_shapes_and_its_entry_of_the_left_ones() {
    let structure = case("kuka-kr90-acetal").structure.unwrap();
    let (table, _) = table(&structure, &grid(10.0, 28.0, 181), &[Direction::Y], 0.0, 1);
    let data = Receptances::new(&table, None, Some([11.0, 27.0])).unwrap();
    let found = identify(&data, &Options::default()).unwrap();
    assert_eq!(found.directions(), [Direction::Y]);
    for (mode, truth) in found.modes.iter().zip(modes_of(&structure)) {
        assert!((mode.mode.frequency_hz / truth.frequency_hz - 1.0).abs() < 1e-5);
        let residue = mode.mode.right[2] * mode.mode.left[0];
        let expected = truth.right[2] * truth.left[1];
        assert!(
            (residue - expected).norm() < 1e-3 * expected.norm(),
            "{residue} {expected}"
        );
        assert!((mode.mode.right[1].norm() / mode.mode.left[0].norm() - 1.0).abs() < 1e-9);
    }
}

#[test]
fn data_without_a_mode_are_refused() {
    let structure = case("kuka-kr90-acetal").structure.unwrap();
    let (whole, _) = table(&structure, &grid(10.0, 28.0, 181), &AXES, 0.0, 1);
    let refused = |table: &FrfTable, band, options: &Options| {
        Receptances::new(table, None, band)
            .and_then(|data| identify(&data, options))
            .unwrap_err()
            .to_string()
    };
    let said = refused(&whole, Some([17.0, 17.5]), &Options::default());
    assert!(said.contains("6 frequencies lie in the band"), "{said}");
    let wanted = Options {
        modes: Some(9),
        ..Options::default()
    };
    let said = refused(&whole, None, &wanted);
    assert!(said.contains("9 modes are requested"), "{said}");
    let mut entries = whole.entries().to_vec();
    entries.remove(4);
    let holed = FrfTable::new(Path::new("a.csv"), whole.frequency_hz().to_vec(), entries).unwrap();
    let said = refused(&holed, None, &Options::default());
    assert!(said.contains("hyy is missing"), "{said}");
    // Far from any resonance the receptance is a constant with noise.
    let (far, _) = table(&structure, &grid(200.0, 220.0, 101), &AXES, 0.3, 3);
    let said = refused(&far, None, &Options::default());
    assert!(said.contains("no pole is stable"), "{said}");
}

/// Modes of x and y of a nearly round machine are one pole of a common denominator, whose residue matrix has rank two.
#[test]
fn modes_of_two_directions_closer_than_their_width_are_two() {
    let real_mode = |hertz: f64, angle_deg: f64| {
        let omega = TAU * hertz;
        let damped = omega * (1.0 - 4e-4_f64).sqrt();
        let factor = (2.0 * Complex64::i() * damped * 1e7 / (omega * omega))
            .inv()
            .sqrt();
        let (sin, cos) = angle_deg.to_radians().sin_cos();
        let shape = vec![factor * cos, factor * sin];
        Mode {
            frequency_hz: hertz,
            damping_ratio: 0.02,
            left: shape.clone(),
            right: shape,
        }
    };
    let (mut covered, mut all, mut missed) = (0, 0, 0);
    const SEEDS: u64 = 40;
    for seed in 0..SEEDS {
        // Distances of the poles of 0.05 to 0.5 of their half-power width, 18 Hz.
        let apart = 0.9 + 8.1 * seed as f64 / (SEEDS - 1) as f64;
        let truth = [
            real_mode(450.0, 5.0),
            real_mode(450.0 + apart, 97.0),
            real_mode(800.0, -10.0),
        ];
        let structure = Structure {
            directions: vec![Direction::X, Direction::Y],
            form: Form::Modes(truth.to_vec()),
        };
        let forces = [Direction::X, Direction::Y];
        let (table, deviation) = table(&structure, &grid(300.0, 950.0, 326), &forces, 0.01, seed);
        let data = Receptances::new(&table, Some(&deviation), None).unwrap();
        let found = identify(&data, &Options::default()).unwrap();
        if found.modes.len() != truth.len() {
            missed += 1;
            println!(
                "seed {seed}: {} modes, χ² per degree of freedom {:?}",
                found.modes.len(),
                found.misfit
            );
            continue;
        }
        // Of poles that are equal to the noise shapes are not determined one by one; their receptance is.
        for hertz in [430.0, 450.0, 470.0, 800.0] {
            let exact = structure.first_order().unwrap().receptance(TAU * hertz).unwrap();
            for (p, response) in forces.into_iter().enumerate() {
                let fitted = found.receptance(response, response, hertz).unwrap();
                // Noise of 1 % of the RMS at some nine lines within the width, and four standard deviations.
                let error = (fitted - exact[(p, p)]).norm() / exact[(p, p)].norm();
                assert!(error < 0.02, "seed {seed}, {response} at {hertz} Hz: {error}");
            }
        }
        if apart > 2.0 {
            for (mode, truth) in found.modes.iter().zip(&truth) {
                all += 1;
                let off = (mode.mode.frequency_hz - truth.frequency_hz).abs();
                covered += usize::from(off < 1.645 * mode.frequency_std_hz);
            }
        }
    }
    println!("{covered} of {all} frequencies, seeds 0 to {SEEDS}");
    assert_eq!(missed, 0, "of {SEEDS}");
    quietcut_testkit::rates::assert_share("90 % intervals of frequencies of close modes", 0.9, covered, all);
}
