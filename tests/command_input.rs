//! Wrong input gives one message that names file, line or key, the wrong value and the valid values. The exit status is 2, and
//! no file is written.
#![allow(clippy::expect_used)]

use std::fs;
use std::path::Path;

use quietcut_tests::command::{Outcome, cases, folder, quietcut};

const RECORDING: &str = "t [s],ax [m/s^2],tacho [1]\n0,0.1,0\n0.0001,0.2,1\n0.0002,0.1,0\n";

fn case_text() -> String {
    fs::read_to_string(cases().join("kuka-kr90-acetal.toml")).expect("the case is there")
}

/// Runs `quietcut lobes` on a case file in which the text `right` is replaced by `wrong`.
fn with(folder: &Path, right: &str, wrong: &str) -> Outcome {
    let text = case_text();
    assert!(text.contains(right), "{right}");
    fs::write(folder.join("case.toml"), text.replacen(right, wrong, 1)).expect("a file can be written");
    quietcut(folder, &["lobes", "case.toml", "--at", "900,2"])
}

#[test]
fn wrong_cases() {
    let folder = folder();
    let with = |right, wrong| with(folder.path(), right, wrong);
    with("teeth = 2", "teeth = 2\nflutes = 2").refused(&["case.toml", "line", "flutes"]);
    with("teeth = 2", "teeth = 0").refused(&["case.toml", "line", "tool.teeth", "found 0"]);
    with("teeth = 2", "teeth = -2").refused(&["case.toml", "teeth"]);
    with("teeth = 2", "teeth = \"two\"").refused(&["case.toml", "line", "teeth"]);
    with("feed_per_tooth_mm = 0.15", "feed_per_tooth_mm = -0.15").refused(&[
        "case.toml",
        "line",
        "cut.feed_per_tooth_mm",
        "-0.15",
    ]);
    with("damping_ratio = 0.0285", "damping_ratio = nan").refused(&["case.toml", "line", "damping_ratio"]);
    with("[tool]", "[tool").refused(&["case.toml", "line"]);
    with("[material]", "[matter]").refused(&["case.toml", "line", "matter"]);
    fs::write(folder.path().join("case.toml"), [0xff, 0xfe]).expect("a file can be written");
    quietcut(folder.path(), &["lobes", "case.toml", "--at", "900,2"]).refused(&["case.toml", "UTF-8"]);
}

#[test]
fn missing_files() {
    let folder = folder();
    let run = |arguments: &[&str]| quietcut(folder.path(), arguments).refused(&["no.such", "cannot read"]);
    run(&["lobes", "no.such", "--at", "900,2"]);
    run(&["table", "no.such", "--out", "a.qct"]);
    run(&["table", "--show", "no.such"]);
    run(&[
        "simulate",
        "no.such",
        "--rpm",
        "900",
        "--depth-mm",
        "2",
        "--seconds",
        "2",
        "--out",
        "a.csv",
    ]);
    run(&["replay", "no.such"]);
    run(&["upload", "simulated", "no.such"]);
    let left = fs::read_dir(folder.path()).expect("the folder is there").count();
    assert_eq!(left, 0);
}

#[test]
fn wrong_numbers_of_a_cut() {
    let folder = folder();
    fs::write(folder.path().join("case.toml"), case_text()).expect("a file can be written");
    let run = |arguments: &[&str]| quietcut(folder.path(), arguments);
    let simulate = |rpm, depth| {
        run(&[
            "simulate",
            "case.toml",
            "--rpm",
            rpm,
            "--depth-mm",
            depth,
            "--seconds",
            "2",
            "--out",
            "a.csv",
        ])
    };
    simulate("900", "-2").refused(&["--depth-mm", "-2", "greater than 0"]);
    simulate("0", "2").refused(&["--rpm", "0", "greater than 0"]);
    simulate("fast", "2").refused(&["--rpm", "fast", "not a number"]);
    run(&["table", "case.toml", "--depth-mm", "-1", "--out", "a.qct"]).refused(&[
        "--depth-mm",
        "-1",
        "greater than 0",
    ]);
    run(&["lobes", "case.toml", "--at", "900,-2"]).refused(&["-2"]);
    run(&["lobes", "case.toml", "--at", "900"]).refused(&["900", "RPM,MM"]);
    run(&["lobes", "case.toml", "--rpm", "600:900:4", "--depth-mm=-1:2:5"])
        .refused(&["--depth-mm", "greater than 0"]);
    run(&[
        "simulate",
        "case.toml",
        "--rpm",
        "900",
        "--depth-mm",
        "2",
        "--seconds",
        "2",
        "--out",
        "no/such/a.csv",
    ])
    .refused(&["no/such/a", "cannot write"]);
    assert!(!folder.path().join("a.csv").exists());
}

#[test]
fn wrong_recordings() {
    let folder = folder();
    let replay = |text: &str, more: &[&str]| {
        fs::write(folder.path().join("a.csv"), text).expect("a file can be written");
        quietcut(folder.path(), &[&["replay", "a.csv"], more].concat())
    };
    let teeth = &["--teeth", "2"][..];
    replay(&RECORDING.replace("0.2,1", "0.2x,1"), teeth).refused(&["a.csv", "3", "0.2x"]);
    replay(&RECORDING.replace("0.2,1", "0.2"), teeth).refused(&["a.csv", "3"]);
    replay(&RECORDING.replace("m/s^2", "furlong"), teeth).refused(&["a.csv", "furlong"]);
    replay(&RECORDING.replace("0.0002", "0.0009"), teeth).refused(&["a.csv"]);
    replay("", teeth).refused(&["a.csv"]);
    replay(RECORDING, &[]).refused(&["a.csv", "teeth"]);
    replay(RECORDING, &["--teeth", "0"]).refused(&["--teeth", "0"]);
    replay(
        &RECORDING
            .replace(",tacho [1]", "")
            .replace(",0\n", "\n")
            .replace(",1\n", "\n"),
        teeth,
    )
    .refused(&["a.csv", "tacho", "--rpm"]);
    replay(RECORDING, &["--teeth", "2", "--table", "a.csv"]).refused(&["a.csv", "QCLT"]);
    replay(RECORDING, &["--teeth", "2", "--port", "/dev/no-such-port"]).refused(&["/dev/no-such-port"]);
}

#[test]
fn samples_that_are_no_numbers_are_refused_or_left_out_by_every_verb() {
    let folder = folder();
    fs::write(folder.path().join("case.toml"), case_text()).expect("a file can be written");
    let text = RECORDING.replace("0.0002,0.1", "0.0002,nan") + "0.0003,0.1,0\n";
    fs::write(folder.path().join("a.csv"), text).expect("a file can be written");
    let verbs: [&[&str]; 4] = [
        &["frf", "a.csv"],
        &[
            "identify",
            "a.csv",
            "--method",
            "output-only",
            "--band-hz",
            "5,60",
        ],
        &["diagnose", "case.toml", "a.csv"],
        &["replay", "a.csv", "--teeth", "2"],
    ];
    for verb in verbs {
        let with = |more: &[&str]| quietcut(folder.path(), &[verb, more].concat());
        with(&[]).refused(&[
            "a.csv, line 4",
            "\"nan\" in column \"ax\"",
            "--from-s",
            "--until-s",
        ]);
        with(&["--from-s", "0.0001"]).refused(&["a.csv", "\"ax\"", "sample 3 at 0.0002 s is NaN"]);
        with(&["--until-s", "0.0001"]).refused(&["a.csv", "--until-s 0.0001 leaves 1 samples", "0.0003 s"]);
        // The segment before the NaN may be refused as too short, but it contains no NaN that a message could name.
        let before = with(&["--until-s", "0.0002"]);
        assert!(
            !before.stderr.contains("NaN") && !before.stderr.contains("nan"),
            "{before:?}"
        );
    }
}

#[test]
fn wrong_sidecars_of_recordings() {
    let folder = folder();
    let replay = |sidecar: &str| {
        let sidecar = format!("kind = \"cutting\"\n{sidecar}");
        fs::write(folder.path().join("a.csv"), RECORDING).expect("a file can be written");
        fs::write(folder.path().join("a.toml"), sidecar).expect("a file can be written");
        quietcut(folder.path(), &["replay", "a.csv"])
    };
    replay("[cut]\nteeth = 0").refused(&["a.toml", "cut.teeth = 0", "greater than 0"]);
    replay("[cut]\nteeth = 2\naxial_depth_mm = -2").refused(&[
        "a.toml",
        "cut.axial_depth_mm = -2",
        "0 or more",
    ]);
    replay("[cut]\nflutes = 2").refused(&["a.toml", "line", "flutes"]);
}

#[test]
fn files_that_are_no_tables() {
    let folder = folder();
    let run = |arguments: &[&str]| quietcut(folder.path(), arguments);
    let good = quietcut_tests::small_table::table("good", 1.5, 20);
    fs::write(folder.path().join("a.csv"), RECORDING).expect("a file can be written");
    let changed = |at: usize| {
        let mut bytes = good.clone();
        bytes[at] ^= 4;
        bytes
    };
    for (content, words) in [
        (changed(good.len() / 2), ["CRC-32", "the bytes have changed"]),
        (changed(4), ["schema 5", "known are 1 to 2"]),
        (changed(0), ["a.qct", "QCLT"]),
        (good[..good.len() - 7].to_vec(), ["bytes", "header"]),
        (Vec::new(), ["a.qct", "bytes"]),
    ] {
        fs::write(folder.path().join("a.qct"), content).expect("a file can be written");
        for arguments in [
            &["table", "--show", "a.qct"][..],
            &["upload", "simulated", "a.qct"],
            &["replay", "a.csv", "--teeth", "2", "--table", "a.qct"],
            &[
                "replay",
                "a.csv",
                "--teeth",
                "2",
                "--table",
                "a.qct",
                "--port",
                "simulated",
            ],
        ] {
            run(arguments).refused(&["a.qct", words[0], words[1]]);
        }
    }
}

#[test]
fn a_reader_that_stops_is_no_error() {
    let folder = folder();
    fs::write(folder.path().join("case.toml"), case_text()).expect("a file can be written");
    let mut running = quietcut_tests::command::start(
        folder.path(),
        &[
            "lobes",
            "case.toml",
            "--rpm",
            "600:2400:400",
            "--depth-mm",
            "0.1:4:40",
        ],
    );
    running.stop_reading();
    let outcome = running.finish();
    assert_eq!(
        (outcome.status, outcome.stderr.as_str()),
        (Some(0), ""),
        "{outcome:?}"
    );
}
