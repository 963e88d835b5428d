//! Diagnoses records of sensors away from the tool, which read each mode by another ratio, and of gains that are equivalent to other
//! causes.

use std::path::Path;

use crate::conclusion::answer::Outcome;
use crate::tests::structure::{baseline, recorded_of};
use crate::{Diagnosis, Options, diagnose};
use quietcut_model::case::Case;
use quietcut_model::structure::Direction;
use quietcut_recording::{Quantity, RecordedChannel, Recording};
use quietcut_simulate::Effects;
use quietcut_simulate::rig::{Noise, Rig, Signal};

/// Two modes along x, 100 kg at 20 Hz and 120 kg at 34 Hz. The entries of `left` are −1/(2 m ω_d).
const BASELINE: &str = r#"
[structure]
kind = "modes"
directions = ["x"]
[[structure.mode]]
frequency_hz = 20.0
damping_ratio = 0.02
left = [[0.0, -3.979669e-5]]
right = [[1.0, 0.0]]
[[structure.mode]]
frequency_hz = 34.0
damping_ratio = 0.03
left = [[0.0, -1.951294e-5]]
right = [[1.0, 0.0]]
"#;

/// Sweeps at two levels with hidden effects. The sensor of x sits at the spindle housing and reads the two modes by the ratios 0.9 and
/// 0.55.
fn records(case: &Case, effects: &[&str]) -> Vec<Recording> {
    let offset = [
        "sensor-offset-from-tool-tip.ratio=0.9,0.55",
        "sensor-offset-from-tool-tip.channel=x",
    ];
    let all: Vec<&str> = effects.iter().copied().chain(offset).collect();
    let sweep = |(seed, amplitude_n)| {
        let signal = Signal::Sweep {
            first_hz: 12.0,
            last_hz: 45.0,
            amplitude_n,
            seconds: 10.0,
        };
        let mut record = recorded_of(case, Direction::X, signal, 512.0, &all, seed);
        let housing = RecordedChannel {
            at: Some("spindle-housing".into()),
            ..RecordedChannel::default()
        };
        record.sidecar.channels.insert("x".into(), housing);
        record
    };
    [(11, 5.0), (12, 15.0)].map(sweep).into()
}

fn ratios(answer: &Diagnosis) -> [f64; 2] {
    let offset = answer
        .causes
        .iter()
        .find(|cause| cause.name == "sensor-offset-from-tool-tip");
    ["ratio_1", "ratio_2"].map(|key| offset.unwrap().parameters[key].value)
}

fn assert_are_found(answer: &Diagnosis) {
    let [first, second] = ratios(answer);
    // With 1 % noise, 10 000 samples determine the ratios within 0.2 %.
    assert!(
        (first - 0.9).abs() < 2e-3 && (second - 0.55).abs() < 2e-3,
        "{first} {second}"
    );
}

#[test]
fn a_sensor_away_from_the_tool_has_a_ratio_for_each_mode() {
    let case = Case::parse(Path::new("baseline.toml"), BASELINE).unwrap();
    let records = records(&case, &[]);
    let answer = diagnose(&case, &records, &Options::default()).unwrap();
    assert_eq!(answer.outcome, Outcome::Cause, "{:?}", answer.causes);
    assert_eq!(answer.names(), ["sensor-offset-from-tool-tip"]);
    assert_are_found(&answer);
    let extended = answer.extended_case(BASELINE).unwrap();
    let extended = Case::parse(Path::new("extended.toml"), &extended).unwrap();
    let again = diagnose(&extended, &records, &Options::default()).unwrap();
    assert_eq!(again.outcome, Outcome::None, "{:?}", again.causes);
}

#[test]
fn a_spring_at_the_tool_is_found_by_a_sensor_elsewhere() {
    let case = Case::parse(Path::new("baseline.toml"), BASELINE).unwrap();
    let records = records(&case, &["cubic-stiffness=3e12"]);
    let answer = diagnose(&case, &records, &Options::default()).unwrap();
    assert_eq!(answer.outcome, Outcome::Cause, "{:?}", answer.causes);
    assert_eq!(answer.names(), ["cubic-stiffness", "sensor-offset-from-tool-tip"]);
    assert_are_found(&answer);
    let k3 = answer.causes[0].parameters["k3_n_per_m3"].value;
    assert!((k3 / 3e12 - 1.0).abs() < 0.01, "{k3}");
}

#[test]
fn a_structure_given_by_matrices_allows_one_ratio() {
    let text = r#"
[structure]
kind = "matrices"
directions = ["x"]
mass = [[188.0]]
damping = [[305.0]]
stiffness = [[2260000.0]]
[extension.sensor-offset-from-tool-tip]
ratio = [0.9, 0.8]
"#;
    let case = Case::parse(Path::new("baseline.toml"), text).unwrap();
    let modes = Case::parse(Path::new("modes.toml"), BASELINE).unwrap();
    let error = diagnose(&case, &records(&modes, &[]), &Options::default()).unwrap_err();
    assert!(error.to_string().contains("one is needed"), "{error}");
}

#[test]
fn a_gain_of_the_only_channel_is_equivalent_to_one_factor_on_the_modes() {
    let case = Case::parse(Path::new("baseline.toml"), BASELINE).unwrap();
    let signal = Signal::Sweep {
        first_hz: 12.0,
        last_hz: 45.0,
        amplitude_n: 10.0,
        seconds: 10.0,
    };
    let record = recorded_of(&case, Direction::X, signal, 512.0, &["sensor-gain=1.1"], 3);
    let answer = diagnose(&case, &[record], &Options::default()).unwrap();
    assert_eq!(answer.outcome, Outcome::Confounded, "{:?}", answer.names());
    let mut group = answer.equivalent[0].clone();
    group.sort_unstable();
    assert_eq!(group, ["damping", "mass", "sensor-gain", "stiffness"]);
    let mass = answer.causes.iter().find(|cause| cause.name == "mass").unwrap();
    let change = mass.parameters["relative_change"];
    // The reading 1.1·H·F is that of a structure whose mass, damping and stiffness are divided by 1.1.
    assert!((change.value - (1.0 / 1.1 - 1.0)).abs() < 2e-3, "{change:?}");
}

#[test]
fn gains_of_two_disagreeing_sensors_are_confounded() {
    let case = baseline();
    let pull_s = 2.5;
    let signal = Signal::Release {
        force_n: 300.0,
        pull_s,
        seconds: 8.0,
    };
    let rig = Rig {
        measured: vec![Quantity::Displacement, Quantity::Acceleration],
        effects: Effects::parse(["sensor-gain=1.2", "sensor-gain.channel=x"]).unwrap(),
        ..Rig::new(Direction::X, signal, 256.0)
    };
    let (mut record, _) = rig
        .record(case.structure().unwrap(), Path::new("decay.csv"))
        .unwrap();
    let noise = Noise {
        relative: 0.01,
        ..Noise::default()
    };
    noise.add(&mut record, 5);
    record.channels.retain(|channel| channel.name != "fx");
    // The acceleration jumps when the static force is released: the record begins after that instant.
    for channel in &mut record.channels {
        channel.samples.drain(..=(1.2 * pull_s * 256.0) as usize);
    }
    record.sidecar.input = None;
    let answer = diagnose(&case, &[record], &Options::default()).unwrap();
    assert_eq!(answer.outcome, Outcome::Confounded, "{:?}", answer.causes);
    assert_eq!(answer.equivalent, [["sensor-gain"]]);
    let gain_of = |channel: &str| {
        let of =
            |cause: &&crate::conclusion::answer::EstimatedCause| cause.channel.as_deref() == Some(channel);
        answer.causes.iter().find(of).unwrap().parameters["gain"].value
    };
    assert!((gain_of("x") - 1.2).abs() < 0.01, "{}", gain_of("x"));
    assert!((gain_of("ax") - 1.0 / 1.2).abs() < 0.01, "{}", gain_of("ax"));
    assert!(answer.causes.iter().all(|cause| cause.confidence <= 0.5));
    let test = answer.next_test.unwrap();
    assert_eq!((test.kind, test.measure), ("hammer", None), "{test:?}");
    assert!(test.distance > 60.0_f64.sqrt(), "{test:?}");
}
