//! Twenty faults of files and command lines: the message of each equals the snapshot, and what it says mends the fault.
//!
//! ```text
//! QUIETCUT_WRITE=yes cargo test --release -p quietcut-tests --test documents faults        # also writes target/faults.md
//! ```
//!
//! `target/faults.md` has the messages with their numbers, for a reader who mends each fault from its message alone:
//! `tests/results/messages-read.json` holds the answers of one.

use std::fmt::Write;
use std::fs;
use std::path::Path;

use quietcut_tests::command::{Outcome, cases, done, folder, quietcut, words};
use quietcut_tests::documents::assert_generated;

use crate::outputs::masked;

/// What the faults are made of: right files.
struct Right {
    case: String,
    tap: String,
    cut: String,
}

impl Right {
    fn new(folder: &Path) -> Self {
        let case = fs::read_to_string(cases().join("kuka-kr90-acetal.toml")).expect("a case");
        fs::write(folder.join("case.toml"), &case).expect("a file can be written");
        done(
            folder,
            "simulate case.toml --experiment hammer --direction x --force-n 300 --sample-rate-hz 2048 --pulse-ms 4 --spacing-s 3.77 \
             --impacts 5 --measure acceleration --noise ax=0.01 --noise ay=0.01 --noise az=0.01 --noise fx=0.05 --seed 3 --out tap.csv",
        );
        done(
            folder,
            "simulate case.toml --rpm 900 --depth-mm 1 --seconds 8 --out cut.csv",
        );
        let read = |name: &str| fs::read_to_string(folder.join(name)).expect("a recording");
        Self {
            case,
            tap: read("tap.csv"),
            cut: read("cut.csv"),
        }
    }

    /// The taps with another head.
    fn headed(&self, head: &str) -> String {
        let (_, rows) = self.tap.split_once('\n').expect("a head");
        format!("{head}\n{rows}")
    }

    /// The taps with other rows: `of` gives time, force and acceleration in x from those at the index of a row.
    fn changed(&self, of: impl Fn(&[[f64; 3]], usize) -> [f64; 3]) -> String {
        let rows: Vec<Vec<&str>> = self
            .tap
            .lines()
            .skip(1)
            .map(|row| row.split(',').collect())
            .collect();
        let number = |text: &str| text.parse::<f64>().expect("a number");
        let numbers: Vec<[f64; 3]> = rows
            .iter()
            .map(|row| std::array::from_fn(|column| number(row[column])))
            .collect();
        let mut text = format!("{}\n", self.tap.lines().next().expect("a head"));
        for (index, row) in rows.iter().enumerate() {
            let [t, force, acceleration] = of(&numbers, index);
            writeln!(text, "{t},{force},{acceleration},{},{}", row[3], row[4]).expect("a string grows");
        }
        text
    }

    /// The case with `right` replaced by `wrong`.
    fn with(&self, right: &str, wrong: &str) -> String {
        assert!(self.case.contains(right), "{right}");
        self.case.replacen(right, wrong, 1)
    }
}

/// A fault: a file that is wrong or a command that is, and what mends it.
struct Fault {
    /// What the user has, in words.
    situation: &'static str,
    /// Name and text of the file of the fault.
    file: (&'static str, fn(&Right) -> String),
    command: &'static str,
    /// The file as the message asks for it; `None` if the file stays.
    mended: Option<fn(&Right) -> String>,
    /// The command as the message asks for it.
    mended_command: &'static str,
}

const HEAD: &str = "t [s],fx [N],ax [m/s^2],ay [m/s^2],az [m/s^2]";
const BAND: &str = "frf rec.csv --band-hz 10:60";

fn faults() -> [Fault; 20] {
    let right_tap: Option<fn(&Right) -> String> = Some(|right| right.tap.clone());
    let right_case: Option<fn(&Right) -> String> = Some(|right| right.case.clone());
    let tap = |situation, file: fn(&Right) -> String, mended, mended_command| Fault {
        situation,
        file: ("rec.csv", file),
        command: BAND,
        mended,
        mended_command,
    };
    const LOBES: &str = "lobes case.toml --rpm 600:1400:9 --depth-mm 3";
    let case = |situation, file: fn(&Right) -> String| Fault {
        situation,
        file: ("case.toml", file),
        command: LOBES,
        mended: right_case,
        mended_command: LOBES,
    };
    let line = |situation, command, mended_command| Fault {
        situation,
        file: ("case.toml", |right| right.case.clone()),
        command,
        mended: None,
        mended_command,
    };
    [
        tap("A recording of a tap test.", |_| String::new(), right_tap, BAND),
        tap(
            "A recording of a tap test.",
            |right| right.tap.replacen("\n", "\n0,overload,0.1,0.1,0.1\n", 1),
            right_tap,
            BAND,
        ),
        tap(
            "A recording of a tap test in x: force in N, acceleration in m/s².",
            |right| right.headed("t,force,acc,b,c"),
            None,
            "frf rec.csv --band-hz 10:60 --map force=fx:N,acc=ax:m/s^2",
        ),
        tap(
            "A recording of a tap test, 2048 samples per second.",
            |right| {
                let of = |line: &str| {
                    line.split_once(',')
                        .map_or(String::new(), |(_, rest)| rest.to_owned())
                };
                right.tap.lines().map(|line| of(line) + "\n").collect()
            },
            None,
            "frf rec.csv --band-hz 10:60 --rate 2048",
        ),
        tap(
            "A recording of a tap test with a hammer of 500 N.",
            |right| right.headed(&HEAD.replace("[N]", "[kN]")),
            None,
            "frf rec.csv --band-hz 10:60 --map fx=fx:N",
        ),
        tap(
            "A recording of a tap test.",
            |right| right.headed("t [s],ax [m/s^2],fx [N],ay [m/s^2],az [m/s^2]"),
            None,
            "frf rec.csv --band-hz 10:60 --map fx=ax:m/s^2,ax=fx:N",
        ),
        tap(
            "A recording of a tap test in x at the place of the sensor.",
            |right| {
                right.changed(|rows, at| {
                    let [t, force, acceleration] = rows[at];
                    [t, force, -acceleration]
                })
            },
            None,
            "frf rec.csv --band-hz 10:60 --map ax=-ax",
        ),
        tap(
            "A recording of a tap test.",
            |right| {
                right.changed(|rows, at| {
                    let [t, force, acceleration] = rows[at];
                    [
                        t,
                        force,
                        acceleration + 200.0 * (std::f64::consts::TAU * 50.0 * t).sin(),
                    ]
                })
            },
            right_tap,
            BAND,
        ),
        Fault {
            situation: "A recording of a tap test, whose receptances are wanted in a file.",
            file: ("rec.csv", |right| right.tap.clone()),
            command: "frf rec.csv --band-hz 10:60 --out receptances.xls",
            mended: None,
            mended_command: "frf rec.csv --band-hz 10:60 --out receptances.csv",
        },
        case("A case file.", |right| right.with("[tool]", "[tools]")),
        case("A case file of a structure with 2.85 % damping.", |right| {
            right.with("damping_ratio = 0.0285", "damping_ratio = 2.85")
        }),
        case("A case file of a tool of 12.7 mm.", |right| {
            right.with("diameter_mm = 12.7", "diameter_mm = 0.0127")
        }),
        case("A case file of acetal: ktc is 119 MPa.", |right| {
            right.with("ktc_mpa = 119.0\n", "")
        }),
        line(
            "A case file, and the wish for a chart from 600 to 1400 rev/min.",
            "lobes case.toml --rpm 600-1400 --depth-mm 3",
            "lobes case.toml --rpm 600:1400 --depth-mm 3",
        ),
        line(
            "A case file, and the wish for a chart from 600 to 1400 rev/min and up to 3 mm.",
            "lobes case.toml",
            "lobes case.toml --rpm 600:1400 --depth-mm 3",
        ),
        line(
            "A case file, and the wish for a virtual cut with a runout of 20 µm.",
            "simulate case.toml --rpm 900 --depth-mm 1 --seconds 2 --effect runnout=20um --out a.csv",
            "simulate case.toml --rpm 900 --depth-mm 1 --seconds 2 --effect runout=20 --out a.csv",
        ),
        Fault {
            situation: "A recording of a cut with a tool of two teeth.",
            file: ("rec.csv", |right| right.cut.clone()),
            command: BAND,
            mended: None,
            mended_command: "replay rec.csv --teeth 2",
        },
        tap(
            "A recording of a tap test with impacts of some 300 N.",
            |right| {
                right.changed(|rows, at| {
                    let [t, force, acceleration] = rows[at];
                    [t, force.min(150.0), acceleration]
                })
            },
            right_tap,
            BAND,
        ),
        tap(
            "A recording of a tap test.",
            |right| {
                right.changed(|rows, at| {
                    let [t, force, acceleration] = rows[at];
                    let before = at.checked_sub(40).map_or(0.0, |before| rows[before][1]);
                    [t, force + 0.3 * before, acceleration]
                })
            },
            right_tap,
            BAND,
        ),
        Fault {
            situation: "A recording of a tap test by accelerometers in m/s², and the case of the machine.",
            file: ("rec.csv", |right| right.headed(&HEAD.replace("[m/s^2]", "[g]"))),
            command: "diagnose case.toml rec.csv",
            mended: right_tap,
            // A whole diagnosis takes too long here.
            mended_command: BAND,
        },
    ]
}

/// Runs a command, and asserts that it ends as a user's mistake or with an answer.
fn run(folder: &Path, command: &str) -> Outcome {
    let outcome = quietcut(folder, &words(command));
    assert!(
        matches!(outcome.status, Some(0 | 2)) && !outcome.stderr.contains("fault in quietcut"),
        "{command}: {outcome:?}"
    );
    outcome
}

/// Messages of a run: its errors and warnings, without what was understood of files.
fn messages(outcome: &Outcome) -> String {
    let lines = outcome.stderr.lines();
    lines
        .filter(|line| !line.starts_with("understood: "))
        .map(|line| line.trim().to_owned() + "\n")
        .collect()
}

#[test]
fn messages_of_twenty_faults_mend_them() {
    let folder = folder();
    let right = Right::new(folder.path());
    let mut said = String::new();
    let mut items = String::new();
    for (number, fault) in (1..).zip(faults()) {
        let (name, text) = fault.file;
        let text = text(&right);
        fs::write(folder.path().join(name), &text).expect("a file can be written");
        let wrong = run(folder.path(), fault.command);
        let message = messages(&wrong);
        assert!(
            !message.is_empty(),
            "fault {number}: {}: {wrong:?}",
            fault.command
        );
        write!(said, "$ quietcut {}\n{}\n", fault.command, masked(&message)).expect("a string grows");
        let lines = if name.ends_with("toml") { 60 } else { 3 };
        let head: String = text.lines().take(lines).map(|line| format!("{line}\n")).collect();
        write!(
            items,
            "## {number}\n\n{} `{name}` begins:\n\n```text\n{head}```\n\n```text\n$ quietcut {}\n{message}```\n\n",
            fault.situation, fault.command
        )
        .expect("a string grows");
        if let Some(mended) = fault.mended {
            fs::write(folder.path().join(name), mended(&right)).expect("a file can be written");
        }
        let mended = run(folder.path(), fault.mended_command);
        assert_eq!(mended.status, Some(0), "fault {number}: {mended:?}");
        let first = message.lines().next().expect("a message");
        assert!(
            !mended.stderr.contains(first),
            "fault {number}: {} still says {first}",
            fault.mended_command
        );
        fs::write(folder.path().join("case.toml"), &right.case).expect("a file can be written");
    }
    assert!(!said.contains(folder.path().to_str().expect("a path")), "{said}");
    if std::env::var_os("QUIETCUT_WRITE").is_some() {
        fs::write(
            Path::new(env!("CARGO_MANIFEST_DIR")).join("../target/faults.md"),
            &items,
        )
        .expect("a file can be written");
    }
    assert_generated("tests/snapshots/faults.txt", None, &said);
}
