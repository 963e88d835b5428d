//! Microslip of joints, hidden and found again.

use crate::Options;
use crate::conclusion::answer::{Diagnosis, Outcome};
use crate::diagnose;
use crate::tests::structure::{baseline, free_decays, records};
use quietcut_recording::Recording;

/// Diagnosis of records with a joint of this softening, N/m, at 1 µm, and exponent.
fn joint(
    records: fn(&[&str]) -> Vec<Recording>,
    softening: f64,
    exponent: f64,
    reference_m: f64,
) -> Diagnosis {
    let effects = [
        format!("joint-friction={softening}"),
        format!("joint-friction.exponent={exponent}"),
        format!("joint-friction.reference_m={reference_m:e}"),
    ];
    let effects: Vec<&str> = effects.iter().map(String::as_str).collect();
    diagnose(&baseline(), &records(&effects), &Options::default()).unwrap()
}

fn found(answer: &Diagnosis, softening: f64, exponent: f64, reference_m: f64) {
    println!("{:?} {:?}", answer.outcome, answer.equivalent);
    for cause in &answer.causes {
        println!("{} {:?}", cause.name, cause.parameters);
    }
    let names: Vec<&str> = answer.causes.iter().map(|cause| cause.name).collect();
    assert_eq!(names, ["joint-friction"], "{:?}", answer.causes);
    assert_eq!(answer.outcome, Outcome::Cause);
    let parameters = &answer.causes[0].parameters;
    let scale_m = parameters["reference_m"].value;
    let wanted = [
        (
            "softening_n_per_m",
            softening * (scale_m / reference_m).powf(exponent),
        ),
        ("exponent", exponent),
    ];
    for (key, truth) in wanted {
        let figure = parameters[key];
        let half_width = 0.5 * (figure.ci90[1] - figure.ci90[0]);
        let distance = (figure.value - truth) / half_width;
        println!("{key}: {} of {truth}, {distance} half widths", figure.value);
        assert!(distance.abs() < 3.0, "{key}: {figure:?} of {truth}");
    }
}

#[test]
fn a_joint_is_found_at_three_levels() {
    for (softening, exponent) in [(1e5, 0.5), (5e4, 0.8)] {
        let answer = joint(records, softening, exponent, 1e-4);
        found(&answer, softening, exponent, 1e-4);
    }
}

#[test]
fn a_joint_is_found_in_free_decays() {
    for (softening, exponent) in [(4e4, 0.5), (3e4, 0.8)] {
        let answer = joint(free_decays, softening, exponent, 1e-4);
        found(&answer, softening, exponent, 1e-4);
    }
}
