//! The command line: examples of the help run, exit statuses, and one message for each wrong input.

#![allow(clippy::expect_used)]

use quietcut_tests::command::{WORKING_POINT, cases, folder, quietcut, verbs, words};

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
    let listed = verbs();
    for verb in ["setup", "next", "diagnose", "lobes", "monitor"] {
        assert!(listed.iter().any(|known| known == verb), "{verb}: {listed:?}");
    }
    assert!(listed.len() >= 16, "{listed:?}");
    for verb in &listed {
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
    run(&["lobes", "a.toml", "--rpm", "600-2400", "--depth-mm", "1:2:3"])
        .refused(&["600-2400", "first:last:count"]);
    run(&["lobes", "a.toml", "--rpm", "600:2400:9:9", "--depth-mm", "1:2:3"])
        .refused(&["--rpm", "first:last:count"]);
    let working_point = |depth, feed| {
        let cut = ["--start", "90", "--exit", "180", "--feed", feed];
        run(&[&["working-point", "simulated", "--depth-mm", depth], &cut[..]].concat())
    };
    working_point("-2", "0.15").refused(&["--depth-mm", "-2", "greater than 0"]);
    working_point("2", "0").refused(&["--feed", "greater than 0"]);
    working_point("two", "0.15").refused(&["--depth-mm", "two", "not a number"]);
    run(&["replay", "a.csv", "--teeth", "0"]).refused(&["--teeth", "0", "from 1 to 255"]);
}

#[test]
fn a_virtual_cut_that_cannot_be_is_refused_and_leaves_no_file() {
    let folder = folder();
    let acetal = cases().join("kuka-kr90-acetal.toml");
    let cut = |more: &[&str]| {
        let case = acetal.to_str().expect("a path");
        let plain = ["simulate", case, "--rpm", "900", "--out", "cut.csv"];
        quietcut(folder.path(), &[&plain[..], more].concat())
    };
    let long = ["--depth-mm", "1", "--seconds", "3"];
    let with = |more: &[&str]| cut(&[&long[..], more].concat());
    cut(&["--depth-mm", "-1", "--seconds", "3"]).refused(&["--depth-mm", "-1", "greater than 0"]);
    cut(&["--depth-mm", "1", "--seconds", "1", "--entry", "feed"]).refused(&["--seconds 1", "too short"]);
    with(&["--effect", "weather=1"]).refused(&["weather", "runout, process-damping"]);
    with(&["--effect", "wear=-2"]).refused(&["wear", "negative within 3 s"]);
    with(&["--effect", "runout=much"]).refused(&["runout", "much", "number"]);
    with(&["--clock-error-percent", "4"]).refused(&["--clock-error-percent", "4", "−3 to 3"]);
    with(&["--tacho-positions", "60", "--tacho-missing", "60"])
        .refused(&["--tacho-missing 60", "60 positions"]);
    let left: Vec<_> = std::fs::read_dir(folder.path()).expect("the folder").collect();
    assert!(left.is_empty(), "{left:?}");

    // A case with the name of the sidecar must not be overwritten by it.
    std::fs::copy(&acetal, folder.path().join("cut.toml")).expect("a copy of the case");
    let own = ["simulate", "cut.toml", "--rpm", "900", "--out", "cut.csv"];
    quietcut(folder.path(), &[&own[..], &long[..]].concat()).refused(&["cut.toml", "overwrite the case"]);
}

#[test]
fn the_same_seed_cuts_the_same_file_and_it_replays() {
    let folder = folder();
    let acetal = cases().join("kuka-kr90-acetal.toml");
    let cut = |seed: &str, out: &str| {
        let case = acetal.to_str().expect("a path");
        let arguments = [
            "simulate",
            case,
            "--rpm",
            "900",
            "--depth-mm",
            "1",
            "--seconds",
            "1.5",
            "--seed",
            seed,
            "--out",
            out,
            "--effect",
            "runout=10",
            "--json",
        ];
        let answer = quietcut(folder.path(), &arguments).json();
        assert_eq!(answer["entry"], "ramp", "{answer}");
        std::fs::read(folder.path().join(out)).expect("a recording")
    };
    let (a, b, c) = (cut("5", "a.csv"), cut("5", "b.csv"), cut("6", "c.csv"));
    assert!(a == b && a != c);
    let replayed = quietcut(folder.path(), &["replay", "a.csv", "--json"]).json();
    assert!(
        replayed["summary"]["blocks"].as_u64().expect("blocks") > 600,
        "{replayed}"
    );
    assert_eq!(replayed["summary"]["clipped"], 0);
}

#[test]
fn examples_run() {
    // The verbs run in parallel. The examples of one verb run in order, because later ones use files of earlier ones.
    let verbs = verbs();
    std::thread::scope(|scope| {
        for verb in &verbs {
            scope.spawn(move || {
                let folder = folder();
                let there = folder.path().join("tests/cases");
                std::fs::create_dir_all(&there).expect("a folder can be made");
                for case in std::fs::read_dir(cases()).expect("the cases are there") {
                    let case = case.expect("a case can be listed").path();
                    let name = case.file_name().expect("a case has a name");
                    std::fs::copy(&case, there.join(name)).expect("the case can be copied");
                }
                for example in examples(verb) {
                    let ran = quietcut(folder.path(), &example);
                    assert_eq!(ran.status, Some(0), "{example:?}: {ran:?}");
                    assert!(!ran.stdout.is_empty(), "{example:?} says nothing");
                }
            });
        }
    });
}

#[test]
fn json_is_exactly_one_object() {
    let folder = folder();
    let case = cases().join("kuka-kr90-acetal.toml");
    let case = case.to_str().expect("a path in UTF-8");
    for arguments in [
        &["lobes", case, "--at", "1045,2"][..],
        &["lobes", case, "--rpm", "900:1000:3", "--depth-mm", "0.1:3:10"],
        &["table", case, "--rpm", "900:1000:2", "--out", "a.qct"],
        &["table", "--show", "a.qct"],
        &[
            "simulate",
            case,
            "--rpm",
            "900",
            "--depth-mm",
            "1",
            "--seconds",
            "3",
            "--out",
            "a.csv",
        ],
        &["replay", "a.csv", "--table", "a.qct"],
        &["replay", "a.csv", "--table", "a.qct", "--port", "simulated"],
        &["upload", "simulated", "a.qct"],
        &["info", "simulated"],
        &[&["working-point", "simulated"], &words(WORKING_POINT)[..]].concat(),
        // The former name of the verb.
        &[&["work", "simulated"], &words(WORKING_POINT)[..]].concat(),
        &["monitor", "simulated", "--seconds", "0.5"],
    ] {
        let answer = quietcut(folder.path(), &[arguments, &["--json"]].concat());
        assert!(answer.json().is_object(), "{arguments:?}: {answer:?}");
        assert_eq!(answer.stdout.lines().count(), 1, "{arguments:?}");
    }
}
