//! Diagnoses a minute of hammer impacts: causes are searched in the first ones, and validated on the rest.

use std::path::Path;

use crate::conclusion::answer::Outcome;
use crate::tests::virtual_records::case;
use crate::{Diagnosis, Options, diagnose};
use quietcut_model::case::Case;
use quietcut_model::structure::Direction;
use quietcut_recording::{Quantity, Recording};
use quietcut_simulate::Effects;
use quietcut_simulate::rig::{Impact, Noise, Rig, Signal};

/// Ten impacts on the Stäubli robot, with accelerometers and 1 % noise on every channel. The spectrum of the impacts reaches
/// to the end of the band.
fn impacts(baseline: &Case, effects: &[&str]) -> Recording {
    let impacts = (0..10).map(|index| Impact {
        start_s: 0.5 + 5.0 * f64::from(index),
        peak_n: 200.0,
        pulse_s: 0.01,
    });
    let signal = Signal::Impacts {
        impacts: impacts.collect(),
        seconds: 50.0,
    };
    let rig = Rig {
        effects: Effects::parse(effects.iter().copied()).unwrap(),
        measured: vec![Quantity::Acceleration],
        ..Rig::new(Direction::X, signal, 2048.0)
    };
    let structure = baseline.structure.as_ref().unwrap();
    let (mut recording, _) = rig.record(structure, Path::new("impacts.csv")).unwrap();
    let noise = Noise {
        relative: 0.01,
        ..Noise::default()
    };
    noise.add(&mut recording, 4);
    recording
}

/// Diagnosis of [`impacts`].
fn diagnosed(effects: &[&str]) -> Diagnosis {
    let baseline = case("staubli-tx200", "");
    let recording = impacts(&baseline, effects);
    diagnose(&baseline, &[recording], &Options::default()).unwrap()
}

#[test]
fn an_inverted_sensor_or_hammer_is_refused() {
    let baseline = case("staubli-tx200", "");
    for name in ["ax", "fx"] {
        // The structure is softer than that of the case as well.
        let mut recording = impacts(&baseline, &["stiffness=-0.05"]);
        let inverted = recording.channels.iter_mut().find(|channel| channel.name == name);
        inverted
            .unwrap()
            .samples
            .iter_mut()
            .for_each(|sample| *sample *= -1.0);
        let error = diagnose(&baseline, &[recording], &Options::default()).unwrap_err();
        let said = error.to_string();
        assert!(
            said.contains("ax answers the impacts with the opposite sign"),
            "{said}"
        );
    }
}

#[test]
fn a_correct_baseline_has_no_cause() {
    let diagnosis = diagnosed(&[]);
    assert_eq!(diagnosis.outcome, Outcome::None, "{:?}", diagnosis.causes);
    let said = diagnosis.warnings.last().unwrap();
    assert!(said.starts_with("causes were searched in 16.0 s"), "{said}");
}

#[test]
fn a_hidden_effect_is_found() {
    let diagnosis = diagnosed(&["stiffness=0.1", "stiffness.direction=x"]);
    println!("{:?}", diagnosis.causes);
    assert_eq!(diagnosis.names(), ["stiffness"]);
}
