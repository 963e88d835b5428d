//! Records of the orbits, from which an interrupted command goes on.

use std::fs;
use std::time::{Duration, Instant};

use quietcut_tests::command::{cases, folder, quietcut, start, words};
use serde_json::Value;

use super::{CURVE, read, run};

/// The largest difference between the numbers of two answers, relative to the larger one of each pair; other values and
/// lengths must be equal.
pub(super) fn largest_difference(a: &Value, b: &Value) -> f64 {
    match (a, b) {
        (Value::Number(a), Value::Number(b)) => {
            let (a, b) = (a.as_f64().expect("a number"), b.as_f64().expect("a number"));
            if a == b {
                0.0
            } else {
                (a - b).abs() / a.abs().max(b.abs())
            }
        }
        (Value::Array(a), Value::Array(b)) => {
            assert_eq!(a.len(), b.len());
            a.iter()
                .zip(b)
                .map(|(a, b)| largest_difference(a, b))
                .fold(0.0, f64::max)
        }
        (Value::Object(a), Value::Object(b)) => {
            assert!(a.keys().eq(b.keys()));
            // Error estimates are differences of nearly equal numbers: one digit of them is known.
            let exact = a.iter().filter(|(key, _)| !key.starts_with("error"));
            exact
                .map(|(key, a)| largest_difference(a, &b[key]))
                .fold(0.0, f64::max)
        }
        _ => {
            assert_eq!(a, b);
            0.0
        }
    }
}

#[test]
fn a_killed_run_goes_on_to_the_same_answer() {
    let folder = folder();
    let at = folder.path();
    for (name, options) in [
        ("branch", "--vary depth --range 0:15 --fix rpm=542.8".to_owned()),
        ("curve", CURVE.to_owned()),
    ] {
        let case = "kuka-kr90-full-cubic";
        let whole = run(at, case, &format!("{options} --out {name}.json"));
        assert_eq!(whole.status, Some(0), "{whole:?}");
        assert!(whole.stdout.contains(&format!("{name}.jsonl")), "{whole:?}");
        let expected = read(at, &format!("{name}.json"));
        let records = fs::read_to_string(at.join(format!("{name}.jsonl"))).expect("the records");
        let lines: Vec<&str> = records.lines().collect();
        assert!(lines.len() > 20, "{name}: {} lines", lines.len());
        for kept in [1, 2, lines.len() / 2, lines.len() - 1, lines.len()] {
            // A killed process may leave half a line.
            let half = lines.get(kept).map_or("", |line| &line[..line.len() / 2]);
            let part = format!("{}\n{half}", lines[..kept].join("\n"));
            fs::write(at.join("cut.part.jsonl"), part).expect("written");
            let resumed = run(
                at,
                case,
                &format!("{options} --resume cut.part.jsonl --out resumed.json"),
            );
            assert_eq!(resumed.status, Some(0), "{resumed:?}");
            let difference = largest_difference(&expected, &read(at, "resumed.json"));
            println!("{name}, {kept} of {} lines kept: {difference:.1e}", lines.len());
            assert!(difference < 1e-12, "{name}, {kept}: {difference}");
            assert!(!at.join("cut.part.jsonl").exists());
            let again = fs::read_to_string(at.join("cut.jsonl")).expect("the records");
            assert_eq!(again.lines().count(), lines.len(), "{name}, {kept}");
        }
    }
}

#[test]
fn ctrl_c_leaves_records_from_which_the_command_goes_on() {
    let folder = folder();
    let at = folder.path();
    let case = cases().join("kuka-kr90-full-cubic.toml").display().to_string();
    let options = format!("{CURVE} --out curve.svg");
    let mut arguments = vec!["bifurcation", &case];
    arguments.extend(words(&options));
    let running = start(at, &arguments);
    let part = at.join("curve.part.jsonl");
    let began = Instant::now();
    let lines = || fs::read_to_string(&part).map_or(0, |text| text.lines().count());
    while lines() < 3 && began.elapsed() < Duration::from_secs(60) {
        std::thread::sleep(Duration::from_millis(1));
    }
    running.interrupt();
    let interrupted = running.finish();
    assert_eq!(interrupted.status, Some(130), "{interrupted:?}");
    assert!(!at.join("curve.svg").exists());
    let text = fs::read_to_string(&part).expect("the part file stays");
    assert!(text.ends_with('\n') && text.lines().count() >= 3);
    // The same command without --resume says how to go on, and does not touch the records.
    quietcut(at, &arguments).refused(&["curve.part.jsonl", "--resume curve.part.jsonl"]);
    assert_eq!(fs::read_to_string(&part).expect("the part file stays"), text);
    arguments.extend(["--resume", "curve.part.jsonl", "--json"]);
    let resumed = quietcut(at, &arguments).json();
    let whole = run(at, "kuka-kr90-full-cubic", &format!("{CURVE} --json")).json();
    assert!(largest_difference(&whole, &resumed) < 1e-12);
    assert!(at.join("curve.svg").exists() && at.join("curve.jsonl").exists() && !part.exists());
}

#[test]
fn records_of_another_command_are_refused_with_the_reason() {
    let folder = folder();
    let at = folder.path();
    fs::copy(cases().join("kuka-kr90-full-cubic.toml"), at.join("case.toml")).expect("copied");
    let go = |options: &str| quietcut(at, &words(&format!("bifurcation case.toml {options}")));
    let own = "--vary depth --range 0:5 --fix rpm=822";
    assert_eq!(go(&format!("{own} --out a.svg")).status, Some(0));
    go("--vary depth --range 0:6 --fix rpm=822 --resume a.jsonl")
        .refused(&["a.jsonl", "--range was 0:5 there and is 0:6 here"]);
    go("--vary depth --range 0:5 --fix rpm=823 --resume a.jsonl")
        .refused(&["--fix rpm was 822 there and is 823 here"]);
    let text = fs::read_to_string(at.join("case.toml")).expect("a case");
    fs::write(
        at.join("case.toml"),
        text.replace("ktc_mpa = 76.0", "ktc_mpa = 77.0"),
    )
    .expect("written");
    go(&format!("{own} --resume a.jsonl")).refused(&["a.jsonl", "the case file"]);
    fs::write(at.join("b.jsonl"), "{}\n").expect("written");
    go(&format!("{own} --resume b.jsonl")).refused(&["b.jsonl", "line 1"]);
    go(&format!("{own} --resume none.jsonl")).refused(&["none.jsonl"]);
}
