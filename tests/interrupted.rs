//! Ctrl-C during a long command: the output file is complete or unchanged, no temporary file remains, and the exit status is
//! 130. On a terminal a long command shows its progress.
#![allow(clippy::expect_used)]

use std::fs::{self, OpenOptions};
use std::path::Path;
use std::time::{Duration, Instant};

use quietcut::device::pseudo_terminal::PseudoTerminal;
use quietcut_tests::command::{Outcome, cases, folder, quietcut, start, start_on};

/// Exit status of a command that was interrupted by Ctrl-C.
const INTERRUPTED: Option<i32> = Some(130);

/// Time after which a test stops to wait for an event and ends the command.
const PATIENCE: Duration = Duration::from_secs(60);

fn case(folder: &Path) {
    fs::copy(cases().join("kuka-kr90-acetal.toml"), folder.join("case.toml")).expect("the case is there");
}

/// Sorted names of the files in a folder.
fn files(folder: &Path) -> Vec<String> {
    let mut names: Vec<String> = fs::read_dir(folder)
        .expect("the folder is there")
        .map(|entry| {
            entry
                .expect("an entry")
                .file_name()
                .to_string_lossy()
                .into_owned()
        })
        .collect();
    names.sort();
    names
}

/// Computing time before the interrupt, counted from the installation of the handler. The tests pass with any value.
const COMPUTING: Duration = Duration::from_millis(300);

/// Runs a command. Interrupts it once it has installed its handler of Ctrl-C and `is_time` is true of its folder.
fn interrupted(folder: &Path, arguments: &[&str], is_time: impl Fn(&Path) -> bool) -> Outcome {
    let running = start(folder, arguments);
    let began = Instant::now();
    while !(running.catches_interrupt() && is_time(folder)) && began.elapsed() < PATIENCE {
        std::thread::sleep(Duration::from_millis(1));
    }
    running.interrupt();
    running.finish()
}

/// Runs a command. Interrupts it [`COMPUTING`] after it has installed its handler of Ctrl-C.
fn interrupted_while_computing(folder: &Path, arguments: &[&str]) -> Outcome {
    interrupted(folder, arguments, |_| {
        std::thread::sleep(COMPUTING);
        true
    })
}

const LOBES: [&str; 8] = [
    "lobes",
    "case.toml",
    "--rpm",
    "600:2400:20000",
    "--depth-mm",
    "0.05:5:400",
    "--out",
    "lobes.csv",
];

#[test]
fn an_interrupted_chart_leaves_the_old_file() {
    let folder = folder();
    case(folder.path());
    fs::write(folder.path().join("lobes.csv"), "old").expect("written");
    let outcome = interrupted_while_computing(folder.path(), &LOBES);
    assert_eq!(outcome.status, INTERRUPTED, "{outcome:?}");
    assert_eq!(outcome.stdout, "");
    assert_eq!(files(folder.path()), ["case.toml", "lobes.csv"]);
    let text = fs::read_to_string(folder.path().join("lobes.csv")).expect("the file is there");
    assert_eq!(text, "old");
}

#[test]
fn a_recording_that_is_interrupted_while_it_is_written_leaves_nothing() {
    let folder = folder();
    case(folder.path());
    // The sample rate is high, so that writing the file takes long enough to be interrupted.
    let arguments = [
        "simulate",
        "case.toml",
        "--rpm",
        "900",
        "--depth-mm",
        "0.5",
        "--seconds",
        "20",
        "--sample-rate-hz",
        "50000",
        "--ideal",
        "--out",
        "cut.csv",
    ];
    let is_writing = |folder: &Path| files(folder).iter().any(|name| name.starts_with(".quietcut-"));
    let outcome = interrupted(folder.path(), &arguments, is_writing);
    assert_eq!(outcome.status, INTERRUPTED, "{outcome:?}");
    assert_eq!(files(folder.path()), ["case.toml"]);
}

#[test]
fn an_interrupted_diagnosis_leaves_nothing() {
    let folder = folder();
    case(folder.path());
    let made = quietcut(
        folder.path(),
        &[
            "simulate",
            "case.toml",
            "--experiment",
            "sweep",
            "--direction",
            "x",
            "--frequency-hz",
            "10:25:2",
            "--force-n",
            "20",
            "--noise-percent",
            "1",
            "--out",
            "sweep.csv",
        ],
    );
    assert_eq!(made.status, Some(0), "{made:?}");
    let arguments = ["diagnose", "case.toml", "sweep.csv", "--out", "diagnosis"];
    let outcome = interrupted_while_computing(folder.path(), &arguments);
    assert_eq!(outcome.status, INTERRUPTED, "{outcome:?}");
    assert_eq!(files(folder.path()), ["case.toml", "sweep.csv", "sweep.toml"]);
}

#[test]
fn a_long_command_shows_progress_on_a_terminal_and_nowhere_else() {
    let folder = folder();
    case(folder.path());
    let mut terminal = PseudoTerminal::new().expect("a pseudo-terminal");
    let line = OpenOptions::new()
        .write(true)
        .open(terminal.path())
        .expect("the other end");
    let running = start_on(folder.path(), &LOBES, line);
    let (began, mut shown) = (Instant::now(), String::new());
    while !shown.contains("computing stability limits") && began.elapsed() < PATIENCE {
        let mut bytes = [0; 256];
        let count = terminal
            .receive(&mut bytes, Duration::from_millis(100))
            .expect("the terminal can be read");
        shown.push_str(&String::from_utf8_lossy(&bytes[..count]));
    }
    let taken = began.elapsed();
    running.interrupt();
    running.finish();
    assert!(shown.contains("computing stability limits"), "{shown:?}");
    println!("shown after {taken:?}");

    let piped = interrupted_while_computing(folder.path(), &LOBES);
    assert_eq!(piped.stderr, "");
}
