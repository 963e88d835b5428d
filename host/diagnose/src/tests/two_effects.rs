//! Diagnoses records with two effects of which one masks the other.

use std::path::Path;

use crate::tests::structure::{baseline, recorded_of};
use crate::{Diagnosis, Options, diagnose};
use quietcut_model::case::Case;
use quietcut_model::structure::Direction;
use quietcut_simulate::rig::Signal;

fn assert_found(diagnosis: &Diagnosis, expected: &[(&str, &str, f64, f64)]) {
    let causes: Vec<_> = diagnosis
        .causes
        .iter()
        .map(|cause| (cause.name, &cause.parameters))
        .collect();
    let mut names: Vec<&str> = causes.iter().map(|(name, _)| *name).collect();
    names.sort_unstable();
    let mut wanted: Vec<&str> = expected.iter().map(|(name, ..)| *name).collect();
    wanted.sort_unstable();
    wanted.dedup();
    assert_eq!(names, wanted, "{causes:?}");
    for (name, key, truth, share) in expected {
        let (_, parameters) = causes.iter().find(|(known, _)| known == name).unwrap();
        let found = parameters[*key].value;
        assert!((found / truth - 1.0).abs() < *share, "{causes:?}");
    }
}

#[test]
fn a_second_cause_is_found_after_the_first_moved_the_resonance() {
    let case = baseline();
    // The stiffness of the baseline is 2.26e6 N/m. The resonance moves from 24 to 33 Hz, many times its bandwidth.
    let effects = [
        "stiffness=0.9",
        "softening-hardening.k3_n_per_m3=-3e10",
        "softening-hardening.k5_n_per_m5=6e15",
    ];
    let sweep = |(seed, amplitude_n)| {
        let signal = Signal::Sweep {
            first_hz: 12.0,
            last_hz: 45.0,
            amplitude_n,
            seconds: 20.0,
        };
        recorded_of(&case, Direction::X, signal, 512.0, &effects, seed)
    };
    let records = [(7, 20.0), (8, 100.0), (9, 250.0)].map(sweep);
    let diagnosis = diagnose(&case, &records, &Options::default()).unwrap();
    assert_found(
        &diagnosis,
        &[
            ("stiffness", "stiffness_n_per_m", 1.9 * 2.26e6, 2e-3),
            ("softening-hardening", "k3_n_per_m3", -3e10, 0.1),
        ],
    );
}

/// The mode of x at 507 Hz also appears along y, with 1/50 of the inverse modal mass of the mode at 339 Hz.
const COUPLED: &str = r#"
[structure]
kind = "matrices"
directions = ["x", "y"]
mass = [[0.4645, -0.0363], [-0.0363, 0.5051]]
damping = [[18.2, -4.1], [-4.1, 148.3]]
stiffness = [[4.72e6, 2.2e4], [2.2e4, 2.293e6]]
"#;

#[test]
fn a_missing_mode_is_found_near_a_weaker_mode_of_the_other_direction() {
    let case = Case::parse(Path::new("baseline.toml"), COUPLED).unwrap();
    let effects = [
        "missing-mode.direction=y",
        "missing-mode.frequency_hz=524",
        "missing-mode.damping_ratio=0.05",
        "missing-mode.modal_mass_kg=11.5",
    ];
    let sweep = |(seed, amplitude_n)| {
        let signal = Signal::Sweep {
            first_hz: 150.0,
            last_hz: 800.0,
            amplitude_n,
            seconds: 2.0,
        };
        recorded_of(&case, Direction::Y, signal, 4096.0, &effects, seed)
    };
    let records = [(7, 20.0), (8, 50.0)].map(sweep);
    let diagnosis = diagnose(&case, &records, &Options::default()).unwrap();
    assert_found(
        &diagnosis,
        &[
            ("missing-mode", "frequency_hz", 524.0, 2e-3),
            ("missing-mode", "damping_ratio", 0.05, 0.05),
            ("missing-mode", "modal_mass_kg", 11.5, 0.05),
        ],
    );
}
