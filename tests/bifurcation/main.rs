//! `quietcut bifurcation`: branches and curves against the numbers of other programs, records that go on after an
//! interrupt, and one message for each wrong input.

#![allow(clippy::expect_used, clippy::panic)]

mod doubled;
mod records;

use std::fs;
use std::path::Path;

use quietcut_tests::command::{Outcome, cases, folder, quietcut, words};
use serde_json::Value;

/// Spindle speed, rev/min, of a tooth period τ in the dimensionless units of chapter 6 of the thesis.
fn rpm(tau: f64) -> f64 {
    30.0 * 109.6416 / tau
}

/// Factor from depth in mm to the dimensionless depth w of chapter 6: 76 MPa / 2.26 MN/m.
const W_PER_MM: f64 = 76.0 / 2260.0;

fn run(folder: &Path, case: &str, options: &str) -> Outcome {
    let case = cases().join(format!("{case}.toml")).display().to_string();
    let mut arguments = vec!["bifurcation", &case];
    arguments.extend(words(options));
    quietcut(folder, &arguments)
}

fn number(value: &Value) -> f64 {
    value.as_f64().unwrap_or_else(|| panic!("{value} is no number"))
}

fn list(value: &Value) -> &[Value] {
    value.as_array().unwrap_or_else(|| panic!("{value} is no list"))
}

fn read(folder: &Path, name: &str) -> Value {
    let text = fs::read_to_string(folder.join(name)).unwrap_or_else(|error| panic!("{name}: {error}"));
    serde_json::from_str(&text).unwrap_or_else(|error| panic!("{name}: {error}"))
}

/// Answer for a branch over the depth at a tooth period.
fn over_depth(tau: f64) -> Value {
    let options = format!("--vary depth --range 0:15 --fix rpm={} --json", rpm(tau));
    run(folder().path(), "kuka-kr90-full-cubic", &options).json()
}

/// The event of an answer that is the first loss of stability.
fn first_loss(answer: &Value) -> &Value {
    let found = list(&answer["events"])
        .iter()
        .find(|event| event["first_loss"] == true);
    found.unwrap_or_else(|| panic!("no first loss: {}", answer["events"]))
}

#[test]
fn first_losses_are_those_of_two_other_programs() {
    for (tau, w, kind) in [
        (3.13, 0.031_391_631, "flip"),
        (4.0, 0.059_111_115, "torus"),
        (6.0, 0.272_46, "torus"),
        (6.4, 0.377_340_698, "torus"),
        (6.6, 0.405_89, "torus"),
    ] {
        let answer = over_depth(tau);
        let loss = first_loss(&answer);
        let found = number(&loss["depth_mm"]) * W_PER_MM;
        println!("τ {tau}: {found:.7}, {loss}");
        // The references have four to eight digits.
        assert!((found / w - 1.0).abs() < 2e-5, "{tau}: {found} instead of {w}");
        assert_eq!(loss["kind"], kind, "{tau}");
        // Integration in time: beyond the first two losses the vibration settles at a size that grows from zero, beyond
        // that in the pocket it escapes.
        match tau {
            3.13 | 4.0 => assert_eq!(loss["criticality"], "supercritical", "{tau}"),
            6.0 => assert_eq!(loss["criticality"], "subcritical", "{tau}"),
            _ => {}
        }
        assert!((number(&loss["rpm"]) / rpm(tau) - 1.0).abs() < 1e-12);
        assert!(number(&loss["error_mm"]) < 1e-4, "{loss}");
        // Just before the loss the orbit is stable, just beyond it is not.
        let before = |point: &&Value| number(&point["depth_mm"]) < number(&loss["depth_mm"]);
        let branch = list(&answer["branch"]);
        let last = branch.iter().take_while(before).last().expect("an orbit before");
        let next = branch
            .iter()
            .find(|point| !before(point))
            .expect("an orbit beyond");
        assert!(number(&last["multiplier_abs"]) < 1.0 && number(&next["multiplier_abs"]) > 1.0);
    }
}

#[test]
fn a_flip_is_half_a_rotation_per_tooth_and_tori_have_the_rotations_of_figure_6_13() {
    let answer = over_depth(3.13);
    assert_eq!(number(&first_loss(&answer)["rotation_per_tooth"]), 0.5);
    assert_eq!(number(&first_loss(&answer)["rotation"]), 0.0);
    for (name, tau, rotation) in [
        ("PA", 5.04, 0.4),
        ("PB", 4.17, 2.0 / 3.0),
        ("PC", 2.07, 0.75),
        ("PD", 1.34, 0.5),
    ] {
        let answer = over_depth(tau);
        let loss = first_loss(&answer);
        assert_eq!(loss["kind"], "torus");
        let found = number(&loss["rotation"]);
        assert!((found - rotation).abs() < 0.002, "{name}: {found}");
    }
}

#[test]
fn a_branch_is_not_the_stability_limit() {
    // At τ = 6.667 the torus of w = 0.335 comes first, that of w = 0.414 lies on unstable orbits.
    let answer = over_depth(6.667);
    let losses: Vec<f64> = list(&answer["events"])
        .iter()
        .filter(|event| event["kind"] == "torus" && event["gain"] == false)
        .map(|event| number(&event["depth_mm"]) * W_PER_MM)
        .collect();
    // The references have three digits.
    assert!((losses[0] - 0.335).abs() < 1e-3, "{losses:?}");
    assert!(losses.iter().any(|w| (w - 0.414).abs() < 1e-3), "{losses:?}");
    assert!((number(&first_loss(&answer)["depth_mm"]) * W_PER_MM - losses[0]).abs() < 1e-12);
    // For 1/τ from 0.161 to 0.165 the first loss is a fold, and two stable orbits exist at 0.165.
    let answer = over_depth(1.0 / 0.165);
    assert_eq!(first_loss(&answer)["kind"], "fold");
    assert_eq!(list(&answer["bistable_mm"]).len(), 1);
    assert!(number(&answer["bistable_mm"][0][0]) > 8.55 && number(&answer["bistable_mm"][0][1]) < 8.63);
    let text = run(
        folder().path(),
        "kuka-kr90-full-cubic",
        &format!("--vary depth --range 0:15 --fix rpm={}", rpm(6.667)),
    );
    for said in [
        "first loss of stability",
        "unstable already",
        "The stability limit is the first loss",
    ] {
        assert!(text.stdout.contains(said), "{said}: {}", text.stdout);
    }
}

#[test]
fn the_branch_ends_at_the_range_and_other_parameters_cross_at_the_same_orbit() {
    let folder = folder();
    let loss_mm = number(&first_loss(&over_depth(4.0))["depth_mm"]);
    for (vary, range, key, own) in [
        ("rpm", "790:850", "rpm", rpm(4.0)),
        ("feed", "0.1:0.2", "feed_mm", 0.15),
        ("kappa", "0.2:2", "kappa", 1.0),
        ("nu", "0.5:1.5", "nu", 1.0),
    ] {
        let speed = if vary == "rpm" {
            String::new()
        } else {
            format!("--fix rpm={}", rpm(4.0))
        };
        let options = format!("--vary {vary} --range {range} {speed} --fix depth_mm={loss_mm} --json");
        let answer = run(folder.path(), "kuka-kr90-full-cubic", &options).json();
        let nearest = list(&answer["events"])
            .iter()
            .map(|event| number(&event[key]))
            .min_by(|a, b| (a - own).abs().total_cmp(&(b - own).abs()))
            .unwrap_or_else(|| panic!("{vary}: no event"));
        // The depth is known to 1e-7; the slope over these parameters magnifies that.
        assert!((nearest / own - 1.0).abs() < 1e-4, "{vary}: {nearest}");
        let branch = list(&answer["branch"]);
        let (first, last) = range.split_once(':').expect("a range");
        assert_eq!(number(&branch[0][key]), first.parse::<f64>().expect("a number"));
        let end = number(&branch[branch.len() - 1][key]);
        assert!(
            (end / last.parse::<f64>().expect("a number") - 1.0).abs() < 1e-12,
            "{vary}: {end}"
        );
    }
}

const CURVE: &str =
    "--vary depth --range 0:16 --fix rpm=822.312 --curve torus --in rpm,depth --range 700:950";

#[test]
fn a_torus_curve_passes_the_losses_of_branches() {
    let folder = folder();
    let answer = run(folder.path(), "kuka-kr90-full-cubic", &format!("{CURVE} --json")).json();
    let curves = list(&answer["curves"]);
    assert_eq!(curves.len(), 1, "{answer}");
    let points = list(&curves[0]["points"]);
    assert_eq!(curves[0]["kind"], "torus");
    for end in [&points[0], &points[points.len() - 1]] {
        let options = format!(
            "--vary depth --range 0:16 --fix rpm={} --json",
            number(&end["rpm"])
        );
        let branch = run(folder.path(), "kuka-kr90-full-cubic", &options).json();
        let own = number(&end["depth_mm"]);
        let nearest = list(&branch["events"])
            .iter()
            .filter(|event| event["kind"] == "torus")
            .min_by(|a, b| {
                let miss = |event: &Value| (number(&event["depth_mm"]) - own).abs();
                miss(a).total_cmp(&miss(b))
            })
            .expect("a torus");
        let miss = (number(&nearest["depth_mm"]) - own).abs();
        let both = number(&nearest["error_mm"]) + number(&curves[0]["error"]["depth_mm"]);
        assert!(miss <= both && both < 1e-4, "{end}: {miss} {both}");
        assert!((number(&nearest["rotation"]) - number(&end["rotation"])).abs() < 1e-5);
    }
}

#[test]
fn wrong_input_is_named_with_what_would_be_right() {
    let folder = folder();
    let refused = |case: &str, options: &str, said: &[&str]| run(folder.path(), case, options).refused(said);
    let cubic = "kuka-kr90-full-cubic";
    refused(cubic, "--vary depth --range 0:5", &["--fix rpm=", "rpm=548"]);
    refused(
        cubic,
        "--vary kappa --range 0:1 --fix rpm=822",
        &["--fix depth_mm="],
    );
    refused(
        cubic,
        "--vary speed --range 0:5",
        &["`speed`", "depth, rpm, feed, kappa, nu"],
    );
    refused(
        cubic,
        "--vary depth --range 0:5 --fix depth=3",
        &["`depth`", "write depth_mm=3"],
    );
    refused(
        cubic,
        "--vary depth --range 0:5 --fix rpm=-3",
        &["rpm = -3", "above 0"],
    );
    refused(
        cubic,
        "--vary depth --range 0:5 --fix rpm=822 --fix depth_mm=3",
        &["depth varies"],
    );
    refused(
        cubic,
        "--vary depth --range 0:5 --fix rpm=822 --fix rpm=823",
        &["twice"],
    );
    refused(
        cubic,
        "--vary depth --range 5 --fix rpm=822",
        &["--range 5", "0:12"],
    );
    refused(
        cubic,
        "--vary depth --range=-1:5 --fix rpm=822",
        &["depth_mm = -1", "0 mm or more"],
    );
    refused(cubic, "--vary rpm --range 0:900 --fix depth_mm=1", &["rpm = 0"]);
    refused(
        cubic,
        "--vary depth --range 0:5 --range 0:6 --fix rpm=822",
        &["--curve"],
    );
    let curve = "--vary depth --range 0:5 --fix rpm=822 --curve torus";
    refused(cubic, curve, &["--in"]);
    refused(
        cubic,
        &format!("{curve} --in rpm,depth"),
        &["two --range", "493:592"],
    );
    refused(cubic, &format!("{curve} --in rpm,rpm"), &["two different"]);
    refused(
        cubic,
        &format!("{curve} --in rpm,kappa --range 0:1"),
        &["--vary, depth"],
    );
    refused(
        cubic,
        &format!("{curve} --in rpm,depth --range 500:600"),
        &["rpm = 822", "500:600"],
    );
    let none = "--vary depth --range 0:5 --fix rpm=822 --curve fold --in rpm,depth --range 800:900";
    refused(cubic, none, &["no fold", "torus at depth_mm = 1.7"]);
    refused(
        "kuka-kr90-full",
        "--vary kappa --range 0:1 --fix rpm=822 --fix depth_mm=1",
        &["cubic_stiffness"],
    );
    refused(
        "kuka-kr90-x20",
        "--vary depth --range 0:1 --fix rpm=822",
        &["[tool]"],
    );
    assert_eq!(fs::read_dir(folder.path()).expect("the folder").count(), 0);
}

#[test]
fn a_branch_that_ends_early_is_kept_and_the_reason_is_named() {
    let folder = folder();
    // Without damping the forced vibration grows beyond all bounds at resonance: 17.4 Hz at 523 rev/min.
    let text = fs::read_to_string(cases().join("kuka-kr90-full.toml")).expect("a case");
    let (head, rest) = text.split_once("damping = [").expect("a damping matrix");
    let (_, tail) = rest.split_once("],\n]").expect("its end");
    let undamped = format!("{head}damping = [\n  [1e-3, 0.0],\n  [0.0, 1e-3],\n]{tail}");
    fs::write(folder.path().join("undamped.toml"), undamped).expect("written");
    let line = "bifurcation undamped.toml --vary rpm --range 560:500 --fix depth_mm=0.01 --out broken.json --out broken.html";
    let outcome = quietcut(folder.path(), &words(line));
    assert_eq!(outcome.status, Some(1), "{outcome:?}");
    assert!(
        outcome.stderr.contains("ends early") && outcome.stderr.contains("--range"),
        "{outcome:?}"
    );
    let answer = read(folder.path(), "broken.json");
    let branch = list(&answer["branch"]);
    let last = number(&branch[branch.len() - 1]["rpm"]);
    assert!(branch.len() > 100 && (last - 523.0).abs() < 1.0, "{last}");
    assert!(
        answer["incomplete"]["reason"]
            .as_str()
            .is_some_and(|reason| reason.contains("rev/min"))
    );
    assert!(folder.path().join("broken.jsonl").exists());
    let page = fs::read_to_string(folder.path().join("broken.html")).expect("the page");
    assert!(page.contains("the branch ends early"));
}

#[test]
fn simulated_cuts_lie_on_the_stable_branch_and_leave_it_where_its_torus_is() {
    let folder = folder();
    let options = "--vary depth --range 0:15:16 --fix rpm=559 --strobe --json --out strobe.svg";
    let answer = run(folder.path(), "kuka-kr90-half-cubic", options).json();
    let loss_mm = number(&first_loss(&answer)["depth_mm"]);
    let branch: Vec<[f64; 3]> = list(&answer["branch"])
        .iter()
        .map(|at| {
            let displacement = &at["displacement_mm"];
            [
                number(&at["depth_mm"]),
                number(&displacement[0]),
                number(&displacement[1]),
            ]
        })
        .collect();
    let sets = list(&answer["strobe"]);
    assert_eq!(sets.len(), 16);
    for set in sets {
        let depth_mm = number(&set["depth_mm"]);
        let after = branch
            .iter()
            .position(|at| at[0] >= depth_mm - 1e-9)
            .expect("an orbit");
        let (low, high) = (branch[after.saturating_sub(1)], branch[after]);
        let share = if high[0] > low[0] {
            (depth_mm - low[0]) / (high[0] - low[0])
        } else {
            0.0
        };
        let points = list(&set["displacement_mm"]);
        assert_eq!(points.len(), 100);
        let miss = points.iter().fold(0.0_f64, |most, point| {
            let axes = [0, 1].map(|axis| {
                let on_branch = low[axis + 1] + share * (high[axis + 1] - low[axis + 1]);
                (number(&point[axis]) - on_branch).abs()
            });
            most.max(axes[0]).max(axes[1])
        });
        println!("{depth_mm} mm: up to {miss:.2e} mm from the branch");
        // Straight lines between the orbits of the branch err by less than 1e-3 mm; the chatter of the next depth is larger by
        // far. The loss lies between two of the depths.
        if depth_mm < loss_mm {
            assert!(miss < 1e-3, "{depth_mm}: {miss}");
        } else {
            assert!(miss > 1e-2, "{depth_mm}: {miss}");
        }
    }
    assert!(loss_mm > 12.0 && loss_mm < 13.0, "{loss_mm}");
    let chart = fs::read_to_string(folder.path().join("strobe.svg")).expect("the chart");
    assert!(chart.contains("simulated cuts") && chart.contains("displacement when a tooth enters"));
}

#[test]
fn charts_and_tables_show_branch_and_curves() {
    let folder = folder();
    let at = folder.path();
    let options = format!("{CURVE} --out b.svg --out b.html --out b.csv");
    assert_eq!(run(at, "kuka-kr90-full-cubic", &options).status, Some(0));
    let read = |name: &str| fs::read_to_string(at.join(name)).expect("written");
    let page = read("b.html");
    for words in [
        "first loss: torus",
        "unstable orbit",
        "spindle speed [rev/min]",
        "torus curve:",
    ] {
        assert!(page.contains(words), "{words}");
    }
    assert!(read("b.svg").contains("axial depth [mm]"));
    let table = read("b.csv");
    assert!(table.starts_with("depth_mm,amplitude_feed_mm"), "{table}");
    assert!(table.lines().count() > 10);
}
