//! Story: a model that is identified from higher-order FRFs has a large prediction error on its own data.
//!
//! One mode of a milling robot with cubic stiffness and damping is measured as in chapter 5 of the thesis: step-sine at three
//! force levels, without noise. Higher-order FRFs (eqs 5.15 to 5.17) give parameters with errors of up to a fifth and a model
//! with a large prediction error. Harmonic balance gives the true parameters. The reason: eq. 5.15 truncates the Volterra series
//! of the response after F⁵. At these levels the term in F³ is as large as the term in F near the resonance, or eleven times as
//! large, so that the series converges slowly or not at all. At small levels the truncated term F⁷ is attributed to H₃F³, and
//! the cubic terms have an error proportional to F⁴.
//!
//! To print the table: `cargo test --release -p quietcut-tests --test story_identification_bias -- --nocapture`
//! To see the table: `cargo test --release -p quietcut-tests --test story_identification_bias -- --nocapture`

#![allow(clippy::expect_used, clippy::panic)]

use std::f64::consts::TAU;
use std::path::Path;

use nalgebra::DVector;
use num_complex::Complex64;
use quietcut::case::Case;
use quietcut::identify::dwell::Dwell;
use quietcut::identify::harmonic_balance::{Grid, Problem};
use quietcut::identify::hfrf::{self, HfrfFit, Response};
use quietcut::identify::law::{Law, NonlinearTerm, Role};
use quietcut::identify::steady::{Settling, steady};
use quietcut::identify::steady_fit::{Data, Fit};
use quietcut::simulate::rig::{Rig, Signal};
use quietcut::structure::{Direction, Form, Matrices};
use quietcut_tests::command::cases;

/// The parameters of the model with their keys in the case file.
const ROLES: [(Role, &str); 5] = [
    (Role::Mass(0, 0), "m"),
    (Role::Damping(0, 0), "c"),
    (Role::Stiffness(0, 0), "k"),
    (Role::CubicDamping(0), "c3"),
    (Role::CubicStiffness(0), "k3"),
];

/// Number of harmonics that are fitted to each dwell.
const HARMONICS: usize = 5;

/// A test of the thesis: the case, its force levels in N, and the bias of c₃ and k₃ from eqs 5.15 to 5.17.
const SETS: [(&str, [f64; 3], [f64; 2]); 2] = [
    ("kuka-kr90-y17-low", [1.8, 5.8, 9.5], [-0.09, -0.21]),
    ("kuka-kr90-y17-high", [12.6, 15.6, 17.2], [-0.10, -0.19]),
];

fn law() -> Law {
    Law::new(1, &[NonlinearTerm::CubicStiffness, NonlinearTerm::CubicDamping])
}

fn matrices(case: &Case) -> &Matrices {
    match &case.structure().expect("a structure").form {
        Form::Matrices(matrices) => matrices,
        Form::Modes(_) | Form::Joints(_) => panic!("{}: matrices are needed", case.name),
    }
}

fn truth(case: &Case, role: Role) -> f64 {
    let found = matrices(case);
    let cubic = |matrix: &Option<nalgebra::DMatrix<f64>>| matrix.as_ref().expect("a cubic term")[(0, 0)];
    match role {
        Role::Mass(..) => found.mass[(0, 0)],
        Role::Damping(..) => found.damping[(0, 0)],
        Role::Stiffness(..) => found.stiffness[(0, 0)],
        Role::CubicDamping(_) => cubic(&found.cubic_damping),
        Role::CubicStiffness(_) => cubic(&found.cubic_stiffness),
        other => panic!("{other:?} is no parameter of this law"),
    }
}

/// Frequencies from 16.6 to 17.9 Hz in steps of 0.05 Hz, as in section 5.2.3 of the thesis.
fn frequencies_hz() -> Vec<f64> {
    (0..27).map(|step| 16.6 + 0.05 * f64::from(step)).collect()
}

/// The test of the thesis: the displacement at every frequency and level.
fn measured(case: &Case, levels_n: &[f64]) -> Vec<Dwell> {
    let frequencies_hz = frequencies_hz();
    let signal = Signal::step_sine(&frequencies_hz, levels_n, 36.0, 12.0);
    let rig = Rig::new(Direction::Y, signal, 128.0);
    let structure = case.structure().expect("a structure");
    let (mut recording, _) = rig.record(structure, Path::new("steps.csv")).expect("a record");
    recording.channels.retain(|channel| channel.name != "ay");
    let decay = 0.5 * truth(case, Role::Damping(0, 0)) / truth(case, Role::Mass(0, 0));
    let found = steady(&[recording], HARMONICS, Settling::Decay(decay));
    assert_eq!(found.dwells.len(), frequencies_hz.len() * levels_n.len());
    found.dwells
}

/// Estimates of both methods, from the same dwells.
struct Identified {
    responses: Vec<Response>,
    hfrf: HfrfFit,
    /// NRMSE of the model from higher-order FRFs on its own data.
    hfrf_error: f64,
    balance: Fit,
}

fn identified(dwells: &[Dwell]) -> Identified {
    let law = law();
    let grid = Grid::new(HARMONICS, law.degree());
    let data = Data {
        law: &law,
        directions: &[Direction::Y],
        dwells,
        grid: &grid,
    };
    let responses = hfrf::responses(dwells, 1e-3);
    let hfrf = hfrf::fit(&responses).expect("three levels");
    Identified {
        hfrf_error: data.relative_error(&hfrf.theta),
        balance: data.fit(data.first_guess().expect("a guess")).expect("a fit"),
        responses,
        hfrf,
    }
}

/// Relative error of an identified parameter.
fn bias(case: &Case, theta: &DVector<f64>, role: Role) -> f64 {
    let index = law().index(role).expect("the law has it");
    theta[index] / truth(case, role) - 1.0
}

/// H₁ and H₃(ω, ω, −ω) of the true parameters, from eqs 5.16 and 5.17 solved for the kernels.
fn true_kernels(case: &Case, omega: f64) -> [Complex64; 2] {
    let of = |role| truth(case, role);
    let dynamic = Complex64::new(
        of(Role::Stiffness(0, 0)) - of(Role::Mass(0, 0)) * omega * omega,
        of(Role::Damping(0, 0)) * omega,
    );
    let h1 = dynamic.inv();
    let cubic = Complex64::new(
        of(Role::CubicStiffness(0)),
        of(Role::CubicDamping(0)) * omega.powi(3),
    );
    [h1, -cubic * h1.powi(3) * h1.conj()]
}

/// Responses of the series of eq. 5.15 without terms beyond F⁵, with the true H₁ and H₃.
fn cut_series(case: &Case, identified: &Identified) -> Vec<Response> {
    let pairs = identified.responses.iter().zip(&identified.hfrf.estimates);
    pairs
        .map(|(response, estimate)| {
            let [h1, h3] = true_kernels(case, response.omega);
            let series = |force: f64| {
                h1 * force + h3 * (0.75 * force.powi(3)) + estimate.h[2] * (0.625 * force.powi(5))
            };
            let levels = response.levels.iter().map(|&(force, _)| (force, series(force)));
            Response {
                omega: response.omega,
                levels: levels.collect(),
            }
        })
        .collect()
}

fn case(name: &str) -> Case {
    Case::read(cases().join(format!("{name}.toml"))).expect("the case is there")
}

#[test]
fn higher_order_frf_mispredict_the_data_they_come_from() {
    println!(
        "{:<20} {:>9} {:>8} {:>8} {:>8} {:>8} {:>8} {:>13}",
        "", "levels", "m", "c", "k", "c3", "k3", "mispredicts"
    );
    for (name, levels, [of_c3, of_k3]) in SETS {
        let case = case(name);
        let found = identified(&measured(&case, &levels));
        let row = |what: &str, theta: &DVector<f64>, error: f64| {
            print!("{what:<20} {:>9}", format!("{:.1} N", levels[2]));
            for (role, _) in ROLES {
                print!(" {:>+7.2}%", 100.0 * bias(&case, theta, role));
            }
            println!(" {:>12.4}%", 100.0 * error);
        };
        println!("{name}");
        row("  higher-order FRF", &found.hfrf.theta, found.hfrf_error);
        row(
            "  harmonic balance",
            &found.balance.theta,
            found.balance.relative_error,
        );
        // The bias is stated to a percent. The records are finite and sampled, which changes the last digit.
        let (c3, k3) = (
            bias(&case, &found.hfrf.theta, Role::CubicDamping(0)),
            bias(&case, &found.hfrf.theta, Role::CubicStiffness(0)),
        );
        assert!(
            (c3 - of_c3).abs() < 0.01 && (k3 - of_k3).abs() < 0.01,
            "{name}: {c3} {k3}"
        );
        for (role, letter) in ROLES {
            let off = bias(&case, &found.balance.theta, role);
            assert!(
                off.abs() < 1e-4,
                "{name}: {letter} by harmonic balance is off by {off}"
            );
        }
        assert!(found.hfrf_error > 0.01 && found.hfrf_error > 1e3 * found.balance.relative_error);
        let largest = largest_term(&case, &found.responses);
        println!("  the term in F³ of the series is up to {largest:.1} times that in F");
        assert!(largest > 0.8, "{largest}");
        // For responses without the terms that eq. 5.15 truncates, the same equations give the true parameters. The truncation
        // is the only error.
        let exact = hfrf::fit(&cut_series(&case, &found)).expect("three levels");
        for (role, letter) in ROLES {
            let off = bias(&case, &exact.theta, role);
            assert!(
                off.abs() < 1e-6,
                "{name}: {letter} of a cut series is off by {off}"
            );
        }
    }
}

/// Largest ratio of the term in F³ of the true series to the term in F.
fn largest_term(case: &Case, responses: &[Response]) -> f64 {
    let ratio = |response: &Response| {
        let [h1, h3] = true_kernels(case, response.omega);
        let force = response.levels.iter().map(|level| level.0).fold(0.0, f64::max);
        (0.75 * force * force * h3 / h1).norm()
    };
    responses.iter().map(ratio).fold(0.0, f64::max)
}

/// Steady responses of the true model by harmonic balance, which are exact to rounding.
fn exact(case: &Case, levels_n: &[f64]) -> Vec<Response> {
    let law = law();
    let grid = Grid::new(HARMONICS, law.degree());
    let mut theta = vec![0.0; law.parameters.len()];
    for (role, _) in ROLES {
        theta[law.index(role).expect("the law has it")] = truth(case, role);
    }
    let mut motions = vec![DVector::zeros(grid.width()); levels_n.len()];
    let mut response = |frequency_hz: f64| {
        let omega = TAU * frequency_hz;
        let levels = levels_n.iter().zip(&mut motions).map(|(&level, x)| {
            let mut force = DVector::zeros(grid.width());
            force[1] = level;
            let problem = Problem {
                law: &law,
                theta: &theta,
                omega,
                force: &force,
            };
            *x = grid.solve(problem, x).expect("a steady motion").x;
            (level, Complex64::new(x[1], -x[2]))
        });
        Response {
            omega,
            levels: levels.collect(),
        }
    };
    frequencies_hz().into_iter().map(&mut response).collect()
}

#[test]
fn the_bias_vanishes_with_the_fourth_power_of_the_force() {
    let (name, levels, _) = SETS[0];
    let case = case(name);
    let of_share = |share: f64| {
        let responses = exact(&case, &levels.map(|level| share * level));
        let found = hfrf::fit(&responses).expect("three levels");
        let both =
            [Role::CubicDamping(0), Role::CubicStiffness(0)].map(|role| bias(&case, &found.theta, role));
        println!(
            "{name}, levels times {share}: c3 {:+.5} %, k3 {:+.5} %; the term in F³ up to {:.3} times that in F",
            100.0 * both[0],
            100.0 * both[1],
            largest_term(&case, &responses)
        );
        both
    };
    let biases = [1.0, 0.5, 0.25, 0.125, 0.0625].map(of_share);
    for (large, small) in biases[3].iter().zip(&biases[4]) {
        let power = (large / small).log2();
        println!("power of the force: {power:.2}");
        // The leading error is proportional to F⁴. At an eighth of the levels the next term contributes a fifth.
        assert!((3.5..4.5).contains(&power), "{large} {small} {power}");
    }
    // The error falls from a fifth at the levels of the thesis to less than a thousandth at a sixteenth of them.
    assert!(
        biases[0][1].abs() > 0.2 && biases[4].iter().all(|bias| bias.abs() < 1e-3),
        "{biases:?}"
    );
}
