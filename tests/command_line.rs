//! The command as a user meets it: help that runs, exit status, one clear message for each wrong input.

#![allow(clippy::expect_used)]

use quietcut_tests::command::{folder, quietcut};

const VERBS: [&str; 9] = [
    "demo", "simulate", "lobes", "table", "upload", "info", "work", "monitor", "replay",
];

/// The commands under "Example:" in the help of a verb.
fn examples(verb: &str) -> Vec<Vec<String>> {
    let help = quietcut(folder().path(), &["help", verb]);
    assert_eq!(help.status, Some(0), "{help:?}");
    let (_, examples) = help
        .stdout
        .split_once("Example:\n")
        .expect("every help has an example");
    examples
        .lines()
        .filter_map(|line| line.strip_prefix("  quietcut "))
        .map(|line| line.split_whitespace().map(str::to_owned).collect())
        .collect()
}

#[test]
fn help_lists_every_verb() {
    let help = quietcut(folder().path(), &["help"]);
    assert_eq!(help.status, Some(0));
    for verb in VERBS {
        assert!(
            help.stdout.contains(&format!("\n  {verb} ")),
            "{verb}: {}",
            help.stdout
        );
        assert!(!examples(verb).is_empty(), "{verb}");
    }
}

#[test]
fn bad_usage_has_status_2() {
    let folder = folder();
    let run = |arguments: &[&str]| quietcut(folder.path(), arguments);
    run(&[]).refused(&["Usage: quietcut"]);
    run(&["mill"]).refused(&["mill"]);
    run(&["info"]).refused(&["<PORT>"]);
    run(&["lobes", "a.toml", "--rpm", "600:2400", "--depth-mm", "1:2:3"])
        .refused(&["--rpm", "first:last:count"]);
    let work = |depth, feed| {
        let cut = ["--start", "90", "--exit", "180", "--feed", feed];
        run(&[&["work", "simulated", "--depth-mm", depth], &cut[..]].concat())
    };
    work("-2", "0.15").refused(&["--depth-mm", "-2", "greater than 0"]);
    work("2", "0").refused(&["--feed", "greater than 0"]);
    work("two", "0.15").refused(&["--depth-mm", "two", "not a number"]);
    run(&["replay", "a.csv", "--teeth", "0"]).refused(&["--teeth", "0", "from 1 to 255"]);
}
