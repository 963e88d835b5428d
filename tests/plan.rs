//! `quietcut plan`, and `quietcut lobes --cuts`, on the command line.

#![allow(clippy::expect_used)]

use quietcut_tests::command::{Outcome, cases, folder, quietcut};

fn run(folder: &tempfile::TempDir, verb: &str, case: &str, options: &str) -> Outcome {
    let case = cases().join(format!("{case}.toml")).display().to_string();
    let mut arguments = vec![verb, &case];
    arguments.extend(options.split_whitespace());
    quietcut(folder.path(), &arguments)
}

#[test]
fn a_plan_lists_tests_and_the_widths_after_each() {
    let folder = folder();
    let options = "--rpm 700:2000:14 --depth-mm 0:6:60 --width-percent 15 --out plan.html --json";
    let answer = run(&folder, "plan", "kuka-kr90-acetal", options).json();
    assert_eq!(answer["reached"], true);
    assert_eq!(answer["stated"], false);
    let tests = answer["tests"].as_array().expect("tests");
    assert!(!tests.is_empty());
    let counted: u64 = tests
        .iter()
        .filter_map(|test| test["cuts_or_tests"].as_u64())
        .sum();
    assert_eq!(answer["cuts_and_tests"].as_u64(), Some(counted));
    // Each test narrows the widest interval, and the last test reaches the requested width.
    let widest = |at: &serde_json::Value| at["widest_percent"].as_f64().expect("a width");
    let mut before = widest(&answer["before"]);
    for test in tests {
        let after = widest(&test["after"]);
        assert!(after < before, "{answer}");
        before = after;
    }
    assert!(before <= 15.0 && before == widest(&answer["after"]));
    let chart = answer["chart"].as_array().expect("a chart");
    for speed in chart {
        let of = |key: &str, end: usize| speed[key][end].as_f64().expect("mm");
        let limit = speed["limit_mm"].as_f64().expect("mm");
        assert!(of("before_mm", 0) < of("after_mm", 0) && of("after_mm", 1) < of("before_mm", 1));
        assert!((of("after_mm", 1) - of("after_mm", 0)) / limit <= 0.15 + 1e-12);
    }
    let page = std::fs::read_to_string(folder.path().join("plan.html")).expect("the page is there");
    assert!(page.contains("90 % interval after the tests"));
}

#[test]
fn a_plan_depends_on_the_range_alone_and_proposes_no_test_twice() {
    let folder = folder();
    let plan = |rpm: &str| {
        let options = format!("--rpm {rpm} --depth-mm 0:6:60 --width-percent 12 --json");
        run(&folder, "plan", "kuka-kr90-acetal", &options).json()
    };
    let (coarse, fine) = (plan("700:2000:9"), plan("700:2000:53"));
    let tests = coarse["tests"].as_array().expect("tests");
    assert!(!tests.is_empty());
    assert_eq!(coarse["tests"], fine["tests"]);
    assert_eq!(coarse["after"], fine["after"]);
    // Listed are the speeds that were asked for, all of which have a limit.
    for (answer, count) in [(&coarse, 9), (&fine, 53)] {
        let listed = answer["chart"].as_array().expect("a chart");
        assert_eq!(listed.len(), count);
        for (index, speed) in listed.iter().enumerate() {
            let asked = 700.0 + 1300.0 * index as f64 / (count - 1) as f64;
            assert!(
                (speed["rpm"].as_f64().expect("a speed") - asked).abs() < 1e-9,
                "{speed}"
            );
        }
    }
    for (index, test) in tests.iter().enumerate() {
        let same = |other: &serde_json::Value| {
            ["kind", "direction", "rpm"]
                .iter()
                .all(|key| other[*key] == test[*key])
        };
        assert!(!tests[..index].iter().any(same), "{test} is proposed twice");
    }
}

#[test]
fn a_width_that_no_set_of_tests_reaches_is_stated_with_the_reason() {
    let folder = folder();
    let options = "--rpm 800:1600:5 --depth-mm 0:6:60 --width-percent 0.01 --json";
    let answer = run(&folder, "plan", "kuka-kr90-acetal", options).json();
    assert_eq!(answer["reached"], false);
    let obstacle = &answer["obstacle"];
    assert!(obstacle["at_best"]["widest_percent"].as_f64().expect("a width") > 0.01);
    assert_eq!(obstacle["if_known"].as_array().map(Vec::len), Some(3));
    let wide = "--rpm 800:1600:5 --depth-mm 0:6:60 --width-percent 500 --json";
    let answer = run(&folder, "plan", "kuka-kr90-acetal", wide).json();
    assert_eq!(answer["reached"], true);
    assert_eq!(answer["cuts_and_tests"], 0);
}

#[test]
fn what_cannot_be_planned_is_refused() {
    let folder = folder();
    let range = "--rpm 500:600:5 --depth-mm 0:20:60 --width-percent 10";
    run(&folder, "plan", "kuka-kr90-half-cubic", range).refused(&["cubic", "--linear"]);
    run(&folder, "plan", "kuka-kr90-x20", range).refused(&["[tool]"]);
    let shallow = "--rpm 800:1600:5 --depth-mm 0:0.1:2 --width-percent 10";
    run(&folder, "plan", "kuka-kr90-acetal", shallow).refused(&["kuka-kr90-acetal", "--depth-mm"]);
}

#[test]
fn cuts_are_drawn_into_the_chart_and_counted() {
    let folder = folder();
    // The true limits are 1.664 mm at 800 rev/min and 2.041 mm at 1200 rev/min.
    let cuts = "rpm [rev/min],depth [mm],outcome\n800,1.5,stable\n800,1.6,chatter\n1200,1.9,marginal\n1200,2.2,stable\n";
    std::fs::write(folder.path().join("cuts.csv"), cuts).expect("the folder is there");
    let options = "--rpm 700:1300:7 --depth-mm 0:4:40 --cuts cuts.csv --out lobes.svg --json";
    let answer = run(&folder, "lobes", "kuka-kr90-acetal", options).json();
    let expected = serde_json::json!(
        {"cuts": 4, "wrong": 2, "missed_chatter": 1, "false_alarms": 1, "undecided": 1}
    );
    assert_eq!(answer["cuts"], expected);
    assert!(folder.path().join("lobes.svg").exists());
    std::fs::write(folder.path().join("cuts.csv"), "a,b\n").expect("the folder is there");
    run(&folder, "lobes", "kuka-kr90-acetal", options).refused(&["cuts.csv", "line 1", "outcome"]);
}
