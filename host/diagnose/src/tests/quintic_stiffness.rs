//! Quintic springs, alone and beside cubic ones, hidden and found again.

use crate::Options;
use crate::conclusion::answer::{Diagnosis, Outcome};
use crate::diagnose;
use crate::tests::structure::{baseline, decays, random_seed, sweeps};
use quietcut_recording::Recording;

/// Names of the causes, and for each wanted parameter the distance of its estimate from the truth in half widths of
/// its 90 % interval.
fn found(records: &[Recording], wanted: &[(&str, &str, f64)]) -> Diagnosis {
    let answer = diagnose(&baseline(), records, &Options::default()).unwrap();
    let mut names: Vec<&str> = answer.causes.iter().map(|cause| cause.name).collect();
    names.sort_unstable();
    let mut expected: Vec<&str> = wanted.iter().map(|(name, ..)| *name).collect();
    expected.sort_unstable();
    expected.dedup();
    assert_eq!(answer.outcome, Outcome::Cause, "{:?}", answer.causes);
    assert_eq!(names, expected, "{:?}", answer.causes);
    for (name, key, truth) in wanted {
        let cause = answer.causes.iter().find(|cause| cause.name == *name).unwrap();
        let figure = &cause.parameters[key];
        let half_width = 0.5 * (figure.ci90[1] - figure.ci90[0]);
        let distance = (figure.value - truth) / half_width;
        println!(
            "{name} {key}: {} of {truth}, {distance} half widths",
            figure.value
        );
        assert!(distance.abs() < 3.0, "{key}: {figure:?} of {truth}");
    }
    answer
}

#[test]
fn a_quintic_spring_is_found_at_three_levels() {
    for k5 in [1e17, -1e15] {
        let text = format!("quintic-stiffness={k5}");
        found(
            &sweeps(&[&text], random_seed()),
            &[("quintic-stiffness", "k5_n_per_m5", k5)],
        );
    }
}

#[test]
fn a_quintic_spring_is_found_in_free_decays() {
    found(
        &decays(&["quintic-stiffness=2e19"], random_seed()),
        &[("quintic-stiffness", "k5_n_per_m5", 2e19)],
    );
}

#[test]
fn a_cubic_and_a_quintic_spring_of_one_sign_are_two_causes_and_of_two_signs_one() {
    found(
        &decays(&["cubic-stiffness=1e12", "quintic-stiffness=2e19"], random_seed()),
        &[
            ("cubic-stiffness", "k3_n_per_m3", 1e12),
            ("quintic-stiffness", "k5_n_per_m5", 2e19),
        ],
    );
    let turn = [
        ("softening-hardening", "k3_n_per_m3", -1e12),
        ("softening-hardening", "k5_n_per_m5", 2e19),
    ];
    found(
        &decays(
            &["cubic-stiffness=-1e12", "quintic-stiffness=2e19"],
            random_seed(),
        ),
        &turn,
    );
}
