//! Help texts and short outputs of the command equal the snapshots in `tests/snapshots`.
//!
//! A snapshot contains no path of a machine, no time and no version.

use std::fmt::Write;

use quietcut_tests::command::{Outcome, folder, quietcut, verbs};
use quietcut_tests::documents::assert_generated;

fn snapshot(name: &str, arguments: &[&str], outcome: &Outcome) -> String {
    let mut text = format!("$ quietcut {}\n", arguments.join(" "));
    write!(text, "{}{}", outcome.stdout, outcome.stderr).expect("a string grows");
    writeln!(text, "[exit status {}]", outcome.status.expect("no signal")).expect("a string grows");
    assert!(
        !text.contains("/tmp") && !text.contains("0.1.0"),
        "{name}: {text}"
    );
    text
}

#[test]
fn help_of_every_verb_is_as_reviewed() {
    let folder = folder();
    let verbs = verbs();
    assert!(verbs.len() >= 16, "{verbs:?}");
    let whole = quietcut(folder.path(), &["help"]);
    let text = snapshot("help", &["help"], &whole);
    assert_generated("tests/snapshots/help.txt", None, &text);
    for verb in &verbs {
        let help = quietcut(folder.path(), &["help", verb]);
        let text = snapshot(verb, &["help", verb], &help);
        assert_generated(&format!("tests/snapshots/help-{verb}.txt"), None, &text);
    }
}

#[test]
fn messages_of_bad_usage_are_as_reviewed() {
    let folder = folder();
    std::fs::write(
        folder.path().join("broken.toml"),
        "[tool]\nteeth = 2\nflutes = 2\n",
    )
    .expect("a file");
    std::fs::write(folder.path().join("empty.toml"), "").expect("a file");
    let mut text = String::new();
    for arguments in [
        &[][..],
        &["mill"],
        &["info"],
        &["lobes", "missing.toml", "--at", "1000,1"],
        &["lobes", "broken.toml", "--at", "1000,1"],
        &["lobes", "empty.toml", "--at", "1000,1"],
        &["lobes", "empty.toml", "--rpm", "600:2400", "--depth-mm", "1:2:3"],
        &["bifurcation", "empty.toml", "--vary", "depth", "--range", "0:2"],
        &["bifurcation", "empty.toml", "--vary", "speed", "--range", "0:2"],
        &["replay", "missing.csv"],
        &["replay", "missing.csv", "--teeth", "0"],
        &["table", "--show", "missing.qct"],
        &["identify", "missing.csv", "--method", "guess"],
        &["diagnose", "empty.toml"],
    ] {
        let outcome = quietcut(folder.path(), arguments);
        assert_eq!(outcome.status, Some(2), "{arguments:?}: {outcome:?}");
        text += &snapshot("bad usage", arguments, &outcome);
        text.push('\n');
    }
    assert_generated("tests/snapshots/bad-usage.txt", None, &text);
}

/// Structure of each answer with `--json`: its keys and the types of their values.
#[test]
fn shapes_of_json_answers_are_as_reviewed() {
    let folder = folder();
    let case = quietcut_tests::command::cases().join("kuka-kr90-acetal.toml");
    std::fs::copy(case, folder.path().join("case.toml")).expect("a case");
    let mut text = String::new();
    for line in [
        "lobes case.toml --at 1045,2",
        "lobes case.toml --rpm 900:1000:2 --depth-mm 0.1:3:10",
        "bifurcation case.toml --vary depth --range 0:3:2 --fix rpm=1200 --strobe",
        "bifurcation case.toml --vary depth --range 0:3 --fix rpm=1200 --curve torus --in rpm,depth --range 1190:1210",
        "simulate case.toml --rpm 900 --depth-mm 1 --seconds 3 --out cut.csv",
        "table case.toml --rpm 900:1000:2 --out case.qct",
        "table --show case.qct",
        "replay cut.csv --table case.qct",
        "upload simulated case.qct",
        "info simulated",
        "identify cut.csv --method force-coefficients --out material.toml",
        "simulate case.toml --experiment hammer --force-n 300 --sample-rate-hz 512 --impacts 3 --out tap.csv",
        "frf tap.csv --band-hz 10:30 --out frf.csv",
        "look cut.csv",
        "plan case.toml --rpm 900:1000:2 --depth-mm 0:6:20 --width-percent 40",
        "simulate case.toml --rpm 900 --depth-mm 1 --seconds 6 --sample-rate-hz 500 --ideal --measure displacement --noise-percent 1 --effect runout=15 --out runout.csv",
        "diagnose case.toml runout.csv",
        "setup mill --teeth 2 --diameter-mm 12.7 --ktc-mpa 119 --krc-mpa 20.2 --kac-mpa 39.3 --down-milling-mm 6.35 --feed-per-tooth-mm 0.15 --rpm 600:2400",
        "next mill",
        "working-point simulated --depth-mm 2 --start 90 --exit 180 --feed 0.15",
        "doctor simulated",
    ] {
        let arguments: Vec<_> = line.split(' ').chain(["--json"]).collect();
        let answer = quietcut(folder.path(), &arguments).json();
        writeln!(text, "$ quietcut {}", arguments.join(" ")).expect("a string grows");
        shape(&answer, 0, &mut text);
        text.push('\n');
    }
    // The verdicts of a device depend on time: only their keys are compared.
    let line = "monitor simulated --seconds 1.5 --json";
    let arguments: Vec<_> = line.split(' ').collect();
    let answer = quietcut(folder.path(), &arguments).json();
    writeln!(text, "$ quietcut {line}").expect("a string grows");
    for (name, value) in [
        ("verdicts", &answer["verdicts"][0]),
        ("summary", &answer["summary"]),
    ] {
        let keys: Vec<_> = value.as_object().expect("an object").keys().cloned().collect();
        writeln!(text, "  {name}: {}", keys.join(", ")).expect("a string grows");
    }
    assert_generated("tests/snapshots/json-shapes.txt", None, &text);
}

fn shape(value: &serde_json::Value, depth: usize, text: &mut String) {
    use serde_json::Value;
    match value {
        Value::Object(fields) => {
            text.push('\n');
            for (key, value) in fields {
                write!(text, "{}{key}:", "  ".repeat(depth + 1)).expect("a string grows");
                shape(value, depth + 1, text);
            }
        }
        Value::Array(values) => match values.first() {
            Some(first) => {
                text.push_str(" list of");
                shape(first, depth + 1, text);
            }
            None => text.push_str(" empty list\n"),
        },
        Value::Null => text.push_str(" null\n"),
        Value::Bool(_) => text.push_str(" boolean\n"),
        Value::Number(_) => text.push_str(" number\n"),
        Value::String(_) => text.push_str(" text\n"),
    }
}
