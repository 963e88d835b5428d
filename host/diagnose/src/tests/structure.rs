//! Diagnoses virtual tests of a structure with hidden effects.

use std::path::Path;

use crate::conclusion::answer::Outcome;
use crate::{DiagnoseError, Diagnosis, Options, diagnose};
use quietcut_model::case::Case;
use quietcut_model::structure::Direction;
use quietcut_recording::{Channel, Quantity, Recording, TestKind};
use quietcut_simulate::Effects;
use quietcut_simulate::rig::{Noise, Rig, Signal};
use quietcut_testkit::slice;

/// Case of one mode of a robot at 17.4 Hz.
const BASELINE: &str = r#"
name = "baseline"
[structure]
kind = "matrices"
directions = ["x"]
mass = [[188.0]]
damping = [[305.0]]
stiffness = [[2260000.0]]
"#;

pub(crate) fn baseline() -> Case {
    Case::parse(Path::new("baseline.toml"), BASELINE).unwrap()
}

/// Recording of a test of the baseline's structure with hidden effects, with 1 % noise on the displacement.
fn recorded(signal: Signal, rate_hz: f64, effects: &[&str], seed: u64) -> Recording {
    recorded_of(&baseline(), Direction::X, signal, rate_hz, effects, seed)
}

/// Recording of a test of any structure with hidden effects, with the force along `direction` and 1 % noise on the displacement.
pub(crate) fn recorded_of(
    case: &Case,
    direction: Direction,
    signal: Signal,
    rate_hz: f64,
    effects: &[&str],
    seed: u64,
) -> Recording {
    let mut rig = Rig::new(direction, signal, rate_hz);
    rig.measured = vec![Quantity::Displacement];
    rig.effects = Effects::parse(effects.iter().copied()).unwrap();
    let path = format!("record-{seed}.csv");
    let (mut recording, _) = rig.record(case.structure().unwrap(), Path::new(&path)).unwrap();
    let mut noise = Noise {
        relative: 0.01,
        ..Noise::default()
    };
    noise.absolute.insert(format!("f{direction}"), 0.0);
    noise.add(&mut recording, seed);
    recording
}

/// A seed of noise that differs in each run of the tests, and is printed.
pub(crate) fn random_seed() -> u64 {
    let since = std::time::SystemTime::now().duration_since(std::time::UNIX_EPOCH);
    let seed = match std::env::var("QUIETCUT_SEED") {
        Ok(text) => text.parse().unwrap(),
        Err(_) => u64::from(since.unwrap().subsec_nanos()),
    };
    println!("noise from seed {seed} on");
    seed
}

/// A recording of more than one second whose samples the caller replaces.
fn to_be_filled(rate_hz: f64, seed: u64) -> Recording {
    let signal = Signal::Release {
        force_n: 1.0,
        pull_s: 1.0,
        seconds: 1.0,
    };
    recorded(signal, rate_hz, &[], seed)
}

fn records(effects: &[&str]) -> Vec<Recording> {
    sweeps(effects, 7)
}

/// Sweeps through the resonance at three force levels, with hidden effects and noise from `seed` on.
pub(crate) fn sweeps(effects: &[&str], seed: u64) -> Vec<Recording> {
    let sweep = |(seed, amplitude_n)| {
        let signal = Signal::Sweep {
            first_hz: 10.0,
            last_hz: 25.0,
            amplitude_n,
            seconds: 20.0,
        };
        recorded(signal, 256.0, effects, seed)
    };
    [(seed, 5.0), (seed + 1, 20.0), (seed + 2, 60.0)]
        .map(sweep)
        .into()
}

fn free_decays(effects: &[&str]) -> Vec<Recording> {
    decays(effects, 7)
}

/// Two free decays from static forces, recorded from their start on, without the force, with hidden effects and noise
/// from `seed` on.
pub(crate) fn decays(effects: &[&str], seed: u64) -> Vec<Recording> {
    let (rate_hz, pull_s) = (256.0, 5.0);
    let free_decay = |(seed, force_n)| {
        let signal = Signal::Release {
            force_n,
            pull_s,
            seconds: 8.0,
        };
        let mut recording = recorded(signal, rate_hz, effects, seed);
        recording.channels.retain(|channel| channel.name != "fx");
        for channel in &mut recording.channels {
            channel.samples.drain(..(1.2 * pull_s * rate_hz) as usize);
        }
        recording.sidecar.input = None;
        recording
    };
    [(seed, 500.0), (seed + 1, 200.0)].map(free_decay).into()
}

fn diagnosed(effects: &[&str]) -> Diagnosis {
    diagnose(&baseline(), &records(effects), &Options::default()).unwrap()
}

fn value(diagnosis: &Diagnosis, name: &str, key: &str) -> f64 {
    let cause = diagnosis.causes.iter().find(|cause| cause.name == name).unwrap();
    cause.parameters[key].value
}

#[test]
fn records_without_hidden_effects_have_no_cause() {
    let answer = diagnosed(&[]);
    // No cause is impossible to examine.
    assert!(answer.warnings.is_empty(), "{:?}", answer.warnings);
    assert_eq!(answer.outcome, Outcome::None, "{:?}", answer.causes);
}

#[test]
fn single_causes_are_found_with_their_parameters() {
    // With 1 % noise in 15 000 samples, the standard deviations are well below one percent.
    for (effects, name, key, truth) in [
        (
            vec!["cubic-stiffness=-1e12"],
            "cubic-stiffness",
            "k3_n_per_m3",
            -1e12,
        ),
        (vec!["cubic-damping=3e6"], "cubic-damping", "c3_ns3_per_m3", 3e6),
        (
            vec!["quadratic-damping=3000"],
            "quadratic-damping",
            "c2_ns2_per_m2",
            3e3,
        ),
        (vec!["coulomb-friction=1"], "coulomb-friction", "fc_n", 1.0),
        (
            vec!["backlash=0.1", "backlash.stiffness_fraction=0.2"],
            "backlash",
            "gap_mm",
            0.1,
        ),
        (vec!["stiffness=0.01"], "stiffness", "stiffness_n_per_m", 2.2826e6),
        (vec!["mass=-0.01"], "mass", "mass_kg", 186.12),
        (vec!["damping=0.5"], "damping", "damping_ns_per_m", 457.5),
        (vec!["sensor-delay=0.002"], "sensor-delay", "delay_s", 0.002),
        (
            vec![
                "missing-mode=13",
                "missing-mode.modal_mass_kg=900",
                "missing-mode.damping_ratio=0.02",
            ],
            "missing-mode",
            "modal_mass_kg",
            900.0,
        ),
    ]
    .into_iter()
    .step_by(slice(2, 1) as usize)
    {
        let answer = diagnosed(&effects);
        assert_eq!(answer.outcome, Outcome::Cause, "{effects:?}: {:?}", answer.causes);
        assert_eq!(answer.causes[0].name, name, "{effects:?}");
        let found = value(&answer, name, key);
        assert!((found / truth - 1.0).abs() < 0.02, "{effects:?}: {found}");
        assert!(answer.gain.unwrap().residual_energy_removed > 0.95, "{effects:?}");
    }
}

#[test]
fn a_small_cause_is_found_beside_a_large_one() {
    // The delay alone adds a few percent to the noise, which chance may do if the noise variance is unknown.
    let answer = diagnosed(&["cubic-stiffness=-1e12", "sensor-delay=3e-5"]);
    assert_eq!(answer.outcome, Outcome::Cause, "{:?}", answer.causes);
    let names: Vec<&str> = answer.causes.iter().map(|cause| cause.name).collect();
    assert_eq!(names, ["cubic-stiffness", "sensor-delay"]);
    let delay_s = value(&answer, "sensor-delay", "delay_s");
    assert!((delay_s / 3e-5 - 1.0).abs() < 0.3, "{delay_s}");
}

/// Recording of a sweep on a guide whose damping depends on the position, f_r = e·x·v, which is no cause of the library. It is simulated by
/// Runge–Kutta with steps of a tenth of a sample.
fn unevenly_damped(damping_per_m: f64, amplitude_n: f64, seed: u64) -> Recording {
    const FINER: usize = 10;
    let signal = Signal::Sweep {
        first_hz: 10.0,
        last_hz: 25.0,
        amplitude_n,
        seconds: 20.0,
    };
    let mut recording = recorded(signal.clone(), 256.0, &[], seed);
    let rate = |t: f64, [x, v]: [f64; 2]| {
        let force = signal.force_n(t) - 305.0 * v - 2.26e6 * x - damping_per_m * x * v;
        [v, force / 188.0]
    };
    let moved = |state: [f64; 2], slope: [f64; 2], h: f64| [state[0] + h * slope[0], state[1] + h * slope[1]];
    let h = 1.0 / (256.0 * FINER as f64);
    let (mut state, mut motion) = ([0.0; 2], Vec::new());
    for step in 0..FINER * recording.len() {
        if step % FINER == 0 {
            motion.push(state[0]);
        }
        let t = step as f64 * h;
        let a = rate(t, state);
        let b = rate(t + 0.5 * h, moved(state, a, 0.5 * h));
        let c = rate(t + 0.5 * h, moved(state, b, 0.5 * h));
        let d = rate(t + h, moved(state, c, h));
        state = std::array::from_fn(|i| state[i] + h / 6.0 * (a[i] + 2.0 * b[i] + 2.0 * c[i] + d[i]));
    }
    let channel = recording.channels.iter_mut().find(|channel| channel.name == "x");
    channel.unwrap().samples = motion;
    let mut noise = Noise {
        relative: 5e-4,
        ..Noise::default()
    };
    noise.absolute.insert("fx".into(), 0.0);
    noise.add(&mut recording, seed);
    recording
}

#[test]
fn a_formula_is_guessed_for_an_unexplained_residual() {
    let records = [(7, 5.0), (8, 20.0), (9, 60.0)].map(|(seed, level)| unevenly_damped(1.5e5, level, seed));
    let answer = diagnose(&baseline(), &records, &Options::default()).unwrap();
    assert_eq!(answer.outcome, Outcome::Unexplained, "{:?}", answer.causes);
    let guess = answer.unexplained.guess.unwrap();
    assert!(guess.starts_with("a guess and no cause: "), "{guess}");
    // The first term of the formula is the largest: its coefficient and its expression.
    let (number, words) = guess
        .split_once("force of + ")
        .and_then(|(_, formula)| formula.split_once('·'))
        .unwrap();
    assert!(words.starts_with("x·vx "), "{guess}");
    assert!(
        (number.parse::<f64>().unwrap() / 1.5e5 - 1.0).abs() < 0.03,
        "{guess}"
    );
}

#[test]
fn a_missing_mode_is_found_in_free_decays() {
    let mode = [
        "missing-mode=31",
        "missing-mode.modal_mass_kg=150",
        "missing-mode.damping_ratio=0.02",
    ];
    let answer = diagnose(&baseline(), &free_decays(&mode), &Options::default()).unwrap();
    assert_eq!(answer.outcome, Outcome::Cause, "{:?}", answer.causes);
    assert_eq!(answer.causes[0].name, "missing-mode");
    // With 1 % noise, 4 000 samples determine the modal mass within about one percent, from the static force on both modes.
    for (key, truth, bound) in [
        ("frequency_hz", 31.0, 2e-3),
        ("damping_ratio", 0.02, 0.06),
        ("modal_mass_kg", 150.0, 0.05),
    ] {
        let found = value(&answer, "missing-mode", key);
        assert!((found / truth - 1.0).abs() < bound, "{key}: {found}");
    }
    let plain = diagnose(&baseline(), &free_decays(&[]), &Options::default()).unwrap();
    assert!(plain.warnings.is_empty(), "{:?}", plain.warnings);
    assert_eq!(plain.outcome, Outcome::None, "{:?}", plain.causes);
}

#[test]
fn a_gain_is_equivalent_to_one_factor_on_mass_stiffness_and_damping() {
    let answer = diagnosed(&["sensor-gain=1.1"]);
    assert_eq!(answer.outcome, Outcome::Confounded);
    let mut group = answer.equivalent[0].clone();
    group.sort_unstable();
    assert_eq!(group, ["damping", "mass", "sensor-gain", "stiffness"]);
    // The alternatives contain all causes that act together.
    let said = answer.alternatives();
    assert_eq!(
        said,
        "sensor-gain of x; or mass along x with stiffness along x with damping along x"
    );
    let json = serde_json::to_value(&answer).unwrap();
    assert_eq!(json["explanations"][1][0]["name"], "mass");
    assert!(json["explanations"][1][2]["confidence"].as_f64().unwrap() < 0.3);
    assert!((value(&answer, "sensor-gain", "gain") - 1.1).abs() < 0.002);
    assert!((value(&answer, "mass", "mass_kg") * 1.1 / 188.0 - 1.0).abs() < 0.002);
    let reason = crate::next_test::next_test(&baseline(), &[], &answer).unwrap_err();
    assert_eq!(reason, "the records contain no motion");
    // Readings of the same sensor under the same force cannot separate a gain from a common factor.
    let test = answer.next_test.unwrap();
    assert!(
        test.measure
            .is_some_and(|measure| measure.contains("second sensor")),
        "{test:?}"
    );
    assert!(test.distance > 60.0_f64.sqrt(), "{test:?}");
}

#[test]
fn a_cause_along_two_directions_has_a_parameter_for_each() {
    let text = BASELINE
        .replace("[\"x\"]", "[\"x\", \"y\"]")
        .replace("[[188.0]]", "[[188.0, 4.0], [4.0, 150.0]]")
        .replace("[[305.0]]", "[[305.0, 0.0], [0.0, 400.0]]")
        .replace("[[2260000.0]]", "[[2260000.0, 0.0], [0.0, 2600000.0]]");
    let case = Case::parse(Path::new("baseline.toml"), &text).unwrap();
    let springs = [
        "cubic-stiffness.k3_n_per_m3=-1e12,-2e12",
        "cubic-stiffness.direction=x,y",
    ];
    let sweep = |direction, seed, amplitude_n| {
        let signal = Signal::Sweep {
            first_hz: 12.0,
            last_hz: 27.0,
            amplitude_n,
            seconds: 10.0,
        };
        recorded_of(&case, direction, signal, 256.0, &springs, seed)
    };
    let records = [
        sweep(Direction::X, 3, 15.0),
        sweep(Direction::X, 4, 40.0),
        sweep(Direction::Y, 5, 15.0),
        sweep(Direction::Y, 6, 40.0),
    ];
    let answer = diagnose(&case, &records, &Options::default()).unwrap();
    assert_eq!(answer.outcome, Outcome::Cause, "{:?}", answer.causes);
    let named: Vec<_> = answer
        .causes
        .iter()
        .map(|cause| (cause.name, cause.direction, cause.parameters["k3_n_per_m3"].value))
        .collect();
    let [
        ("cubic-stiffness", Some("x"), x),
        ("cubic-stiffness", Some("y"), y),
    ] = named[..]
    else {
        panic!("{named:?}");
    };
    // The noise is 1 % in 5 000 samples of each direction.
    assert!(
        (x / -1e12 - 1.0).abs() < 0.01 && (y / -2e12 - 1.0).abs() < 0.01,
        "{named:?}"
    );
    let extended = answer.extended_case(&text).unwrap();
    assert_eq!(
        extended.matches("[extension.cubic-stiffness]").count(),
        1,
        "{extended}"
    );
    let extended = Case::parse(Path::new("extended.toml"), &extended).unwrap();
    let again = diagnose(&extended, &records, &Options::default()).unwrap();
    assert_eq!(again.outcome, Outcome::None, "{:?}", again.causes);
}

/// Recording of an imposed motion of two tones and its force. The force is that of the machine, 150 N of dry friction, an unknown force
/// with the amplitude `unknown_n`, and 5 N of noise.
fn imposed(unknown_n: f64, seed: u64) -> Recording {
    use rand::SeedableRng;
    use rand_distr::Distribution;
    let rate_hz = 256.0;
    let mut random = rand_chacha::ChaCha8Rng::seed_from_u64(seed);
    let (mut moved, mut force) = (Vec::new(), Vec::new());
    for n in 0..4096 {
        let t = f64::from(n) / rate_hz;
        // Position, velocity and acceleration of both tones over whole periods.
        let (mut x, mut v, mut a) = (0.0, 0.0, 0.0);
        for (size, hz) in [(2e-3, 1.0), (1e-3, 2.75)] {
            let omega = std::f64::consts::TAU * hz;
            x += size * (omega * t).sin();
            v += size * omega * (omega * t).cos();
            a -= size * omega * omega * (omega * t).sin();
        }
        let noise: f64 = rand_distr::StandardNormal.sample(&mut random);
        moved.push(x);
        // The unknown force varies irregularly, as real friction does, about three times per period of the first tone.
        let phase = 3.0 * std::f64::consts::TAU * t + 0.8 * (0.4 * t).sin();
        force.push(
            188.0 * a + 305.0 * v + 2.26e6 * x + 150.0 * v.signum() + unknown_n * phase.cos() + 5.0 * noise,
        );
    }
    let channel = |name: &str, quantity, samples| Channel {
        name: name.into(),
        quantity,
        samples,
    };
    let mut record = to_be_filled(rate_hz, seed);
    record.channels = vec![
        channel("x", Quantity::Displacement, moved),
        channel("fx", Quantity::Force, force),
    ];
    record.sidecar.kind = Some(TestKind::Shaker);
    record.sidecar.input = Some(vec!["x".into()]);
    record
}

#[test]
fn friction_is_found_in_the_force_of_an_imposed_motion() {
    let answer = diagnose(&baseline(), &[imposed(0.0, 5)], &Options::default()).unwrap();
    assert_eq!(answer.outcome, Outcome::Cause, "{:?}", answer.causes);
    assert_eq!(answer.causes[0].name, "coulomb-friction");
    let found = value(&answer, "coulomb-friction", "fc_n");
    assert!((found / 150.0 - 1.0).abs() < 0.02, "{found} {:?}", answer.causes);
}

#[test]
fn the_record_with_the_largest_residual_of_force_has_the_least_weight() {
    let records = [imposed(0.0, 5), imposed(120.0, 6)];
    let answer = diagnose(&baseline(), &records, &Options::default()).unwrap();
    assert_eq!(answer.causes[0].name, "coulomb-friction", "{:?}", answer.causes);
    let friction = &answer.causes[0].parameters["fc_n"];
    // The record without the unknown force is biased by 0.15 %, because noise decides the sign of small velocities. Both records with equal
    // weight would be biased by 0.44 %.
    assert!((friction.value / 150.0 - 1.0).abs() < 2.5e-3, "{friction:?}");
}

#[test]
fn simulations_are_accurate_to_the_noise_of_an_interferometer() {
    // Free decay of a spindle from some micrometers, with the noise of an interferometer. The samples are the exact solution of a damped
    // oscillator.
    let (mass, damping, stiffness) = (0.048, 1.78, 2.2e5);
    let case = BASELINE
        .replace("188.0", &format!("{mass:?}"))
        .replace("305.0", &format!("{damping:?}"))
        .replace("2260000.0", &format!("{stiffness:?}"));
    let case = Case::parse(Path::new("spindle.toml"), &case).unwrap();
    let (decay, rate_hz): (f64, f64) = (damping / (2.0 * mass), 12_450.0);
    let omega = (stiffness / mass - decay * decay).sqrt();
    let records: Vec<Recording> = [(1, 3e-6), (2, 1.2e-5)]
        .into_iter()
        .map(|(seed, start_m)| {
            let mut record = to_be_filled(rate_hz, seed);
            let samples = (0..3400).map(|n| {
                let t = f64::from(n) / rate_hz;
                start_m * (-decay * t).exp() * ((omega * t).cos() + decay / omega * (omega * t).sin())
            });
            record.channels.retain(|channel| channel.name == "x");
            record.channels[0].samples = samples.collect();
            record.sidecar.input = None;
            let noise = Noise {
                absolute: [("x".into(), 4e-11)].into(),
                ..Noise::default()
            };
            noise.add(&mut record, seed);
            record
        })
        .collect();
    let answer = diagnose(&case, &records, &Options::default()).unwrap();
    assert_eq!(answer.outcome, Outcome::None, "{:?}", answer.causes);
}

#[test]
fn an_extended_case_has_no_further_cause() {
    let records = records(&["cubic-stiffness=-2e11"]);
    let first = diagnose(&baseline(), &records, &Options::default()).unwrap();
    let text = first.extended_case(BASELINE).unwrap();
    // A case holds the extension only once, but its structure can have the cubic stiffness as well.
    let k3 = value(&first, "cubic-stiffness", "k3_n_per_m3");
    let inside = BASELINE.replacen(
        "stiffness = [[",
        &format!("cubic_stiffness = [[{k3:e}]]\nstiffness = [["),
        1,
    );
    for text in [text, inside] {
        let extended = Case::parse(Path::new("extended.toml"), &text).unwrap();
        let second = diagnose(&extended, &records, &Options::default()).unwrap();
        assert_eq!(second.outcome, Outcome::None, "{text}: {:?}", second.causes);
    }
}

#[test]
fn unusable_records_are_refused_with_their_requirement() {
    let good = records(&[]).swap_remove(0);
    let refused = |change: &dyn Fn(&mut Recording), words: &str| {
        let mut record = good.clone();
        change(&mut record);
        let error: DiagnoseError = diagnose(&baseline(), &[record], &Options::default()).unwrap_err();
        let said = error.to_string();
        assert!(said.contains(words), "{said}");
    };
    refused(
        &|record| {
            record
                .channels
                .iter_mut()
                .for_each(|channel| channel.samples.truncate(100))
        },
        "too short",
    );
    refused(
        &|record| record.channels.retain(|channel| channel.name != "fx"),
        "fx, which its sidecar names",
    );
    refused(
        &|record| record.channels.retain(|channel| channel.name != "x"),
        "channel of motion",
    );
    refused(
        &|record| {
            for sample in &mut record.channels[1].samples {
                *sample = sample.clamp(-1e-6, 1e-6);
            }
        },
        "clipped",
    );
    refused(
        &|record| {
            record.channels[1]
                .samples
                .iter_mut()
                .for_each(|sample| *sample *= 1000.0)
        },
        "unit",
    );
    refused(
        &|record| {
            record.channels[1] = Channel {
                name: "y".into(),
                ..record.channels[1].clone()
            };
        },
        "direction of the case",
    );
}

/// Four records of one minute at 2 kHz, of tones without a common period, with hidden effects.
fn long_records(effects: &[&str]) -> Vec<Recording> {
    let tones = |(index, last_n): (u32, f64)| {
        let tones = (0..25).map(|k: u32| (10.0 + f64::from(k).powf(0.9), f64::from(k * k + index)));
        let signal = Signal::Tones {
            tones: tones.collect(),
            first_n: last_n,
            last_n,
            seconds: 60.0,
        };
        let mut recording = recorded(signal, 2000.0, effects, u64::from(11 + index));
        recording.sidecar.kind = Some(TestKind::Shaker);
        recording
    };
    [(0, 4.0), (1, 8.0), (2, 12.0), (3, 16.0)].map(tones).into()
}

#[test]
fn long_records_are_searched_in_part_and_validated_on_the_rest() {
    let recordings = long_records(&["cubic-stiffness=2e12"]);
    let answer = diagnose(&baseline(), &recordings, &Options::default()).unwrap();
    assert_eq!(answer.outcome, Outcome::Cause, "{:?}", answer.causes);
    assert_eq!(answer.causes[0].name, "cubic-stiffness");
    let found = value(&answer, "cubic-stiffness", "k3_n_per_m3");
    assert!((found / 2e12 - 1.0).abs() < 0.02, "{found}");
    assert!(answer.gain.unwrap().residual_energy_removed > 0.95);
    assert!(
        answer
            .warnings
            .iter()
            .any(|said| said.contains("4.1 s near the start")),
        "{:?}",
        answer.warnings
    );
}

#[test]
fn a_record_without_rest_is_reported_if_the_others_are_long() {
    let mut recordings = long_records(&[]);
    recordings.truncate(2);
    for channel in &mut recordings[1].channels {
        channel.samples.truncate(8000);
    }
    let (answer, warning) =
        crate::conclusion::long_records::concluded(&baseline(), &recordings, &Options::default(), &|_| ());
    assert!(answer.is_none());
    assert!(warning.is_some_and(|warning| warning.contains("too short")));
}

/// A drift of 4 % per minute is only 0.25 % in the first seconds, in which causes are searched.
#[test]
fn a_drift_over_long_records_is_not_overlooked() {
    let recordings = long_records(&["drift.relative_rate_per_s=0.0007"]);
    let (beginning, _) =
        crate::conclusion::long_records::concluded(&baseline(), &recordings, &Options::default(), &|_| ());
    assert!(
        beginning.is_none_or(|answer| answer.outcome != Outcome::None),
        "nothing is said to be wrong"
    );
}
