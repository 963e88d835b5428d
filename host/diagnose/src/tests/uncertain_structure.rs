//! Structures whose case states what it does not know: other values within that are updates, and effects are found beside them.

use std::path::Path;

use crate::conclusion::answer::{Diagnosis, Outcome};
use crate::tests::structure::{random_seed, recorded_of};
use crate::{Options, diagnose};
use quietcut_model::case::{Case, Parameter};
use quietcut_model::structure::Direction;
use quietcut_recording::{Recording, TestKind};
use quietcut_simulate::rig::Signal;

const ONE_MODE: &str = r#"
[structure]
kind = "matrices"
directions = ["x"]
mass = [[188.0]]
damping = [[305.0]]
stiffness = [[2260000.0]]
damping_std = [[40.0]]
stiffness_std = [[80000.0]]
"#;

/// Two modes of two directions whose frequencies, damping and shapes are uncertain.
const TWO_MODES: &str = r#"
[structure]
kind = "modes"
directions = ["x", "y"]

[[structure.mode]]
frequency_hz = 17.0
frequency_hz_std = 0.3
damping_ratio = 0.02
damping_ratio_std = 0.003
left = [[0.0, -0.000328], [0.0, -0.0000936]]
right = [[0.07, 0.0], [0.02, 0.0]]
right_std = [[0.004, 0.0], [0.002, 0.0]]

[[structure.mode]]
frequency_hz = 23.0
frequency_hz_std = 0.4
damping_ratio = 0.03
damping_ratio_std = 0.004
left = [[0.0, 0.0000692], [0.0, -0.000208]]
right = [[-0.02, 0.0], [0.06, 0.0]]
right_std = [[0.002, 0.0], [0.003, 0.0]]
"#;

fn case(text: &str) -> Case {
    Case::parse(Path::new("case.toml"), text).unwrap()
}

/// The case with parameters so many of their standard deviations away.
fn moved(case: &Case, deviations: &[f64]) -> Case {
    assert_eq!(case.deviations.len(), deviations.len());
    let mut moved = case.clone();
    for (deviation, by) in case.deviations.iter().zip(deviations) {
        assert!(deviation.parameter.shift(&mut moved, by * deviation.std));
    }
    moved
}

/// Sweeps of the true machine at three levels along each direction.
fn sweeps(truth: &Case, directions: &[Direction], effects: &[&str]) -> Vec<Recording> {
    let seed = random_seed();
    let levels = [5.0, 20.0, 60.0].into_iter();
    levels
        .flat_map(|amplitude_n| directions.iter().map(move |direction| (amplitude_n, *direction)))
        .zip(seed..)
        .map(|((amplitude_n, direction), seed)| {
            let signal = Signal::Sweep {
                first_hz: 10.0,
                last_hz: 30.0,
                amplitude_n,
                seconds: 20.0,
            };
            let mut record = recorded_of(truth, direction, signal, 256.0, effects, seed);
            record.sidecar.kind = Some(TestKind::Shaker);
            record
        })
        .collect()
}

fn names(answer: &Diagnosis) -> Vec<&'static str> {
    answer.causes.iter().map(|cause| cause.name).collect()
}

/// Asserts that each update holds the truth within three half widths of its interval, and that those that are `wanted` are listed.
fn assert_updates(answer: &Diagnosis, truth: &Case, wanted: &[&str]) {
    for update in &answer.updates {
        println!("{}", update.sentence());
        let parameter = Parameter::of_case(truth)
            .into_iter()
            .find(|parameter| parameter.name() == update.parameter)
            .unwrap();
        let half = 0.5 * (update.ci90[1] - update.ci90[0]);
        let apart = (update.value - parameter.value(truth).unwrap()).abs();
        assert!(apart <= 3.0 * half, "{update:?} of {:?}", parameter.value(truth));
    }
    for name in wanted {
        assert!(
            answer.updates.iter().any(|update| update.parameter == *name),
            "{name}: {:?}",
            answer.updates
        );
    }
}

#[test]
fn other_values_within_the_deviations_are_an_update() {
    let case = case(ONE_MODE);
    let truth = moved(&case, &[1.2, -1.0]);
    let records = sweeps(&truth, &[Direction::X], &[]);
    let answer = diagnose(&case, &records, &Options::default()).unwrap();
    assert_eq!(answer.outcome, Outcome::Update, "{:?}", answer.causes);
    assert_updates(
        &answer,
        &truth,
        &["structure.damping.1.1", "structure.stiffness.1.1"],
    );
    let (extended, gain) = (answer.extended.unwrap(), answer.gain.unwrap());
    assert!(extended.nrmse_heldout < 0.2 * answer.baseline.nrmse_heldout);
    assert!(gain.residual_energy_removed > 0.99, "{gain:?}");
    // The updated case agrees, and misses no more than was said.
    let text = answer.extended_case(ONE_MODE).unwrap();
    let again = diagnose(&self::case(&text), &records, &Options::default()).unwrap();
    assert!(matches!(again.outcome, Outcome::None | Outcome::Update));
    let ratio = again.baseline.nrmse_heldout / extended.nrmse_heldout;
    assert!((ratio - 1.0).abs() < 1e-3, "{ratio}");
}

#[test]
fn a_hidden_effect_is_named_alone_beside_other_values() {
    let case = case(ONE_MODE);
    let truth = moved(&case, &[-1.0, 1.3]);
    for (effect, size) in [("cubic-stiffness", -1e12), ("coulomb-friction", 2.0)] {
        let records = sweeps(&truth, &[Direction::X], &[&format!("{effect}={size}")]);
        let answer = diagnose(&case, &records, &Options::default()).unwrap();
        assert_eq!(names(&answer), [effect], "{:?}", answer.causes);
        assert_eq!(answer.outcome, Outcome::Cause);
        assert_updates(&answer, &truth, &["structure.stiffness.1.1"]);
        let figure = answer.causes[0].parameters.values().next().unwrap();
        let half = 0.5 * (figure.ci90[1] - figure.ci90[0]);
        assert!((figure.value - size).abs() <= 3.0 * half, "{figure:?} of {size}");
    }
}

#[test]
fn a_change_far_beyond_the_deviation_is_a_cause() {
    let case = case(ONE_MODE);
    // The prior of nine standard deviations costs 81 of χ²: more than the price of a cause.
    for by in [-12.0, -9.0, 9.0] {
        let truth = moved(&case, &[0.0, by]);
        let records = sweeps(&truth, &[Direction::X], &[]);
        let answer = diagnose(&case, &records, &Options::default()).unwrap();
        assert_eq!(names(&answer), ["stiffness"], "{by}: {:?}", answer.updates);
        let figure = answer.causes[0].parameters["stiffness_n_per_m"];
        let half = 0.5 * (figure.ci90[1] - figure.ci90[0]);
        let apart = (figure.value - (2.26e6 + 8e4 * by)).abs();
        assert!(apart <= 3.0 * half, "{by}: {figure:?}");
    }
}

#[test]
fn modes_and_shapes_are_updated_beside_a_hidden_effect() {
    let case = case(TWO_MODES);
    let truth = moved(&case, &[0.8, -1.0, 1.2, -0.7, 1.0, -1.1, 0.9, 0.6]);
    let directions = [Direction::X, Direction::Y];
    let nothing = diagnose(&case, &sweeps(&truth, &directions, &[]), &Options::default()).unwrap();
    assert_eq!(nothing.outcome, Outcome::Update, "{:?}", nothing.causes);
    let frequencies = ["structure.mode.1.frequency_hz", "structure.mode.2.frequency_hz"];
    assert_updates(&nothing, &truth, &frequencies);
    let effect = ["cubic-stiffness=-5e12", "cubic-stiffness.direction=y"];
    let answer = diagnose(&case, &sweeps(&truth, &directions, &effect), &Options::default()).unwrap();
    assert_eq!(names(&answer), ["cubic-stiffness"], "{:?}", answer.causes);
    assert_updates(&answer, &truth, &frequencies);
}
