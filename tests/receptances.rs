//! `quietcut lobes` from receptances: methods that require only receptances, and measured tables in place of a structure.

#![allow(clippy::expect_used)]

use std::f64::consts::TAU;
use std::fs;
use std::path::{Path, PathBuf};

use quietcut::case::Case;
use quietcut::frf::{Frf, FrfTable};
use quietcut::structure::Direction;
use quietcut_tests::command::{folder, quietcut};
use serde_json::Value;

fn case(name: &str) -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR")).join(format!("cases/{name}.toml"))
}

fn text(path: &Path) -> String {
    path.display().to_string()
}

/// Writes the receptances of the acetal robot in these directions, as from a tap test without noise.
fn write_table(path: &Path, axes: &[Direction], (first_hz, last_hz, step_hz): (f64, f64, f64)) {
    let case = Case::read(case("kuka-kr90-acetal")).expect("the case is there");
    let structure = case
        .structure()
        .expect("a structure")
        .first_order()
        .expect("a passive one");
    let count = ((last_hz - first_hz) / step_hz).round() as usize;
    let frequency_hz: Vec<f64> = (0..=count).map(|i| first_hz + step_hz * i as f64).collect();
    let mut entries = Vec::new();
    for &response in axes {
        for &force in axes {
            let (i, j) = (
                response.axis().expect("x, y or z"),
                force.axis().expect("x, y or z"),
            );
            let at = |f: &f64| structure.receptance(TAU * f).expect("damped")[(i, j)];
            entries.push(Frf {
                response,
                force,
                receptance: frequency_hz.iter().map(at).collect(),
                coherence: None,
                folding: None,
            });
        }
    }
    FrfTable::new(path, frequency_hz, entries)
        .expect("a table")
        .write(path)
        .expect("a file can be written");
}

const ALL: [Direction; 3] = [Direction::X, Direction::Y, Direction::Z];

/// Writes the case without its structure. With measured receptances, tool, material and cut are sufficient.
fn write_case_without_structure(path: &Path) {
    let whole = fs::read_to_string(case("kuka-kr90-acetal")).expect("the case is there");
    let (_, rest) = whole.split_once("[tool]").expect("a tool");
    fs::write(path, format!("[tool]{rest}")).expect("a file can be written");
}

fn json(folder: &Path, arguments: &[&str]) -> Value {
    let answer = quietcut(folder, arguments);
    assert_eq!(answer.status, Some(0), "{answer:?}");
    serde_json::from_str(&answer.stdout).expect("exactly one JSON object")
}

fn depths(answer: &Value) -> Vec<f64> {
    let switches = answer["speeds"][0]["switches"].as_array().expect("switches");
    switches
        .iter()
        .map(|switch| switch["depth_mm"].as_f64().expect("a depth"))
        .collect()
}

#[test]
fn every_method_answers_and_averaged_ones_state_what_they_neglect() {
    let case = text(&case("kuka-kr90-acetal"));
    let folder = folder();
    let by = |method: &str| {
        json(
            folder.path(),
            &[
                "lobes",
                &case,
                "--method",
                method,
                "--rpm",
                "1045",
                "--depth-mm",
                "0.1:4:40",
                "--json",
            ],
        )
    };
    for (method, first, kind, blind) in [
        ("zoa", 1.7727, "hopf", Some("flips")),
        ("nyquist", 1.7727, "hopf", Some("flips")),
        ("multi-frequency", 1.327, "flip", None),
    ] {
        let answer = by(method);
        assert_eq!(answer["method"], method);
        match blind {
            Some(blind) => assert!(answer["blind_to"].as_str().expect("a word").contains(blind)),
            None => assert!(answer["blind_to"].is_null()),
        }
        let limit = &answer["speeds"][0]["first_limit"];
        let depth = limit["depth_mm"].as_f64().expect("a depth");
        assert!((depth - first).abs() < 0.0007, "{method}: {depth}");
        assert_eq!(limit["kind"], kind);
    }
    let coupling = by("mode-coupling");
    assert!(
        coupling["blind_to"]
            .as_str()
            .expect("a word")
            .contains("regeneration")
    );
    let periodic = json(
        folder.path(),
        &[
            "lobes",
            &case,
            "--method",
            "nyquist",
            "--harmonics",
            "10",
            "--rpm",
            "1036",
            "--depth-mm",
            "0.1:4:40",
            "--json",
        ],
    );
    let stable = periodic["speeds"][0]["stable_mm"].as_array().expect("intervals");
    assert_eq!(stable.len(), 2);
    assert!(periodic["blind_to"].is_null());
}

#[test]
fn a_table_stands_for_the_structure() {
    let folder = folder();
    let (case_path, table) = (folder.path().join("cut.toml"), folder.path().join("frf.csv"));
    write_case_without_structure(&case_path);
    // The table has ten lines per half bandwidth: interpolation errs by 0.006 % of the peak.
    write_table(&table, &ALL, (1.0, 400.0, 0.05));
    let (case_path, table) = (text(&case_path), text(&table));
    for (rpm, method, expected) in [
        ("1045", "multi-frequency", vec![1.326_658, 3.344_286]),
        ("1036", "multi-frequency", vec![1.575_239, 2.333_858, 2.711_505]),
        ("900", "zoa", vec![1.621_997]),
        ("900", "nyquist", vec![1.621_997]),
    ] {
        let answer = json(
            folder.path(),
            &[
                "lobes",
                &case_path,
                "--frf",
                &table,
                "--method",
                method,
                "--rpm",
                rpm,
                "--depth-mm",
                "0.1:4:40",
                "--json",
            ],
        );
        let found = depths(&answer);
        assert_eq!(found.len(), expected.len(), "{rpm} {method}: {found:?}");
        for (found, expected) in found.iter().zip(&expected) {
            // The error is 1e-4 from the number of harmonics and as much from the table: receptances above 100 Hz and below 2
            // Hz, and interpolation between lines.
            assert!(
                (found / expected - 1.0).abs() < 5e-4,
                "{rpm} {method}: {found} {expected}"
            );
        }
    }
    // Without --method the command uses the method that includes flips. The point is far below the limit.
    let answer = json(
        folder.path(),
        &["lobes", &case_path, "--frf", &table, "--at", "1045,2", "--json"],
    );
    assert_eq!(answer["method"], "multi-frequency");
    let point = &answer["points"][0];
    let (found, error) = (
        &point["multiplier_abs"],
        point["error"].as_f64().expect("an error"),
    );
    assert!(
        (found.as_f64().expect("a number") - 1.034_132).abs() < error.max(1e-4) && error < 5e-3,
        "{point}"
    );
    assert_eq!(
        (&point["verdict"], &point["kind"]),
        (&"unstable".into(), &"flip".into())
    );
}

#[test]
fn missing_entries_of_a_table_are_named() {
    let folder = folder();
    let table = folder.path().join("frf.csv");
    write_table(&table, &[Direction::X, Direction::Y], (5.0, 60.0, 0.5));
    let (case_path, table_path) = (text(&case("kuka-kr90-acetal")), text(&table));
    let run = |more: &[&str]| {
        let mut arguments = vec!["lobes", &case_path, "--frf", &table_path];
        arguments.extend(more);
        quietcut(folder.path(), &arguments)
    };
    let answer = run(&["--rpm", "900", "--depth-mm", "0.1:4:40", "--json"]);
    assert_eq!(answer.status, Some(0), "{answer:?}");
    for said in ["frf.csv", "hxz", "hzz", "zero", "between the lines"] {
        assert!(answer.stderr.contains(said), "{answer:?}");
    }
    assert!(!answer.stderr.contains("hxy"), "{answer:?}");
    run(&["--method", "collocation", "--at", "900,1"]).refused(&["frf.csv", "structure", "zoa"]);
    run(&["--method", "zoa", "--harmonics", "3", "--at", "900,1"])
        .refused(&["--harmonics", "multi-frequency"]);
    run(&["--harmonics", "0", "--at", "900,1"]).refused(&["--harmonics", "zoa"]);
    run(&["--harmonics", "x", "--at", "900,1"]).refused(&["`x`", "400"]);

    // A table that ends below the chatter frequency cannot give the limit.
    write_table(&table, &ALL, (5.0, 16.0, 0.1));
    run(&["--method", "zoa", "--rpm", "900", "--depth-mm", "0.1:9:40"]).refused(&["16 Hz", "9 mm", "gain"]);
    run(&["--at", "900,9"]).refused(&["16 Hz", "9 mm", "gain"]);
    // A table that begins above the chatter frequency is refused with this reason.
    write_table(&table, &ALL, (17.5, 100.0, 0.1));
    let answer = run(&["--method", "zoa", "--at", "900,0.1"]);
    assert!(
        answer.stderr.contains("hyy") && answer.stderr.contains("mode may lie"),
        "{answer:?}"
    );

    fs::write(
        &table,
        "frequency_hz,hyy_re [m/N],hyy_im [m/N]\n5,1e-6,0\n6,1e-6,oops\n",
    )
    .expect("a file");
    run(&["--at", "900,1"]).refused(&["frf.csv", "line 3", "oops"]);
    fs::write(
        &table,
        "frequency_hz,hyy_re [m/N],hyy_im [m/N]\n5,1e-6,0\n6,1e-6,0\n",
    )
    .expect("a file");
    run(&["--at", "900,1"]).refused(&["frf.csv", "2 lines"]);
    let missing = text(&folder.path().join("none.csv"));
    quietcut(
        folder.path(),
        &["lobes", &case_path, "--frf", &missing, "--at", "900,1"],
    )
    .refused(&["none.csv"]);
}

#[test]
fn methods_are_refused_where_they_are_not_defined() {
    let folder = folder();
    let run = |name: &str, method: &str| {
        let case = text(&case(name));
        quietcut(
            folder.path(),
            &["lobes", &case, "--method", method, "--at", "900,1"],
        )
    };
    for method in ["zoa", "nyquist", "multi-frequency", "mode-coupling"] {
        run("kuka-kr90-full-cubic", method).refused(&["cubic", "--linear"]);
        run("staubli-tx200-as-printed", method).refused(&["stiffness", "(1,6)", "damping"]);
        run("kuka-kr90-x20", method).refused(&["[tool]"]);
    }
    run("insperger-1dof-ad1", "mode-coupling").refused(&["mode coupling", "two modes"]);
}
