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
