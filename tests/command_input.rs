//! Wrong input gives one message that names file, line or key, the wrong value and the valid values. The exit status is 2, and
//! no file is written.
#![allow(clippy::expect_used)]

use std::fs;
use std::path::Path;

use quietcut_tests::command::{Outcome, WORKING_POINT, cases, done, folder, quietcut, words};

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
        (changed(4), ["schema 5", "known are 1 to 3"]),
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

#[test]
fn a_missing_section_or_key_names_all_that_is_missing_with_units() {
    let folder = folder();
    let text = case_text();
    let at = text.find("[material]").expect("a section");
    let until = text.find("[cut]").expect("a section");
    let run = |text: String| {
        fs::write(folder.path().join("case.toml"), text).expect("a file can be written");
        quietcut(folder.path(), &["lobes", "case.toml", "--at", "900,2"])
    };
    let all = ["ktc_mpa (MPa", "krc_mpa (MPa", "kac_mpa (MPa", "\n  ktc_mpa = "];
    run(format!("{}{}", &text[..at], &text[until..])).refused(&[&["add [material]"][..], &all].concat());
    run(format!("{}[material]\n{}", &text[..at], &text[until..]))
        .refused(&[&["line", "[material] lacks"][..], &all].concat());
    let one = run(text.replace("krc_mpa", "# krc_mpa"));
    one.refused(&["[material] lacks krc_mpa (MPa"]);
    assert!(!one.stderr.contains("kac_mpa"), "{one:?}");
}

#[test]
fn sizes_of_no_machine_are_refused_with_the_unit_that_was_meant() {
    let folder = folder();
    let with = |right, wrong| with(folder.path(), right, wrong);
    with("diameter_mm = 12.7", "diameter_mm = 12700").refused(&["tool.diameter_mm", "12700", "12.7", "µm"]);
    with("feed_per_tooth_mm = 0.15", "feed_per_tooth_mm = 150").refused(&["feed_per_tooth_mm", "0.15", "µm"]);
    with("ktc_mpa = 119.0", "ktc_mpa = 119e6").refused(&["material.ktc_mpa", "119", "Pa"]);
    with(
        "start_deg = 90.0\nexit_deg = 180.0",
        "start_deg = 180.0\nexit_deg = 90.0",
    )
    .refused(&["start_deg", "found 180", "exit_deg", "swapped"]);
}

#[test]
fn a_structure_that_is_a_thousand_times_too_soft_is_named_before_the_computation() {
    let folder = folder();
    let shown = with(folder.path(), "right = [[-0.002057", "right = [[-2.057");
    assert_eq!(shown.status, Some(0), "{shown:?}");
    assert!(
        shown.stderr.contains("structure in x is implausible")
            && shown.stderr.contains("factor such as 1000"),
        "{shown:?}"
    );
}

#[test]
fn ranges_have_one_form_and_missing_options_are_named_at_once() {
    let folder = folder();
    fs::write(folder.path().join("case.toml"), case_text()).expect("a file can be written");
    let run = |arguments: &[&str]| quietcut(folder.path(), arguments);
    run(&["lobes", "case.toml"]).refused(&["--rpm", "--depth-mm", "--at"]);
    run(&["lobes", "case.toml", "--rpm", "600:900:4"]).refused(&["--depth-mm"]);
    run(&["lobes", "case.toml", "--at", "900,2", "--out", "a.svg"]).refused(&[
        "--out",
        "--rpm",
        "--depth-mm",
    ]);
    run(&[
        "lobes",
        "case.toml",
        "--rpm",
        "-900:1200:3",
        "--depth-mm",
        "0:3:4",
    ])
    .refused(&["--rpm=-900:1200:3", "dash"]);
    run(&["lobes", "case.toml", "--rpm", "700-2000", "--depth-mm", "0:3:4"])
        .refused(&["write 700:2000", "600:2400:91"]);
    fs::write(folder.path().join("a.csv"), RECORDING).expect("a file can be written");
    let identify = ["identify", "a.csv", "--method", "output-only", "--band-hz"];
    run(&[&identify[..], &["10-30"]].concat()).refused(&["10:30", "first:last"]);
    for band in ["10:30", "10,30"] {
        // The band is read; the recording is too short for the method.
        let refused = run(&[&identify[..], &[band]].concat());
        assert!(!refused.stderr.contains("--band-hz <"), "{refused:?}");
    }
}

#[test]
fn an_output_file_has_an_ending_of_its_format() {
    let folder = folder();
    fs::write(folder.path().join("case.toml"), case_text()).expect("a file can be written");
    fs::write(folder.path().join("a.csv"), RECORDING).expect("a file can be written");
    let run = |arguments: &[&str]| quietcut(folder.path(), arguments);
    run(&["table", "case.toml", "--out", "x.csv"]).refused(&[".qct", "x.qct"]);
    run(&["identify", "a.csv", "--method", "modes", "--out", "x.csv"]).refused(&[".toml", "x.toml"]);
    run(&["frf", "a.csv", "--out", "x.xlsx"]).refused(&[".csv", ".uff", ".html", "x.csv"]);
    run(&[
        "lobes",
        "case.toml",
        "--rpm",
        "600:900:4",
        "--depth-mm",
        "0:3:4",
        "--out",
        "x.png",
    ])
    .refused(&[".svg", "x.svg"]);
    run(&["diagnose", "case.toml", "a.csv", "--out", "x.html"]).refused(&["folder", "report.html"]);
}

#[test]
fn a_case_is_no_sidecar_and_a_lobe_table_no_recording() {
    let folder = folder();
    fs::write(folder.path().join("a.toml"), case_text()).expect("a file can be written");
    fs::write(folder.path().join("a.csv"), RECORDING).expect("a file can be written");
    fs::write(folder.path().join("a.qct"), "QCLT").expect("a file can be written");
    let look = |name: &str| quietcut(folder.path(), &["look", name]);
    look("a.qct").refused(&["a.qct", "table --show"]);
    look("a.toml").refused(&["a.toml", "case"]);
    look("a.csv").refused(&["a.toml", "this is a case, not the sidecar of a.csv"]);
}

#[test]
fn options_that_contradict_what_is_known_are_refused() {
    let folder = folder();
    fs::write(folder.path().join("a.csv"), RECORDING).expect("a file can be written");
    fs::write(
        folder.path().join("a.toml"),
        "kind = \"cutting\"\n[cut]\nteeth = 2\n",
    )
    .expect("a file can be written");
    quietcut(folder.path(), &["replay", "a.csv", "--teeth", "3"]).refused(&[
        "--teeth 3",
        "a.toml",
        "cut.teeth = 2",
    ]);
    let table = quietcut_tests::small_table::table("good", 1.5, 20);
    fs::write(folder.path().join("a.qct"), table).expect("a file can be written");
    let point = |more: &[&str]| {
        let cut = ["working-point", "simulated"];
        quietcut(folder.path(), &[&cut, &words(WORKING_POINT)[..], more].concat())
    };
    point(&["--posture", "99", "--table", "a.qct"]).refused(&["--posture 99", "posture.index"]);
    let sent = quietcut(
        folder.path(),
        &["upload", "simulated", "a.qct", "--state", "device.bin"],
    );
    assert_eq!(sent.status, Some(0), "{sent:?}");
    point(&["--posture", "99", "--state", "device.bin"]).refused(&["--posture 99", "posture.index"]);
    let set = point(&["--posture", "0", "--state", "device.bin"]);
    assert_eq!(set.status, Some(0), "{set:?}");
}

#[test]
fn a_broken_file_of_a_machine_is_the_next_step() {
    let folder = folder();
    let mill = folder.path().join("mill");
    fs::create_dir_all(mill.join("taps")).expect("a folder can be made");
    fs::write(mill.join("case.toml"), case_text()).expect("a file can be written");
    let next = |words: [&str; 3]| {
        let step = quietcut(folder.path(), &["next", "mill", "--json"]).json();
        let (command, why) = (step["command"].to_string(), step["why"].to_string());
        assert!(command.contains(words[0]) && why.contains(words[1]), "{step}");
        assert!(step["state"].to_string().contains(words[2]), "{step}");
    };
    fs::write(mill.join("tried.csv"), "rpm,depth_mm,verdict\n900,1,loud\n").expect("a file can be written");
    next(["--cuts mill/tried.csv", "line 2", "tried.csv cannot be read"]);
    fs::write(mill.join("taps/x.csv"), "t [s],fx [N]\n0,1\n0.1,broken\n").expect("a file can be written");
    next(["look mill/taps/x.csv", "broken", "x.csv cannot be read"]);
}

#[test]
fn comments_of_a_case_survive_an_identification_into_it() {
    let folder = folder();
    let run = |line: &str| done(folder.path(), line);
    fs::write(folder.path().join("virtual.toml"), case_text()).expect("a file can be written");
    let text = case_text();
    let tool = text.find("[tool]").expect("a section");
    let own = format!("# My machine.\nname = \"mill\"\n\n# Sharp.\n{}", &text[tool..]);
    fs::write(folder.path().join("case.toml"), own).expect("a file can be written");
    run(
        "simulate virtual.toml --experiment hammer --direction x --force-n 300 --sample-rate-hz 512 --noise-percent 0.1 --out tap-x.csv",
    );
    run(
        "simulate virtual.toml --experiment hammer --direction y --force-n 300 --sample-rate-hz 512 --noise-percent 0.1 --out tap-y.csv",
    );
    run("frf tap-x.csv tap-y.csv --band-hz 10:30 --out frf.csv");
    run("identify frf.csv --method modes --case case.toml --out case.toml");
    let text = fs::read_to_string(folder.path().join("case.toml")).expect("a case");
    for words in ["# My machine.", "# Sharp.", "[structure]", "[uncertainty]"] {
        assert!(text.contains(words), "{words}: {text}");
    }
}

/// A virtual tap test in the words of a file that someone else made.
#[test]
fn swapped_and_inverted_channels_of_a_tap_test_are_named() {
    let folder = folder();
    fs::write(folder.path().join("virtual.toml"), case_text()).expect("a file can be written");
    done(
        folder.path(),
        "simulate virtual.toml --experiment hammer --direction x --force-n 300 --sample-rate-hz 512 --noise-percent 2 \
         --measure acceleration --out tap.csv",
    );
    let text = fs::read_to_string(folder.path().join("tap.csv")).expect("a recording");
    let (head, rows) = text.split_once('\n').expect("a head");
    let swapped = head
        .replace("fx [N]", "other")
        .replace("ax [m/s^2]", "fx [N]")
        .replace("other", "ax [m/s^2]");
    assert_ne!(swapped, head);
    fs::write(folder.path().join("swapped.csv"), format!("{swapped}\n{rows}"))
        .expect("a file can be written");
    let frf = |file: &str, more: &[&str]| {
        let arguments = [&["frf", file, "--band-hz", "10:30"], more].concat();
        quietcut(folder.path(), &arguments)
    };
    frf("swapped.csv", &[]).refused(&[
        "swapped.csv",
        "fx and ax seem to be swapped",
        "--map fx=ax:m/s^2,ax=fx:N",
    ]);
    let mended = frf("swapped.csv", &["--map", "fx=ax:m/s^2,ax=fx:N"]);
    assert_eq!(mended.status, Some(0), "{mended:?}");
    let inverted = frf("tap.csv", &["--map", "ax=-ax", "--excitation", "hammer"]);
    assert!(
        inverted.stderr.contains("sign of an inverted sensor"),
        "{inverted:?}"
    );
    let good = frf("tap.csv", &[]);
    for word in ["swapped", "inverted"] {
        assert!(!good.stderr.contains(word), "{good:?}");
    }
}

#[test]
fn an_ordinary_cut_says_where_it_belongs() {
    let folder = folder();
    fs::write(folder.path().join("virtual.toml"), case_text()).expect("a file can be written");
    done(
        folder.path(),
        "simulate virtual.toml --rpm 900 --depth-mm 1 --seconds 8 --out cut.csv",
    );
    let answer = quietcut(folder.path(), &["frf", "cut.csv", "--band-hz", "10:60"]);
    for expected in ["no impact", "periodic", "quietcut diagnose", "quietcut replay"] {
        assert!(answer.stderr.contains(expected), "{expected}: {answer:?}");
    }
    // Between the lines of a periodic force the receptance is noise, and so is the sign of its imaginary part.
    assert!(
        !answer.stderr.contains("sign of an inverted sensor"),
        "{answer:?}"
    );
}
