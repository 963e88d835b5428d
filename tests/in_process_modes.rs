//! Modes of the machine from simulated cuts that excite it, and the lobes of these modes, computed with the command.
#![allow(clippy::expect_used)]

use std::path::Path;

use quietcut_testkit::rates::assert_share;
use quietcut_testkit::results::Campaign;
use quietcut_tests::command::{cases, folder, quietcut};
use serde_json::Value;

/// The modes of Table 7.1 of the thesis: frequency in Hz and damping ratio.
const TRUTH: [(f64, f64); 2] = [(16.99, 0.0285), (18.48, 0.0996)];

fn case(name: &str) -> String {
    cases().join(format!("{name}.toml")).display().to_string()
}

fn run(folder: &Path, words: &str) -> Value {
    let arguments: Vec<&str> = words.split_whitespace().collect();
    quietcut(folder, &arguments).json()
}

fn number(value: &Value) -> f64 {
    value.as_f64().expect("a number")
}

/// Ratio of the half-widths of a 99.9 % and a 90 % interval of a normal error.
const SURE: f64 = 3.290_5 / 1.644_85;

/// Checks the modes of an answer: frequency within 0.2 %, damping ratio within 5 %.
fn assert_near<'a>(answer: &'a Value, way: &str) -> &'a [Value] {
    let modes = answer["complex_modes"].as_array().expect("modes");
    assert_eq!(modes.len(), TRUTH.len(), "{way}: {answer}");
    for (mode, (frequency_hz, damping_ratio)) in modes.iter().zip(TRUTH) {
        let (frequency, damping) = (&mode["frequency_hz"], &mode["damping_ratio"]);
        let off = number(&frequency["value"]) / frequency_hz - 1.0;
        let off_damping = number(&damping["value"]) / damping_ratio - 1.0;
        println!(
            "{way}: {:.4} Hz ({:+.3} %, 90 % interval {} to {}), damping ratio {:.5} ({:+.2} %, {} to {})",
            number(&frequency["value"]),
            100.0 * off,
            frequency["ci90"][0],
            frequency["ci90"][1],
            number(&damping["value"]),
            100.0 * off_damping,
            damping["ci90"][0],
            damping["ci90"][1],
        );
        assert!(off.abs() < 0.002 && off_damping.abs() < 0.05, "{way}: {mode}");
    }
    modes
}

/// As [`assert_near`], and the truth must lie within the 99.9 % interval that belongs to each stated 90 % interval. Returns for frequency
/// and damping ratio of each mode whether the 90 % interval holds the truth.
fn assert_modes(answer: &Value, way: &str) -> [[bool; 2]; 2] {
    let modes = assert_near(answer, way);
    std::array::from_fn(|index| {
        [
            ("frequency_hz", TRUTH[index].0),
            ("damping_ratio", TRUTH[index].1),
        ]
        .map(|(key, truth)| {
            let ends = [0, 1].map(|end| number(&modes[index][key]["ci90"][end]));
            let (middle, half) = (0.5 * (ends[0] + ends[1]), 0.5 * (ends[1] - ends[0]));
            assert!(
                (truth - middle).abs() <= SURE * half,
                "{way}: {key} {truth}: {}",
                modes[index]
            );
            (truth - middle).abs() <= half
        })
    })
}

/// First limits in mm from 600 to 2 400 rev/min, with all speeds multiplied by `factor`.
fn limits(folder: &Path, case: &str, factor: f64) -> Vec<f64> {
    let words = format!(
        "lobes {case} --nominal --rpm {}:{}:37 --depth-mm 0:7:36 --json",
        600.0 * factor,
        2400.0 * factor
    );
    let answer = run(folder, &words);
    let speeds = answer["speeds"].as_array().expect("speeds");
    speeds
        .iter()
        .map(|speed| number(&speed["first_limit"]["depth_mm"]))
        .collect()
}

/// Asserts that each limit agrees with the true limit: within 3 % in depth, or between the true limits at speeds 0.3 % lower and
/// higher.
fn assert_lobes(folder: &Path, found: &str, way: &str) {
    let truth = [0.997, 1.0, 1.003].map(|factor| limits(folder, &case("kuka-kr90-acetal"), factor));
    let mut worst = 0.0_f64;
    for (k, found) in limits(folder, found, 1.0).into_iter().enumerate() {
        let rpm = 600.0 + 50.0 * k as f64;
        let near = truth.each_ref().map(|limits| limits[k]);
        let [low, high] = near.iter().fold([f64::INFINITY, 0.0_f64], |[low, high], &limit| {
            [low.min(limit), high.max(limit)]
        });
        let off = found / near[1] - 1.0;
        if k % 4 == 0 {
            println!(
                "{way}: {rpm} rev/min: {found:.4} mm, truth {:.4} mm, {:+.2} %",
                near[1],
                100.0 * off
            );
        }
        assert!(
            off.abs() < 0.03 || (low..=high).contains(&found),
            "{way}: {rpm} rev/min: {found} mm, truth {near:?} mm"
        );
        worst = worst.max(off.abs());
    }
    println!("{way}: at most {:.2} % off in depth", 100.0 * worst);
}

/// Identifies the modes from a cut of porous material, with 1 % noise on every sample of every channel, and checks modes and
/// lobes.
fn porous(folder: &Path, measured: &str, seed: u64) -> [[bool; 2]; 2] {
    let robot = case("kuka-kr90-acetal");
    run(
        folder,
        &format!(
            "simulate {robot} --experiment porous --rpm 820 --depth-mm 2 --start-deg 0 --exit-deg 180 --seconds 240 \
             --sample-rate-hz 512 --measure {measured} --noise-percent 1 --seed {seed} --out porous.csv --json"
        ),
    );
    let answer = run(
        folder,
        &format!(
            "identify porous.csv --method modes --band-hz 10,28 --resolution-hz 0.1 --case {robot} \
             --stabilization poles.svg --out found.toml --json"
        ),
    );
    let way = format!("porous, {measured}, seed {seed}");
    let held = assert_modes(&answer, &way);
    assert_lobes(folder, "found.toml", &way);
    let drawn = std::fs::read_to_string(folder.join("poles.svg")).expect("a picture");
    assert!(drawn.contains("stable pole") && drawn.contains("Hyy"));
    held
}

/// Simulates speed sweeps at three immersions, with 1 % noise on every sample of every channel.
fn simulate_speed_sweeps(folder: &Path, measured: &str, seed: u64) {
    let robot = case("kuka-kr90-acetal");
    // The immersions of section 7.2.2 of the thesis: central, down- and up-milling. The tooth-passing frequency sweeps from 15
    // to 23 Hz.
    for (index, (start, exit)) in (1..).zip([(68.4, 109.8), (138.6, 180.0), (0.0, 41.4)]) {
        run(
            folder,
            &format!(
                "simulate {robot} --experiment speed-sweep --rpm 390 --to-rpm 750 --depth-mm 2 --start-deg {start} \
                 --exit-deg {exit} --seconds 180 --sample-rate-hz 1024 --measure {measured} --noise-percent 1 \
                 --seed {} --out sweep{index}.csv --json",
                3 * seed + index
            ),
        );
    }
}

/// Identifies the modes from speed sweeps at three immersions, and checks modes and lobes.
fn speed_sweep(folder: &Path, measured: &str, seed: u64) -> [[bool; 2]; 2] {
    let robot = case("kuka-kr90-acetal");
    simulate_speed_sweeps(folder, measured, seed);
    let answer = run(
        folder,
        &format!(
            "identify sweep1.csv sweep2.csv sweep3.csv --pseudo-inverse --method modes --band-hz 14,24 \
             --resolution-hz 0.08 --case {robot} --out found.toml --json"
        ),
    );
    let way = format!("speed sweep, {measured}, seed {seed}");
    let held = assert_modes(&answer, &way);
    assert_lobes(folder, "found.toml", &way);
    held
}

#[test]
fn porous_milling_gives_the_modes_of_table_7_1_and_their_lobes() {
    porous(folder().path(), "displacement", 1);
}

#[test]
fn speed_sweeps_with_accelerometers_give_the_modes_of_table_7_1_and_their_lobes() {
    speed_sweep(folder().path(), "acceleration", 1);
}

#[test]
#[ignore = "campaign: three speed sweeps by averaged receptances, 20 s"]
fn speed_sweeps_by_a_table_of_receptances_give_the_modes_of_table_7_1_and_their_lobes() {
    let folder = folder();
    let robot = case("kuka-kr90-acetal");
    simulate_speed_sweeps(folder.path(), "displacement", 0);
    let frf = run(
        folder.path(),
        "frf sweep1.csv sweep2.csv sweep3.csv --method pseudo-inverse --band-hz 14:24 --resolution-hz 0.08 --out frf.csv --json",
    );
    assert_eq!(frf["parts"][0]["excitation"], "sweep");
    println!(
        "speed sweep: smallest singular value of the forces {}",
        frf["parts"][0]["least_singular_value"]
    );
    let answer = run(
        folder.path(),
        &format!("identify frf.csv --method modes --case {robot} --out found.toml --json"),
    );
    // That the intervals of a table contain its leakage is tested in `host/identify/src/modes/record_fit/tests.rs`.
    assert_near(&answer, "speed sweep, receptances");
    assert_lobes(folder.path(), "found.toml", "speed sweep, receptances");
}

#[test]
#[ignore = "ten minutes: five seeds of both rigs with both sensors"]
fn fresh_seeds_of_both_rigs_with_both_sensors() {
    let mut held = Vec::new();
    for seed in 201..206 {
        for measured in ["displacement", "acceleration"] {
            held.push(porous(folder().path(), measured, seed));
            held.push(speed_sweep(folder().path(), measured, seed));
        }
    }
    let quantities = [(0, 0), (0, 1), (1, 0), (1, 1)].map(|(mode, quantity)| {
        let name = ["frequency", "damping ratio"][quantity];
        let hits = held.iter().filter(|held| held[mode][quantity]).count();
        (format!("{name} of the mode of {} Hz", TRUTH[mode].0), hits)
    });
    Campaign {
        name: "modes-from-commands",
        title: "Modes from porous milling and speed sweeps, by the command",
        command: "cargo test --release -p quietcut-tests --test in_process_modes -- --ignored --nocapture fresh_seeds",
        seeds: "201 to 205 for both rigs with both sensors; noise of 1 % on every channel",
    }
    .record(&quantities.each_ref().map(|(name, hits)| {
        (format!("90 % intervals that hold the {name}"), format!("{hits} of {}", held.len()))
    }));
    for (name, hits) in quantities {
        assert_share(&name, 0.9, hits, held.len());
    }
}

/// First limit of a case in mm at one spindle speed.
fn limit(folder: &Path, case: &str, rpm: f64) -> f64 {
    let answer = run(
        folder,
        &format!("lobes {case} --nominal --rpm {rpm}:{rpm}:1 --depth-mm 0:25:51 --json"),
    );
    number(&answer["speeds"][0]["first_limit"]["depth_mm"])
}

#[test]
fn a_hammer_misses_the_limits_of_the_nonlinear_robot_and_cuts_miss_them_less() {
    compare_hammer_and_cuts(&[500, 520, 540, 560, 580]);
}

#[test]
#[ignore = "a minute: the speeds between those of the test before"]
fn a_hammer_misses_the_limits_between_and_cuts_miss_them_less() {
    compare_hammer_and_cuts(&[510, 530, 550, 570]);
}

fn compare_hammer_and_cuts(speeds_rpm: &[u32]) {
    let folder = folder();
    let folder = folder.path();
    let robot = case("kuka-kr90-half-cubic");
    for direction in ["x", "y"] {
        run(
            folder,
            &format!(
                "simulate {robot} --experiment hammer --direction {direction} --force-n 300 --impacts 5 --spacing-s 12 \
                 --sample-rate-hz 512 --noise-percent 0.1 --measure displacement --out hammer_{direction}.csv --json"
            ),
        );
    }
    run(
        folder,
        "frf hammer_x.csv hammer_y.csv --band-hz 12:25 --out hammer.csv --json",
    );
    run(
        folder,
        &format!("identify hammer.csv --method modes --case {robot} --out hammered.toml --json"),
    );
    for (seed, rpm) in speeds_rpm.iter().map(|&rpm| (rpm, f64::from(rpm))) {
        let truth = limit(folder, &robot, rpm);
        let hammer = limit(folder, "hammered.toml", rpm);
        // The solid part of the porous material is slightly less than the depth limit from the hammer test. The pores are fine,
        // because coarse pores excite large vibration, at which the cubic stiffness differs from that of a cut of solid
        // material.
        let depth_mm = hammer * 0.95 / 0.7;
        run(
            folder,
            &format!(
                "simulate {robot} --experiment porous --rpm {rpm} --depth-mm {depth_mm} --pores-percent 30 --pore-mm 0.1 \
                 --seconds 120 --sample-rate-hz 512 --measure displacement --seed {seed} --out cut.csv --json"
            ),
        );
        run(
            folder,
            "frf cut.csv --band-hz 12:25 --resolution-hz 0.1 --out cut_frf.csv --json",
        );
        run(
            folder,
            &format!("identify cut_frf.csv --method modes --case {robot} --out cut_modes.toml --json"),
        );
        let cut = limit(folder, "cut_modes.toml", rpm);
        let off = |found: f64| 100.0 * (found / truth - 1.0);
        println!(
            "{rpm} rev/min: truth {truth:.2} mm; by hammer {hammer:.2} mm ({:+.0} %), in process {cut:.2} mm ({:+.0} %)",
            off(hammer),
            off(cut)
        );
        assert!(off(hammer) < 0.0, "{rpm}: {hammer} {truth}");
        assert!(
            off(cut).abs() < off(hammer).abs(),
            "{rpm}: {cut} {hammer} {truth}"
        );
    }
}
