//! From an empty folder to a chart: `setup` and `next`, on a virtual machine that only the recordings know.

#![allow(clippy::expect_used, clippy::panic)]

use std::fs;
use std::path::{Path, PathBuf};
use std::time::{Duration, SystemTime};

use quietcut_tests::command::{folder, quietcut};
use serde_json::Value;

const SETUP: &[&str] = &[
    "setup",
    "mill",
    "--teeth",
    "2",
    "--diameter-mm",
    "12.7",
    "--ktc-mpa",
    "119",
    "--krc-mpa",
    "20.23",
    "--kac-mpa",
    "39.27",
    "--down-milling-mm",
    "6.35",
    "--feed-per-tooth-mm",
    "0.15",
    "--rpm",
    "600:2400",
];

fn virtual_machine() -> String {
    PathBuf::from(env!("CARGO_MANIFEST_DIR"))
        .join("cases/kuka-kr90-acetal.toml")
        .display()
        .to_string()
}

fn done(folder: &Path, line: &str) -> String {
    let arguments: Vec<&str> = line.split_whitespace().collect();
    let answer = quietcut(folder, &arguments);
    assert_eq!(answer.status, Some(0), "{line}: {answer:?}");
    answer.stdout
}

fn next(folder: &Path) -> Value {
    let step: Value = serde_json::from_str(&done(folder, "next mill --json")).expect("one JSON object");
    for key in ["command", "why"] {
        assert!(step[key].as_str().is_some_and(|text| !text.is_empty()), "{step}");
    }
    assert!(
        step["state"].as_array().is_some_and(|state| !state.is_empty()),
        "{step}"
    );
    step
}

/// Files made within one tick of the clock of the file system have one age: the folder is made older before each step.
fn age(folder: &Path) {
    let walk = |folder: &Path| -> Vec<PathBuf> {
        let entries = fs::read_dir(folder).expect("a folder");
        entries.map(|entry| entry.expect("an entry").path()).collect()
    };
    let mut paths = walk(folder);
    while let Some(path) = paths.pop() {
        if path.is_dir() {
            paths.extend(walk(&path));
            continue;
        }
        let changed = fs::metadata(&path).expect("a file").modified().expect("a time");
        let file = fs::File::options().write(true).open(&path).expect("a file");
        file.set_modified(changed - Duration::from_secs(10)).expect("set");
    }
}

#[test]
fn ten_commands_lead_from_an_empty_folder_to_a_chart_and_a_table() {
    let folder = folder();
    let folder = folder.path();
    let mut commands = 1;
    let answer = quietcut(folder, SETUP);
    assert_eq!(answer.status, Some(0), "{answer:?}");
    assert!(answer.stdout.contains("taps/x.csv"), "{answer:?}");
    let case = fs::read_to_string(folder.join("mill/case.toml")).expect("the case");
    for words in ["start_deg = 90.0", "rpm_max = 2400.0", "ktc_mpa = 119.0"] {
        assert!(case.contains(words), "{words}: {case}");
    }
    assert!(next(folder)["why"].as_str().expect("why").contains("tap"));
    // The laboratory: a machine that the folder does not know.
    for (axis, seed) in [("x", 1), ("y", 2)] {
        done(
            folder,
            &format!(
                "simulate {} --experiment hammer --direction {axis} --force-n 300 --sample-rate-hz 512 --noise-percent 1 \
                 --seed {seed} --out mill/taps/{axis}.csv",
                virtual_machine()
            ),
        );
    }
    for verb in ["frf", "identify", "lobes", "table", "plan"] {
        age(folder);
        let step = next(folder);
        let command = step["command"].as_str().expect("a command");
        assert_eq!(command.split_whitespace().nth(1), Some(verb), "{step}");
        done(folder, command.strip_prefix("quietcut ").expect("quietcut"));
        commands += 1;
    }
    assert!(commands <= 10);
    assert!(folder.join("mill/lobes.html").exists() && folder.join("mill/table.qct").exists());
    // The limits are those of the machine that was tapped, within what 1 % of noise and z left out may do.
    let limit = |case: &str| -> f64 {
        let line = format!("lobes {case} --rpm 1100 --depth-mm 8 --nominal --json");
        let answer: Value = serde_json::from_str(&done(folder, &line)).expect("one JSON object");
        answer["speeds"][0]["first_limit"]["depth_mm"]
            .as_f64()
            .expect("a limit")
    };
    let (found, truth) = (limit("mill/case.toml"), limit(&virtual_machine()));
    assert!((found / truth - 1.0).abs() < 0.1, "{found} for {truth}");
    // The outcome of a cut that was recorded later is added to the table of tried cuts, and then compared with the chart.
    age(folder);
    done(
        folder,
        &format!(
            "simulate {} --rpm 900 --depth-mm 1 --seconds 2 --out mill/cuts/first.csv",
            virtual_machine()
        ),
    );
    let command = next(folder)["command"].as_str().expect("a command").to_string();
    let replay = "replay mill/cuts/first.csv --table mill/table.qct --tried mill/tried.csv";
    assert_eq!(command, format!("quietcut {replay}"));
    age(folder);
    done(folder, replay);
    let command = next(folder)["command"].to_string();
    assert!(
        command.contains("lobes mill/case.toml") && command.contains("--cuts mill/tried.csv"),
        "{command}"
    );
}

#[test]
fn what_is_missing_is_named_with_the_option_that_gives_it() {
    let folder = folder();
    let folder = folder.path();
    quietcut(folder, &SETUP[..4]).refused(&["--diameter-mm", "--material", "--feed-per-tooth-mm", "--rpm"]);
    assert!(!folder.join("mill").exists());
    let with = |old: &str, new: &'static str| -> Vec<&'static str> {
        let change = |word: &&'static str| if *word == old { new } else { *word };
        SETUP.iter().map(change).collect()
    };
    quietcut(folder, &with("600:2400", "600")).refused(&["--rpm 600", "first:last"]);
    quietcut(folder, &with("6.35", "20")).refused(&["--down-milling-mm 20", "12.7"]);
    quietcut(
        folder,
        &[&SETUP[..6], &["--material", "cheese"], &SETUP[12..]].concat(),
    )
    .refused(&["cheese", "aluminium-alloy", "--ktc-mpa"]);
    quietcut(folder, &["next", "mill"]).refused(&["mill", "quietcut setup mill"]);
    // A number of teeth that no case can have leaves nothing behind.
    quietcut(folder, &with("2", "100")).refused(&["teeth", "64"]);
    assert!(!folder.join("mill").exists());
    // A file completes the options, and options win.
    fs::write(
        folder.join("answers.toml"),
        "teeth = 3\ndiameter-mm = 10.0\nmaterial = \"aluminium-alloy\"\nslot = true\nfeed-per-tooth-mm = 0.05\nrpm = \"1000:20000\"\nmachine = \"VMC 40\"\n",
    )
    .expect("written");
    done(folder, "setup mill --answers answers.toml --teeth 4");
    let case = fs::read_to_string(folder.join("mill/case.toml")).expect("the case");
    for words in [
        "teeth = 4",
        "# machine: VMC 40",
        "ktc_mpa_std",
        "exit_deg = 180.0",
        "table 5",
    ] {
        assert!(case.contains(words), "{words}: {case}");
    }
    quietcut(folder, &["next", "mill/case.toml"]).refused(&["mill/case.toml", "give the folder"]);
    // What is there is not replaced unasked.
    quietcut(folder, &["setup", "mill", "--answers", "answers.toml"])
        .refused(&["mill/case.toml", "--replace"]);
    done(folder, "setup mill --answers answers.toml --replace");
    assert!(
        fs::metadata(folder.join("mill/case.toml"))
            .expect("a file")
            .modified()
            .expect("a time")
            <= SystemTime::now()
    );
    // An unknown key of the file is named with its line.
    fs::write(folder.join("wrong.toml"), "teeth = 3\ndiametre-mm = 10.0\n").expect("written");
    quietcut(folder, &["setup", "other", "--answers", "wrong.toml"]).refused(&[
        "wrong.toml",
        "line 2",
        "diametre-mm",
    ]);
}

#[test]
fn a_case_without_limits_is_completed_once() {
    let folder = folder();
    let folder = folder.path();
    fs::create_dir(folder.join("mill")).expect("a folder");
    let before = fs::read_to_string(virtual_machine()).expect("a case");
    let path = folder.join("mill/case.toml");
    fs::write(&path, &before).expect("written");
    let step = next(folder);
    assert_eq!(step["command"], "quietcut setup mill --rpm FIRST:LAST", "{step}");
    quietcut(folder, &["setup", "mill"]).refused(&["setup needs --rpm;"]);
    quietcut(folder, &["setup", "mill", "--rpm", "600:2400", "--teeth", "3"]).refused(&["--teeth", "[tool]"]);
    done(folder, "setup mill --rpm 600:2400");
    let after = fs::read_to_string(&path).expect("the case");
    assert!(after.starts_with(before.trim_end()), "{after}");
    assert!(
        after.contains("rpm_min = 600.0") && after.contains("rpm_max = 2400.0"),
        "{after}"
    );
    // It is asked once: the chart is next, within the limits.
    let command = next(folder)["command"].to_string();
    assert!(
        command.contains("lobes mill/case.toml --rpm 600:2400:"),
        "{command}"
    );
    quietcut(folder, &["setup", "mill", "--rpm", "600:2400"]).refused(&["complete", "--replace"]);
    // Any section that is missing is asked for and added.
    let without_cut = before.replace("[cut]", "[limits]\nrpm_min = 600.0\nrpm_max = 2400.0\n#");
    let without_cut: Vec<&str> = without_cut
        .lines()
        .filter(|line| {
            !["start_deg", "exit_deg", "feed_per"]
                .iter()
                .any(|key| line.starts_with(key))
        })
        .collect();
    fs::write(&path, without_cut.join("\n")).expect("written");
    quietcut(folder, &["setup", "mill"]).refused(&["--down-milling-mm", "--feed-per-tooth-mm"]);
    done(
        folder,
        "setup mill --down-milling-mm 6.35 --feed-per-tooth-mm 0.15",
    );
    let after = fs::read_to_string(&path).expect("the case");
    assert!(
        after.contains("start_deg = 90.0") && after.contains("feed_per_tooth_mm = 0.15"),
        "{after}"
    );
}

#[test]
fn materials_are_listed_with_their_sources() {
    let folder = folder();
    let answer: Value =
        serde_json::from_str(&done(folder.path(), "setup --materials --json")).expect("one JSON object");
    for row in answer["materials"].as_array().expect("rows") {
        assert!(
            row["source"].as_str().is_some_and(|source| source.contains("20")),
            "{row}"
        );
        assert!(row["ktc_mpa"][0].as_f64().is_some_and(|ktc| ktc > 0.0), "{row}");
    }
}
