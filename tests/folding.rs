//! Hammer tests without an anti-aliasing filter: what folds into the records is in the intervals of modes and limits.

#![allow(clippy::expect_used, clippy::panic, clippy::unwrap_used)]

use std::path::Path;

use num_complex::Complex64;
use quietcut::case::Case;
use quietcut::structure::Form;
use quietcut_tests::command::{cases, folder, quietcut};
use serde_json::Value;

/// Records of both directions, 256 samples/s without a filter, of impacts of 10 ms.
fn records() -> [String; 2] {
    let all = Path::new(env!("CARGO_MANIFEST_DIR")).join("data/answers/recordings");
    ["hammer-x.csv", "hammer-y.csv"].map(|name| all.join(name).to_str().expect("the path is text").to_owned())
}

fn number(value: &Value) -> f64 {
    value.as_f64().unwrap_or_else(|| panic!("{value}"))
}

/// Real and imaginary part of an entry of a shape, with the half widths of their 90 % intervals.
fn entry(of: &Value) -> (Complex64, [f64; 2]) {
    let [re, im] = ["re", "im"].map(|part| &of[part]);
    let half = |part: &Value| 0.5 * (number(&part["ci90"][1]) - number(&part["ci90"][0]));
    (
        Complex64::new(number(&re["value"]), number(&im["value"])),
        [half(re), half(im)],
    )
}

/// Checks that residues of the modes in an answer lie within their intervals about those of the case, and off them by more
/// than a hundredth, which no noise of these records explains.
fn check_residues(answer: &Value, truth: &Case) {
    let Form::Modes(modes) = &truth.structure.as_ref().expect("the case has a structure").form else {
        panic!("the case has modes");
    };
    let found = answer["complex_modes"].as_array().expect("modes");
    assert_eq!(found.len(), modes.len(), "{answer}");
    for (found, mode) in found.iter().zip(modes) {
        for (p, response) in ["x", "y"].iter().enumerate() {
            for (q, force) in ["x", "y"].iter().enumerate() {
                let (right, _) = entry(&found["right"][response]);
                let (left, half) = entry(&found["left"][force]);
                let true_residue = mode.right[p] * mode.left[q];
                // Right shapes have no error by aliasing: the error of the residue is one of the left shape.
                let off = (right * left - true_residue) / right;
                let room = half[0].hypot(half[1]);
                assert!(off.norm() < room, "{response}{force}: {off} of {left} ± {half:?}");
                assert!(
                    off.norm() > 0.01 * left.norm(),
                    "{response}{force}: {off} of {left}"
                );
            }
        }
    }
}

#[test]
fn modes_and_limits_carry_what_folds_into_the_records() {
    let folder = folder();
    let truth_path = cases().join("kuka-kr90-acetal.toml");
    let truth = Case::read(&truth_path).expect("the case is valid");
    let [x, y] = &records();
    let modes = |sources: &[&str]| {
        let arguments = [&["identify"], sources, &["--method", "modes", "--json"]].concat();
        quietcut(folder.path(), &arguments).json()
    };
    check_residues(&modes(&[x, y]), &truth);
    quietcut(folder.path(), &["frf", x, y, "--out", "frf.csv", "--json"]).json();
    check_residues(&modes(&["frf.csv"]), &truth);

    // The tests have no z: the true limits are those of the machine without it.
    let mut rigid_in_z = std::fs::read_to_string(&truth_path).expect("the case can be read");
    let directions = r#"["x", "y", "z"]"#;
    assert!(rigid_in_z.contains(directions));
    rigid_in_z = rigid_in_z.replace(directions, r#"["x", "y"]"#);
    let rows: Vec<String> = rigid_in_z
        .lines()
        .map(|line| {
            match (
                line.starts_with("left =") || line.starts_with("right ="),
                line.rfind(", ["),
            ) {
                (true, Some(third)) => format!("{}]", &line[..third]),
                _ => line.to_owned(),
            }
        })
        .collect();
    std::fs::write(folder.path().join("rigid-in-z.toml"), rows.join("\n")).expect("a file can be written");
    let grid = [
        "--rpm",
        "700:1500:9",
        "--depth-mm",
        "0.1:20:40",
        "--no-refine",
        "--json",
    ];
    let lines = |arguments: &[&str]| {
        let answer = quietcut(folder.path(), &[arguments, &grid].concat()).json();
        answer["speeds"].as_array().expect("speeds").clone()
    };
    let exact = lines(&["lobes", "rigid-in-z.toml"]);
    let measured = lines(&["lobes", "rigid-in-z.toml", "--frf", "frf.csv"]);
    for (exact, measured) in exact.iter().zip(&measured) {
        let of = |line: &Value, what: &str| number(&line["first_limit"][what]);
        let (limit_mm, found_mm) = (of(exact, "depth_mm"), of(measured, "depth_mm"));
        let error_mm = of(measured, "error_mm");
        println!(
            "{}: {limit_mm:.3} mm, {found_mm:.3} ± {error_mm:.3} mm",
            exact["rpm"]
        );
        assert!(
            (found_mm - limit_mm).abs() < error_mm,
            "{found_mm} ± {error_mm}, {limit_mm} mm"
        );
        assert!(error_mm < 0.6 * limit_mm, "{found_mm} ± {error_mm}");
    }
}
