//! One habit in all verbs: JSON on demand, output files that may be repeated, one form of ranges, no exponents in terminals.

#![allow(clippy::expect_used)]

use quietcut_tests::command::{cases, folder, quietcut, verbs};

/// Options of a verb, each with its value name and help in one line, from `quietcut help VERB`.
fn options(verb: &str) -> Vec<String> {
    let help = quietcut(folder().path(), &["help", verb]).stdout;
    let mut options: Vec<String> = Vec::new();
    for line in help.lines() {
        let line = line.trim();
        if line.starts_with('-') {
            options.push(line.into());
        } else if line.is_empty() || line.starts_with("Example") {
            continue;
        } else if let Some(last) = options.last_mut() {
            last.push(' ');
            last.push_str(line);
        }
    }
    options
}

#[test]
fn every_verb_answers_with_json() {
    // A script for a shell is no answer.
    for verb in verbs().into_iter().filter(|verb| verb != "completions") {
        assert!(
            options(&verb).iter().any(|option| option.starts_with("--json ")),
            "{verb} has no --json"
        );
    }
}

#[test]
fn every_output_file_may_be_repeated() {
    // A folder is written once.
    for verb in verbs() {
        let outs = options(&verb);
        for option in outs.iter().filter(|option| option.starts_with("--out <")) {
            let is_once = option.starts_with("--out <DIR>");
            assert!(is_once || option.contains("May be repeated"), "{verb}: {option}");
        }
    }
}

#[test]
fn every_range_has_one_form() {
    for verb in verbs() {
        for option in options(&verb) {
            let Some(value) = option.split_once('<').and_then(|(_, rest)| rest.split_once('>')) else {
                continue;
            };
            let is_range = value.0 == "R" && !option.starts_with("--hz-per-min") || value.0 == "FIRST:LAST";
            assert!(
                !is_range
                    || option.to_lowercase().contains("first:last")
                    || option.contains("First and last"),
                "{verb}: {option}"
            );
        }
    }
}

#[test]
fn terminals_show_no_exponents() {
    let folder = folder();
    let case = cases().join("kuka-kr90-acetal.toml").display().to_string();
    let lines = [
        "simulate CASE --experiment hammer --direction x --force-n 300 --sample-rate-hz 512 --seed 1 --noise-percent 1 --out x.csv --out x.uff",
        "simulate CASE --experiment hammer --direction y --force-n 300 --sample-rate-hz 512 --seed 2 --noise-percent 1 --out y.csv",
        "look x.csv",
        "frf x.csv y.csv --band-hz 10:30 --out frf.csv --out frf.svg",
        "identify frf.csv --method modes --case CASE --out own.toml",
        "lobes own.toml --rpm 900:1200:4 --depth-mm 0:4 --no-refine",
        "lobes own.toml --at 1045,2",
        "plan own.toml --rpm 900:1200:4 --depth-mm 0:6 --width-percent 40",
        "table CASE --rpm 900:1200 --out own.qct --out own.json",
        "table --show own.qct",
        "simulate CASE --rpm 900 --depth-mm 1 --seconds 3 --out cut.csv",
        "replay cut.csv --table own.qct",
        "identify cut.csv --method force-coefficients",
    ];
    for line in lines {
        let line = line.replace("CASE", &case);
        let arguments: Vec<&str> = line.split_whitespace().collect();
        let answer = quietcut(folder.path(), &arguments);
        assert_eq!(answer.status, Some(0), "{line}: {answer:?}");
        for word in answer
            .stdout
            .split(|c: char| c.is_whitespace() || ",;()".contains(c))
        {
            let is_exponential = word.parse::<f64>().is_ok() && word.contains(['e', 'E']);
            assert!(!is_exponential, "{line}: {word}");
        }
    }
    // What is repeated is written, too.
    for name in ["x.uff", "own.json", "frf.svg"] {
        assert!(folder.path().join(name).exists(), "{name}");
    }
}

#[test]
fn no_speed_outside_the_limits_of_the_spindle_is_proposed() {
    let folder = folder();
    let text = std::fs::read_to_string(cases().join("kuka-kr90-acetal.toml")).expect("a case");
    let limited = format!("{text}\n[limits]\nrpm_min = 1030.0\nrpm_max = 1250.0\n");
    std::fs::write(folder.path().join("free.toml"), text).expect("written");
    std::fs::write(folder.path().join("limited.toml"), limited).expect("written");
    let run = |line: &str| {
        let arguments: Vec<&str> = line.split_whitespace().collect();
        quietcut(folder.path(), &arguments)
    };
    // plan: only tests within the limits, and the speeds outside are counted.
    let plan = "--rpm 700:2000:14 --depth-mm 0:6:60 --width-percent 15";
    let answer = run(&format!("plan limited.toml {plan} --json")).json();
    for test in answer["tests"].as_array().expect("tests") {
        if let Some(rpm) = test["rpm"].as_f64() {
            assert!((1030.0..=1250.0).contains(&rpm), "{answer}");
        }
    }
    assert_eq!(
        answer["outside_limits_rpm"].as_array().map(Vec::len),
        Some(12),
        "{answer}"
    );
    let answer = run(&format!("plan free.toml {plan} --json")).json();
    assert_eq!(answer["assumes_every_speed"], true);
    run("plan limited.toml --rpm 700:900:3 --depth-mm 0:6 --width-percent 15")
        .refused(&["--rpm", "1030 to 1250"]);
    // replay: a cut at 1045 rev/min and 2 mm chatters; the nearest stable speed, 1024 rev/min, is outside the limits.
    run("simulate free.toml --rpm 1045 --depth-mm 2 --seconds 6 --out cut.csv");
    for case in ["free", "limited"] {
        let answer = run(&format!("table {case}.toml --rpm 700:2000 --out {case}.qct"));
        assert_eq!(
            answer.stdout.contains("no speed limits"),
            case == "free",
            "{answer:?}"
        );
    }
    let free = run("replay cut.csv --table free.qct --json").json();
    assert_eq!(free["summary"]["assumes_every_speed"], true, "{free}");
    let limited = run("replay cut.csv --table limited.qct --tried tried.csv --json").json();
    assert!(
        limited["summary"].get("assumes_every_speed").is_none(),
        "{limited}"
    );
    let speeds = |answer: &serde_json::Value| -> Vec<f64> {
        let verdicts = answer["verdicts"].as_array().expect("verdicts").clone();
        let advised = verdicts
            .iter()
            .filter(|verdict| verdict["advice"]["action"] != "keep");
        advised
            .filter_map(|verdict| verdict["advice"]["rpm"].as_f64())
            .collect()
    };
    assert!(speeds(&free).iter().any(|rpm| *rpm < 1030.0), "{free}");
    assert!(!speeds(&limited).is_empty());
    assert!(
        speeds(&limited).iter().all(|rpm| (1030.0..=1250.0).contains(rpm)),
        "{limited}"
    );
    // The outcome of the cut was added to a table that lobes reads.
    let tried = std::fs::read_to_string(folder.path().join("tried.csv")).expect("the table");
    assert!(tried.contains("\n1045,2,chatter,17."), "{tried}");
    let counted =
        run("lobes limited.toml --rpm 1000:1200:3 --depth-mm 0:4 --nominal --cuts tried.csv --json").json();
    assert_eq!(counted["cuts"]["wrong"], 0, "{counted}");
}
