//! Diagnoses virtual cuts near the stability limit and in fully developed chatter.

use crate::conclusion::answer::Outcome;
use crate::records::study::Study;
use crate::tests::virtual_records::{case, record};
use crate::{Diagnosis, Options, diagnose};
use quietcut_model::case::Case;
use quietcut_recording::{Quantity, Recording};
use quietcut_simulate::{Effects, Entry, VirtualCut};
use quietcut_testkit::slice;

const RPM: f64 = 900.0;
/// Limit of axial depth of this slot at `RPM`, mm.
const LIMIT_MM: f64 = 2.083;

fn baseline() -> Case {
    case("kuka-kr90-full", "")
}

/// Recording of a slot of six seconds with 0.5 % noise, by sensors of the quantities `measured`.
fn slot(depth_mm: f64, effects: &[&str], measured: &[Quantity], seed: u64) -> Recording {
    let seconds = 6.0;
    let cut = VirtualCut {
        effects: Effects::parse_over(effects.iter().copied(), Some(seconds)).unwrap(),
        entry: Entry::None,
        measured: measured.to_vec(),
        ..VirtualCut::new(RPM, depth_mm, seconds)
    };
    record(&baseline(), &cut, "cut.csv", 500.0, 0.005, seed)
}

fn diagnosed(recording: Recording) -> Diagnosis {
    let diagnosis = diagnose(&baseline(), &[recording], &Options::default()).unwrap();
    println!("{:?} {:?}", diagnosis.outcome, diagnosis.causes);
    diagnosis
}

#[test]
fn a_correct_baseline_has_no_cause_near_the_limit_and_in_chatter() {
    for (depth_mm, measured) in [
        (0.96 * LIMIT_MM, &[Quantity::Displacement][..]),
        (3.0, &[Quantity::Force, Quantity::Displacement]),
        (4.0, &[Quantity::Displacement]),
    ] {
        let recording = slot(depth_mm, &[], measured, 5);
        let case = baseline();
        let study = Study::new(&case, std::slice::from_ref(&recording)).unwrap();
        assert!(study.records[0].amplifies, "{depth_mm} mm");
        let diagnosis = diagnosed(recording);
        assert_eq!(diagnosis.outcome, Outcome::None, "{depth_mm} mm, {measured:?}");
        assert!(diagnosis.warnings.is_empty(), "{:?}", diagnosis.warnings);
    }
}

#[test]
fn a_shallow_cut_is_not_near_chatter() {
    let case = baseline();
    let recording = slot(0.2 * LIMIT_MM, &[], &[Quantity::Displacement], 5);
    let study = Study::new(&case, &[recording]).unwrap();
    assert!(!study.records[0].amplifies);
}

#[test]
fn hidden_effects_are_found_in_chatter() {
    let forces = &[Quantity::Force, Quantity::Displacement][..];
    let motion = &[Quantity::Displacement][..];
    // The stiffness of the baseline is 1.539947 N/µm, K_tc is 76 MPa.
    let hidden: [(f64, &[&str], _, _, _, f64); 6] = [
        (
            3.0,
            &["stiffness=0.1", "stiffness.direction=x"],
            motion,
            "stiffness",
            "stiffness_n_per_m",
            1.693_942e6,
        ),
        (4.0, &["runout=20"], motion, "runout", "runout_um", 20.0),
        (
            3.0,
            &["process-damping=2e5"],
            motion,
            "process-damping",
            "process_damping_n_per_m",
            2e5,
        ),
        (
            3.0,
            &["sensor-gain=1.1", "sensor-gain.channel=x"],
            forces,
            "sensor-gain",
            "gain",
            1.1,
        ),
        (
            3.0,
            &["force-coefficients=0.2"],
            motion,
            "force-coefficients",
            "ktc_mpa",
            91.2,
        ),
        // The baseline predicts this cut to be stable, with a limit a fifth deeper.
        (
            1.7,
            &["force-coefficients=0.6"],
            forces,
            "force-coefficients",
            "ktc_mpa",
            121.6,
        ),
    ];
    for (depth_mm, effects, measured, name, key, truth) in hidden.into_iter().step_by(slice(2, 1) as usize) {
        let diagnosis = diagnosed(slot(depth_mm, effects, measured, 7));
        assert_eq!(diagnosis.outcome, Outcome::Cause, "{effects:?}");
        let names: Vec<&str> = diagnosis.causes.iter().map(|cause| cause.name).collect();
        assert_eq!(names, [name], "{effects:?}");
        let found = diagnosis.causes[0].parameters[key];
        // The error may reach twice the half-width of the 90 % interval: one of six errors may exceed the half-width, none its double.
        let reach = found.ci90[1] - found.ci90[0];
        assert!((found.value - truth).abs() < reach, "{effects:?}: {found:?}");
        // With 0.5 % noise, some 3 000 samples determine the parameter of the only cause within one percent. With process
        // damping the cut is stable, and orders tell it only beside what is uncertain of the case and the sensors.
        let share = if name == "process-damping" { 0.2 } else { 0.03 };
        assert!(reach < share * truth, "{effects:?}: {found:?}");
    }
}
