//! Taps with one sensor that moves with the hammer: h_xx and h_yy alone, and the limits of the two uncoupled directions.

use std::f64::consts::{FRAC_1_SQRT_2, TAU};
use std::path::Path;

use num_complex::Complex64;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

use crate::case_file::text_of_modes;
use crate::modes::{self, ModalModel, Receptances};
use quietcut_frf::{Frf, FrfTable};
use quietcut_model::case::Case;
use quietcut_model::structure::Direction;
use quietcut_stability::{CubicTerms, FrequencyProblem, Method, Zoa};

const SEED: u64 = 25;
const CUT: &str = "[tool]\nteeth = 2\nedge_angle_deg = 90.0\n[material]\nktc_mpa = 700.0\nkrc_mpa = 210.0\nkac_mpa = 0.0\n\
    [cut]\nstart_deg = 90.0\nexit_deg = 180.0\nfeed_per_tooth_mm = 0.1\n";

/// Case of real modes: natural frequency in Hz, and direction of unit length; 1 % damping, stiffness 1e7 N/m.
fn case(modes: &[(f64, [f64; 2])]) -> Case {
    let mut text = String::from("[structure]\nkind = \"modes\"\ndirections = [\"x\", \"y\"]\n");
    for (hertz, direction) in modes {
        let omega = TAU * hertz;
        let damped = omega * (1.0 - 1e-4_f64).sqrt();
        let factor = (2.0 * Complex64::i() * damped * 1e7 / (omega * omega))
            .inv()
            .sqrt();
        let shape: Vec<[f64; 2]> = direction
            .iter()
            .map(|part| factor * *part)
            .map(|z| [z.re, z.im])
            .collect();
        text += &format!(
            "[[structure.mode]]\nfrequency_hz = {hertz}\ndamping_ratio = 0.01\nleft = {shape:?}\nright = {shape:?}\n"
        );
    }
    Case::parse(Path::new("truth.toml"), &(text + CUT)).unwrap()
}

/// Modes from h_xx and h_yy of a case, with noise of 0.1 % of the RMS.
fn identified(truth: &Case) -> ModalModel {
    let structure = truth.structure.as_ref().unwrap().first_order().unwrap();
    let mut random = ChaCha8Rng::seed_from_u64(SEED);
    let frequency_hz: Vec<f64> = (0..700).map(|line| 250.0 + f64::from(line)).collect();
    let (mut entries, mut deviation) = (Vec::new(), Vec::new());
    for (axis, direction) in [Direction::X, Direction::Y].into_iter().enumerate() {
        let clean = frequency_hz
            .iter()
            .map(|hertz| structure.receptance(TAU * hertz).unwrap()[(axis, axis)]);
        let clean: Vec<Complex64> = clean.collect();
        let size = (clean.iter().map(|h| h.norm_sqr()).sum::<f64>() / clean.len() as f64).sqrt();
        let mut normal = || -> f64 {
            let unit: f64 = StandardNormal.sample(&mut random);
            1e-3 * size * unit
        };
        deviation.push(vec![1e-3 * size; frequency_hz.len()]);
        entries.push(Frf {
            response: direction,
            force: direction,
            receptance: clean
                .iter()
                .map(|h| h + Complex64::new(normal(), normal()))
                .collect(),
            coherence: None,
            folding: None,
        });
    }
    let table = FrfTable::new(Path::new("frf.csv"), frequency_hz, entries).unwrap();
    let data = Receptances::new(&table, Some(&deviation), None).unwrap();
    modes::identify(&data, &modes::Options::default()).unwrap()
}

fn written(model: &ModalModel) -> Case {
    let text = text_of_modes("found", model).unwrap() + CUT;
    Case::parse(Path::new("found.toml"), &text).unwrap_or_else(|error| panic!("{error}\n{text}"))
}

/// Lowest limit from 5000 to 15000 rev/min, mm, by the zeroth-order approximation.
fn lowest_mm(case: &Case) -> f64 {
    let problem = FrequencyProblem::new(case, CubicTerms::Refuse).unwrap();
    let method = Zoa { problem };
    let limits = (0..400).filter_map(|step| {
        let line = method.line(5000.0 + 25.0 * f64::from(step), 200.0, 400).unwrap();
        line.first_limit.map(|limit| limit.depth_mm)
    });
    limits.fold(f64::INFINITY, f64::min)
}

#[test]
fn two_uncoupled_directions_need_no_cross_receptances() {
    let truth = case(&[(420.0, [1.0, 0.0]), (560.0, [0.0, 1.0]), (700.0, [1.0, 0.0])]);
    let model = identified(&truth);
    assert_eq!(model.directions(), [Direction::X, Direction::Y]);
    let not_measured = [(Direction::X, Direction::Y), (Direction::Y, Direction::X)];
    assert_eq!(model.not_measured(), not_measured);
    assert_eq!(model.modes.len(), 3, "{:?}", model.modes);
    for (found, (hertz, axis)) in model.modes.iter().zip([(420.0, 0), (560.0, 1), (700.0, 0)]) {
        // Four standard deviations: one of 10 000 modes lies outside.
        assert!((found.mode.frequency_hz - hertz).abs() < 4.0 * found.frequency_std_hz);
        assert!((found.mode.damping_ratio - 0.01).abs() < 4.0 * found.damping_ratio_std);
        assert_eq!(found.mode.right[1 - axis], Complex64::ZERO);
        assert_eq!(found.mode.left[1 - axis], Complex64::ZERO);
    }
    let (case, coupled) = (
        written(&model),
        model.receptance(Direction::X, Direction::Y, 420.0),
    );
    assert!(coupled.is_none_or(|h| h.norm() == 0.0));
    // Six parameters of each mode: frequency, damping ratio, and the shapes in one direction.
    assert_eq!(case.covariance.as_ref().unwrap().parameters.len(), 3 * 6);
    let (found_mm, truth_mm) = (lowest_mm(&case), lowest_mm(&truth));
    println!("seed {SEED}: {found_mm} mm, truth {truth_mm} mm");
    // Noise of 0.1 % at some twenty lines within the width of a mode leaves less than 0.1 % in the limit.
    assert!((found_mm / truth_mm - 1.0).abs() < 2e-3);
}

/// A mode at 45° to x appears in h_xx and in h_yy. Taken as uncoupled it gives limits that are wrong by the stated factor.
#[test]
fn the_stated_effect_of_cross_receptances_is_that_of_a_mode_at_45_degrees() {
    let ratios: Vec<f64> = [1.0, -1.0]
        .into_iter()
        .map(|sign| {
            let truth = case(&[(500.0, [FRAC_1_SQRT_2, sign * FRAC_1_SQRT_2])]);
            lowest_mm(&truth) / lowest_mm(&written(&identified(&truth)))
        })
        .collect();
    let truth = case(&[(500.0, [FRAC_1_SQRT_2, FRAC_1_SQRT_2])]);
    let case = written(&identified(&truth));
    let assumptions = case.assumptions();
    let sentence = assumptions
        .iter()
        .find(|text| text.starts_with("hxy, hyx"))
        .unwrap();
    println!("{ratios:?}: {sentence}");
    let number = |text: &str| text.trim().split(' ').next().unwrap().parse::<f64>().unwrap();
    let range = sentence.split("could be ").nth(1).unwrap();
    let (least, most) = (number(range), number(range.split(" to ").nth(1).unwrap()));
    for (stated, ratio) in [
        (least, ratios[0].min(ratios[1])),
        (most, ratios[0].max(ratios[1])),
    ] {
        // The sentence has two decimals; the circle of the receptance is that of a lightly damped mode, to ζ = 1 %.
        assert!((ratio / stated - 1.0).abs() < 0.02, "{ratio} {stated}");
    }
}
