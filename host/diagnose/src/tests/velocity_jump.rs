//! Diagnoses accelerations of a structure whose modal masses add up to no mass: a step of the force makes the velocity jump, and an
//! accelerometer reads the average over a sampling interval.

use crate::conclusion::answer::Outcome;
use crate::tests::virtual_records::{case, record};
use crate::{Diagnosis, Options, diagnose};
use quietcut_model::case::Case;
use quietcut_model::structure::Direction;
use quietcut_recording::Quantity;
use quietcut_simulate::rig::{Noise, Rig, Signal};
use quietcut_simulate::{Effects, Entry, VirtualCut};

fn baseline() -> Case {
    case("kuka-kr90-acetal", "")
}

fn of_a_cut(effects: &[&str]) -> Diagnosis {
    let seconds = 6.0;
    let cut = VirtualCut {
        effects: Effects::parse_over(effects.iter().copied(), Some(seconds)).unwrap(),
        entry: Entry::None,
        measured: vec![Quantity::Force, Quantity::Acceleration],
        ..VirtualCut::new(900.0, 0.5, seconds)
    };
    let recording = record(&baseline(), &cut, "cut.csv", 1000.0, 0.005, 2);
    diagnose(&baseline(), &[recording], &Options::default()).unwrap()
}

fn of_a_sweep(effects: &[&str]) -> Diagnosis {
    let signal = Signal::Sweep {
        first_hz: 12.0,
        last_hz: 24.0,
        amplitude_n: 20.0,
        seconds: 20.0,
    };
    let rig = Rig {
        effects: Effects::parse(effects.iter().copied()).unwrap(),
        measured: vec![Quantity::Acceleration],
        ..Rig::new(Direction::X, signal, 256.0)
    };
    let structure = baseline().structure.unwrap();
    let (mut recording, _) = rig.record(&structure, std::path::Path::new("sweep.csv")).unwrap();
    let noise = Noise {
        relative: 0.01,
        ..Noise::default()
    };
    noise.add(&mut recording, 2);
    diagnose(&baseline(), &[recording], &Options::default()).unwrap()
}

#[test]
fn a_correct_baseline_has_no_cause() {
    for diagnosis in [of_a_cut(&[]), of_a_sweep(&[])] {
        assert_eq!(diagnosis.outcome, Outcome::None, "{:?}", diagnosis.causes);
    }
}

#[test]
fn a_hidden_effect_is_found() {
    for (diagnosis, name, key, truth) in [
        (of_a_cut(&["damping=0.3"]), "damping", "relative_change", 0.3),
        (
            of_a_sweep(&["stiffness=0.05"]),
            "stiffness",
            "relative_change",
            0.05,
        ),
    ] {
        assert_eq!(diagnosis.names(), [name]);
        let [low, high] = diagnosis.causes[0].parameters[key].ci90;
        println!("{name}: {low} to {high}");
        // The error may reach twice the half-width of the 90 % interval.
        assert!(
            (truth - 0.5 * (low + high)).abs() < high - low,
            "{name}: {low} to {high}"
        );
    }
}
