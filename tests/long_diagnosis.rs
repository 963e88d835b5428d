//! Computing time of a diagnosis of four records of 60 s at 2 kHz. This command prints it in s: `cargo test --release -p
//! quietcut-tests --test long_diagnosis -- --ignored --nocapture --test-threads 1`.
#![allow(clippy::expect_used)]

use std::path::Path;
use std::time::Instant;

use quietcut_testkit::results::Campaign;
use quietcut_tests::command::{folder, quietcut};

/// Largest allowed computing time on two idle cores, s: a choice.
const LONGEST_S: f64 = 30.0;

const MACHINE: &str = "name = \"long\"
[structure]
kind = \"matrices\"
directions = [\"x\", \"y\"]
mass = [[180.0, 0.0], [0.0, 220.0]]
damping = [[900.0, 0.0], [0.0, 1300.0]]
stiffness = [[2.2e6, 1e5], [1e5, 3.1e6]]
[tool]
teeth = 2
edge_angle_deg = 90.0
diameter_mm = 16.0
[material]
ktc_mpa = 700.0
krc_mpa = 200.0
kte_n_per_mm = 5.0
kre_n_per_mm = 4.0
kac_mpa = 0.0
kae_n_per_mm = 0.0
[cut]
start_deg = 90.0
exit_deg = 180.0
feed_per_tooth_mm = 0.1
";

/// Simulates four records, one for each of `differing`, and diagnoses them. The only cause of the answer must be `cause`.
fn diagnose(test: &str, common: &[&str], differing: [&[&str]; 4], cause: &str) {
    let folder = folder();
    let folder: &Path = folder.path();
    std::fs::write(folder.join("case.toml"), MACHINE).expect("written");
    let records: Vec<String> = (0..4).map(|index| format!("{index}.csv")).collect();
    for (index, (record, own)) in records.iter().zip(differing).enumerate() {
        // Each record has its own seed. Equal noise in all four records would be a common signal.
        let seed = index.to_string();
        let mut arguments = vec![
            "simulate",
            "case.toml",
            "--sample-rate-hz",
            "2000",
            "--out",
            record,
            "--seed",
            &seed,
        ];
        arguments.extend(["--noise-percent", "1", "--measure", "displacement"]);
        arguments.extend(common.iter().chain(own));
        let made = quietcut(folder, &arguments);
        assert_eq!(made.status, Some(0), "{made:?}");
    }
    let mut arguments = vec!["diagnose", "case.toml", "--json"];
    arguments.extend(records.iter().map(String::as_str));
    let began = Instant::now();
    let answer = quietcut(folder, &arguments).json();
    let seconds = began.elapsed().as_secs_f64();
    let named: Vec<&str> = answer["causes"]
        .as_array()
        .expect("causes")
        .iter()
        .filter_map(|cause| cause["name"].as_str())
        .collect();
    println!("{cause}: {seconds:.1} s for four records of 60 s at 2 kHz: {named:?}");
    Campaign {
        name: &format!("long-diagnosis-{test}"),
        title: &format!("Long diagnosis, {test}"),
        command: "cargo test --release -p quietcut-tests --test long_diagnosis -- --ignored --nocapture --test-threads 1",
        seeds: &format!(
            "0 to 3, one for each record; processor cores: {}",
            std::thread::available_parallelism().map_or(1, usize::from)
        ),
    }
    .record(&[(
        format!("time for four records of 60 s at 2 kHz with {cause}"),
        format!("{seconds:.1} s"),
    )]);
    assert_eq!(named, [cause]);
    assert!(seconds < LONGEST_S, "{seconds}");
}

#[test]
#[ignore = "a measurement on a machine that does nothing else"]
fn computing_time_of_cuts() {
    let common = [
        "--depth-mm",
        "0.4",
        "--seconds",
        "60",
        "--entry",
        "none",
        "--ideal",
        "--effect",
        "runout=15",
    ];
    let rpm: [&[&str]; 4] = [
        &["--rpm", "520"],
        &["--rpm", "600"],
        &["--rpm", "700"],
        &["--rpm", "810"],
    ];
    diagnose("cuts", &common, rpm, "runout");
}

const LEVELS_N: [&[&str]; 4] = [
    &["--force-n", "20"],
    &["--force-n", "40"],
    &["--force-n", "60"],
    &["--force-n", "80"],
];

const TONES: [&str; 6] = [
    "--experiment",
    "shaker",
    "--frequency-hz",
    "8.03:29.97:20",
    "--seconds",
    "60",
];
const SWEEP: [&str; 6] = [
    "--experiment",
    "sweep",
    "--frequency-hz",
    "8:30:2",
    "--hz-per-min",
    "22",
];
const CUBIC: [&str; 4] = [
    "--effect",
    "cubic-stiffness=2e11",
    "--effect",
    "cubic-stiffness.direction=x",
];

#[test]
#[ignore = "a measurement on a machine that does nothing else"]
fn computing_time_of_a_shaker() {
    diagnose(
        "tones",
        &[&TONES[..], &CUBIC].concat(),
        LEVELS_N,
        "cubic-stiffness",
    );
}

#[test]
#[ignore = "a measurement on a machine that does nothing else"]
fn computing_time_of_a_shaker_while_the_machine_drifts() {
    let drift = ["--effect", "drift.relative_rate_per_s=5e-4"];
    diagnose(
        "tones-and-drift",
        &[&TONES[..], &drift].concat(),
        LEVELS_N,
        "drift",
    );
}

#[test]
#[ignore = "a measurement on a machine that does nothing else"]
fn computing_time_of_sweeps() {
    diagnose(
        "sweeps",
        &[&SWEEP[..], &CUBIC].concat(),
        LEVELS_N,
        "cubic-stiffness",
    );
}
