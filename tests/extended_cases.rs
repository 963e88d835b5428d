//! Extended cases from `diagnose` are valid in `simulate`, `lobes` and `table`, and contain the identified causes.

#![allow(clippy::expect_used)]

use std::path::Path;

use quietcut_tests::command::{cases, folder, quietcut};
use serde_json::Value;

const CASE: &str = "kuka-kr90-full.toml";

fn run(folder: &Path, line: &str) -> Value {
    let arguments: Vec<&str> = line.split_whitespace().chain(["--json"]).collect();
    let answer = quietcut(folder, &arguments);
    assert_eq!(answer.status, Some(0), "{line}: {answer:?}");
    answer.json()
}

/// Diagnoses a simulated sweep along x with one effect, in `folder`. Returns the answer; the command writes
/// `found/extended.toml`.
fn diagnosed(folder: &Path, effect: &str) -> Value {
    std::fs::copy(cases().join(CASE), folder.join(CASE)).expect("the case can be copied");
    run(
        folder,
        &format!(
            "simulate {CASE} --experiment sweep --direction x --frequency-hz 10:25:2 --force-n 20 --noise-percent 1 {effect} --out measured.csv"
        ),
    );
    run(folder, &format!("diagnose {CASE} measured.csv --out found"))
}

#[test]
fn a_spring_that_was_found_moves_the_limits_and_the_table() {
    let folder = folder();
    let folder = folder.path();
    let spring = "--effect cubic-stiffness=-5e12 --effect cubic-stiffness.direction=x";
    let answer = diagnosed(folder, spring);
    assert_eq!(answer["causes"][0]["name"], "cubic-stiffness", "{answer}");
    let [low, high] = [0, 1].map(|end| {
        let end = &answer["gain"]["ci90"][end];
        end.as_f64().expect("the gain has an interval")
    });
    let gain = answer["gain"]["residual_energy_removed"]
        .as_f64()
        .expect("a gain");
    assert!(low < gain && gain <= high && low > 0.9, "{low} {gain} {high}");
    // The extended case must give the cut of the case that contains the hidden spring itself.
    let cut = "--rpm 900 --depth-mm 1 --seconds 3 --ideal";
    let by_hand = format!("simulate {CASE} {cut} {spring} --out truth.csv");
    for line in [
        by_hand,
        format!("simulate {CASE} {cut} --out believed.csv"),
        format!("simulate found/extended.toml {cut} --out extended.csv"),
    ] {
        run(folder, &line);
    }
    let read = |name: &str| {
        let recording = quietcut::recording::Recording::read(folder.join(name)).expect("a recording");
        let x = recording.channels.into_iter().find(|channel| channel.name == "x");
        x.expect("the displacement is there").samples
    };
    let truth = read("truth.csv");
    let apart = |name: &str| {
        let squares = truth.iter().zip(read(name)).map(|(a, b)| (a - b) * (a - b));
        squares.sum::<f64>().sqrt()
    };
    let (believed, extended) = (apart("believed.csv"), apart("extended.csv"));
    assert!(extended < 0.05 * believed, "{extended} of {believed}");

    let limit = |case: &str, rpm: u32| {
        let line = format!("lobes {case} --rpm {rpm}:{}:2 --depth-mm 0.5:12:24", rpm + 1);
        let answer = run(folder, &line);
        answer["speeds"][0]["first_limit"]["depth_mm"]
            .as_f64()
            .expect("a limit")
    };
    assert_ne!(limit(CASE, 900), limit("found/extended.toml", 900));
    assert!(answer["lobes"]["limit_after_mm"].is_number(), "{answer}");

    let [from, error] = lowest(folder, "found/extended.toml");
    let exact = limit("found/extended.toml", 900);
    assert!((from - exact).abs() < error, "{from} {exact} {error}");
}

/// Smallest limit of a lobe table at 900 rev/min, and the table's stated interpolation error, both in mm.
fn lowest(folder: &Path, case: &str) -> [f64; 2] {
    run(
        folder,
        &format!("table {case} --rpm 900:1000:2 --speeds 3 --out a.qct"),
    );
    let table = run(folder, "table --show a.qct");
    let from = &table["layers"][0]["speeds"][0]["unstable"][0]["from_mm"];
    [from, &table["interpolation_error"]["depth_mm"]].map(|number| number.as_f64().expect("a number"))
}

#[test]
fn a_drift_that_was_found_has_limits_for_every_moment() {
    let folder = folder();
    let folder = folder.path();
    let answer = diagnosed(folder, "--effect drift=0.02");
    assert_eq!(answer["causes"][0]["name"], "drift", "{answer}");
    for line in [
        "lobes found/extended.toml --rpm 900:901:2 --depth-mm 0.5:6:12",
        "table found/extended.toml --rpm 900:1000:2 --speeds 3 --out a.qct",
    ] {
        let arguments: Vec<&str> = line.split_whitespace().collect();
        let refused = quietcut(folder, &arguments);
        assert_eq!(refused.status, Some(2), "{refused:?}");
        assert!(refused.stderr.contains("--after-s"), "{refused:?}");
    }
    let at = |after_s: u32| {
        let case = format!("found/extended.toml --after-s {after_s}");
        let [from, error] = lowest(folder, &case);
        let line = format!("lobes {case} --rpm 900:901:2 --depth-mm 0.5:12:24");
        let limit = run(folder, &line)["speeds"][0]["first_limit"]["depth_mm"].as_f64();
        let limit = limit.expect("a limit");
        assert!((from - limit).abs() < error, "{from} {limit} {error}");
        from
    };
    assert_ne!(at(0), at(600));
}
