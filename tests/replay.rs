//! A measured slot cut with chatter: 4 flutes, 5000 rev/min, 10 kHz, in the cut from 3.5 to 4.9 s. The chatter tone falls from
//! 740 to 690 Hz; the tooth-passing frequency is 333.3 Hz.

#![allow(clippy::unwrap_used, clippy::panic)]

use quietcut_testkit::measured;
use quietcut_tests::command::{folder, quietcut};

#[test]
#[ignore = "measured records: QUIETCUT_DATA names their folder"]
fn the_tone_is_found_in_the_measured_cut_and_nothing_alarming_before() {
    let recording = measured("milling/slot_5000rpm_4flutes.mat");
    let path = recording.to_str().unwrap();
    let run = quietcut(
        folder().path(),
        &["replay", path, "--rpm", "5000", "--teeth", "4", "--json"],
    );
    let answer = run.json();
    println!("{answer:#}");
    let verdicts = answer["verdicts"].as_array().unwrap();
    let chatter: Vec<(f64, f64)> = verdicts
        .iter()
        .filter(|verdict| matches!(verdict["verdict"].as_str(), Some("hopf" | "period-doubling")))
        .map(|verdict| {
            (
                verdict["t_s"].as_f64().unwrap(),
                verdict["chatter_hz"].as_f64().unwrap_or(f64::NAN),
            )
        })
        .collect();
    let (first_s, first_hz) = chatter
        .first()
        .copied()
        .unwrap_or_else(|| panic!("no chatter: {answer:#}"));
    assert!((3.5..4.9).contains(&first_s), "first called at {first_s} s");
    assert!((690.0..=740.0).contains(&first_hz), "called at {first_hz} Hz");
    for verdict in verdicts {
        let t_s = verdict["t_s"].as_f64().unwrap();
        let word = verdict["verdict"].as_str().unwrap();
        if t_s < 3.5 {
            assert!(
                ["air-cut", "stable", "indeterminate"].contains(&word),
                "{word} at {t_s} s, before the cut"
            );
        }
    }
}

#[test]
fn one_object_a_line_holds_what_one_object_holds() {
    let folder = folder();
    let case = quietcut_tests::command::cases().join("kuka-kr90-acetal.toml");
    let made = format!(
        "simulate {} --rpm 1045 --depth-mm 2 --seconds 4 --out cut.csv",
        case.display()
    );
    let arguments: Vec<&str> = made.split_whitespace().collect();
    assert_eq!(quietcut(folder.path(), &arguments).status, Some(0));
    let whole = quietcut(folder.path(), &["replay", "cut.csv", "--json"]).json();
    let lines = quietcut(folder.path(), &["replay", "cut.csv", "--json-lines"]);
    assert_eq!(lines.status, Some(0), "{lines:?}");
    let lines: Vec<serde_json::Value> = lines
        .stdout
        .lines()
        .map(|line| serde_json::from_str(line).unwrap())
        .collect();
    let (last, verdicts) = lines.split_last().unwrap();
    assert_eq!(whole["verdicts"].as_array().unwrap(), verdicts);
    assert_eq!(whole["summary"], last["summary"]);
    quietcut(folder.path(), &["replay", "cut.csv", "--json", "--json-lines"]).refused(&["--json-lines"]);
}
