//! `quietcut demo`: its results are correct, and it needs no other file.
#![allow(clippy::expect_used, clippy::panic)]

use std::fs;

use quietcut_tests::command::{folder, quietcut};
use serde_json::Value;

fn number(value: &Value) -> f64 {
    value.as_f64().unwrap_or_else(|| panic!("{value} is no number"))
}

#[test]
fn chatter_is_detected_and_the_advised_cut_is_quiet() {
    let folder = folder();
    let answer = quietcut(folder.path(), &["demo", "--out", "shown", "--json"]).json();
    // Largest time that the help promises, on two cores. Two seconds were measured on an idle machine.
    assert!(number(&answer["seconds"]) < 60.0, "{answer}");

    let stories = answer["stories"].as_array().expect("stories");
    assert_eq!(stories.len(), 2);
    for (story, rpm, verdict, chatter_hz) in [
        // The chatter frequency of a flip is half the tooth-passing frequency.
        (&stories[0], 1045.0, "period-doubling", 1045.0 / 60.0),
        // The chatter frequency of a Hopf bifurcation, from the angle of the dominant Floquet multiplier.
        (&stories[1], 900.0, "hopf", 17.4718),
    ] {
        let (first, advised) = (&story["first"], &story["advised"]);
        assert_eq!((number(&first["rpm"]), number(&first["depth_mm"])), (rpm, 2.0));
        let alarm = &first["alarm"];
        assert_eq!(alarm["verdict"], verdict, "{first}");
        // The tolerance is a tenth of a bin of the device's spectrum: 0.8 Hz.
        assert!(
            (number(&alarm["chatter_hz"]) - chatter_hz).abs() < 0.08,
            "{alarm}"
        );
        assert_eq!(alarm["advice"]["source"], "table");
        assert_eq!(alarm["advice"]["action"], "speed");
        assert_eq!(
            number(&alarm["advice"]["rpm"]) as f32,
            number(&advised["rpm"]) as f32
        );
        assert!(advised["alarm"].is_null(), "{advised}");
        assert_eq!(advised["verdict"], "stable");
        let loudest = |trial: &Value| {
            let axes = trial["vibration_m_per_s2"].as_array().expect("three axes");
            axes.iter().map(number).fold(0.0, f64::max)
        };
        // The first cut has chatter besides the forced vibration, the advised cut only the forced vibration.
        assert!(loudest(first) > 2.0 * loudest(advised), "{story}");
    }

    let report = fs::read_to_string(folder.path().join("shown/report.html")).expect("the report is there");
    // The report has one chart, and for each of four cuts a signal, a spectrum and the samples once per tooth.
    assert_eq!(report.matches("<svg").count(), 13);
    assert!(report.trim_end().ends_with("</html>"));
    for outside in ["<script", "<link", "src=", "url("] {
        assert!(!report.contains(outside), "{outside}");
    }
    let shown = quietcut(folder.path(), &["table", "--show", "shown/lobes.qct", "--json"]).json();
    assert_eq!(shown["name"], "kuka-kr90-acetal");
    let left: Vec<_> = fs::read_dir(folder.path().join("shown"))
        .expect("the folder is there")
        .collect();
    assert_eq!(left.len(), 2, "{left:?}");
}

#[test]
fn the_demo_prints_its_results_and_a_second_run_repeats_them() {
    let folder = folder();
    let tell = |out: &str| {
        let told = quietcut(folder.path(), &["demo", "--out", out]);
        assert_eq!(told.status, Some(0), "{told:?}");
        told.stdout
    };
    let (first, second) = (tell("a"), tell("b"));
    for said in ["period doubling", "Hopf", "go to ", "QUIET", "a/report.html"] {
        assert!(first.contains(said), "`{said}` is not in {first}");
    }
    let report =
        |out: &str| fs::read(folder.path().join(out).join("report.html")).expect("the report is there");
    assert!(
        report("a") == report("b"),
        "two runs must not differ: {first}\n{second}"
    );
}

#[test]
fn a_folder_that_cannot_be_made_is_named() {
    let folder = folder();
    fs::write(folder.path().join("taken"), "").expect("a file can be written");
    quietcut(folder.path(), &["demo", "--out", "taken"]).refused(&["--out taken", "cannot make the folder"]);
}
