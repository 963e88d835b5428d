//! Mode shapes over points from a roving hammer and from a roving sensor, against modal superposition written here.

#![allow(clippy::unwrap_used)]

use std::f64::consts::TAU;
use std::fmt::Write;
use std::path::Path;

use quietcut_tests::command::{folder, quietcut};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use serde_json::Value;

const RATE_HZ: f64 = 1024.0;

/// Natural frequency, Hz, damping ratio, and mass-normalized shape at five points, 1/√kg.
const MODES: [(f64, f64, [f64; 5]); 2] = [
    (61.0, 0.015, [0.21, 0.48, 0.77, 0.95, 1.1]),
    (113.0, 0.01, [0.9, 0.6, -0.15, -0.7, -1.2]),
];

/// Four impacts of a hammer at `force`, measured at `sensor`, of the structure with a mass of `sensor_kg` at the sensor: to first
/// order ω_r falls by the factor √(1 + m φ²).
fn write_taps(path: &Path, force: usize, sensor: usize, sensor_kg: f64, seed: u64) {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let count = (8.4 * RATE_HZ) as usize;
    let (mut hit, mut motion) = (vec![0.0; count], vec![0.0; count]);
    for impact in 0..4 {
        let first = ((0.2 + 2.0 * f64::from(impact)) * RATE_HZ) as usize;
        for sample in 0..5 {
            let size = 150.0 * (TAU * (f64::from(sample) + 1.0) / 12.0).sin();
            hit[first + sample as usize] += size;
            for (at, x) in motion.iter_mut().enumerate().skip(first + sample as usize) {
                let t = (at - first - sample as usize) as f64 / RATE_HZ;
                for (hertz, damping, shape) in &MODES {
                    let own = TAU * hertz / (1.0 + sensor_kg * shape[sensor].powi(2)).sqrt();
                    let damped = own * (1.0 - damping * damping).sqrt();
                    *x += size / RATE_HZ * shape[force] * shape[sensor] / damped
                        * (-damping * own * t).exp()
                        * (damped * t).sin();
                }
            }
        }
    }
    let largest = motion.iter().fold(0.0, |a: f64, x| a.max(x.abs()));
    let mut text = String::from("t [s],fx [N],x [m]\n");
    for (at, (force, x)) in hit.iter().zip(&motion).enumerate() {
        let [a, b]: [f64; 2] = std::array::from_fn(|_| StandardNormal.sample(&mut random));
        let _ = writeln!(
            text,
            "{},{},{}",
            at as f64 / RATE_HZ,
            force + 0.02 * a,
            x + 5e-4 * largest * b
        );
    }
    std::fs::write(path, text).unwrap();
    std::fs::write(
        path.with_extension("toml"),
        "kind = \"hammer\"\n[channels.x]\nanti_aliasing = true\n[channels.fx]\nanti_aliasing = true\n",
    )
    .unwrap();
}

fn identify(here: &Path, more: &[&str]) -> Value {
    let mut arguments = vec![
        "identify",
        "tap-1.csv",
        "tap-2.csv",
        "tap-3.csv",
        "tap-4.csv",
        "tap-5.csv",
    ];
    arguments.extend(["--method", "mode-shapes", "--band-hz", "30:160", "--json"]);
    arguments.extend(more);
    quietcut(here, &arguments).json()
}

/// Asserts natural frequencies, damping ratios and shapes of an answer; `scale` is 1 for a mass-normalized one.
fn assert_modes(answer: &Value, is_scaled: bool) {
    let shapes = &answer["mode_shapes"];
    assert_eq!(shapes["is_scaled"], is_scaled, "{answer}");
    let modes = shapes["modes"].as_array().unwrap();
    assert_eq!(modes.len(), 2, "{answer}");
    for (mode, (hertz, damping, shape)) in modes.iter().zip(MODES) {
        let value = |figure: &Value| figure["value"].as_f64().unwrap();
        assert!(
            (value(&mode["frequency_hz"]) / hertz - 1.0).abs() < 1e-3,
            "{mode}"
        );
        assert!(
            (value(&mode["damping_ratio"]) / damping - 1.0).abs() < 0.05,
            "{mode}"
        );
        let largest = shape
            .iter()
            .fold(0.0_f64, |a, b| if b.abs() > a.abs() { *b } else { a });
        let entries = mode["shape"].as_array().unwrap();
        assert_eq!(entries.len(), 5, "{mode}");
        // The sign of a mass-normalized shape is free.
        let sign = value(&entries[4]["re"]).signum() * shape[4].signum();
        for (index, (entry, truth)) in entries.iter().zip(shape).enumerate() {
            assert_eq!(entry["point"], (index + 1).to_string());
            let truth = if is_scaled { sign * truth } else { truth / largest };
            let scale = if is_scaled { largest.abs() } else { 1.0 };
            assert!(
                (value(&entry["re"]) - truth).abs() < 0.02 * scale,
                "{entry} {truth}"
            );
            assert!(value(&entry["im"]).abs() < 0.02 * scale, "{entry}");
        }
    }
}

#[test]
fn a_roving_hammer_gives_scaled_mode_shapes() {
    let folder = folder();
    let here = folder.path();
    for point in 0..5 {
        write_taps(
            &here.join(format!("tap-{}.csv", point + 1)),
            point,
            4,
            0.0,
            10 + point as u64,
        );
    }
    let points = [
        "--force-at",
        "1,2,3,4,5",
        "--sensor-at",
        "5",
        "--out",
        "shapes.csv",
        "--out",
        "shapes.svg",
    ];
    let answer = identify(here, &points);
    assert_modes(&answer, true);
    assert!(
        answer["mode_shapes"]["shifts"].as_array().unwrap().is_empty(),
        "{answer}"
    );
    // The sign of a receptance between two points is free.
    assert!(!answer["warnings"].to_string().contains("inverted"), "{answer}");
    let table = std::fs::read_to_string(here.join("shapes.csv")).unwrap();
    assert!(
        table.contains("re [1/√kg]") && table.lines().count() == 11,
        "{table}"
    );
    assert!(
        std::fs::read_to_string(here.join("shapes.svg"))
            .unwrap()
            .contains("shape")
    );
    // Averaged as if they were one point, these receptances would be those of none.
    for point in 1..=5 {
        let sidecar = here.join(format!("tap-{point}.toml"));
        let text = std::fs::read_to_string(&sidecar).unwrap();
        let text = text.replace("[channels.fx]", &format!("[channels.fx]\nat = \"{point}\""));
        std::fs::write(sidecar, text.replace("[channels.x]", "[channels.x]\nat = \"5\"")).unwrap();
    }
    quietcut(here, &["frf", "tap-1.csv", "tap-2.csv"]).refused(&["force was at 1, 2", "mode-shapes"]);
    // The sidecars state the points now; without the fifth recording there is no drive point.
    assert_modes(&identify(here, &[]), true);
    let without = quietcut(
        here,
        &[
            "identify",
            "tap-1.csv",
            "tap-2.csv",
            "tap-3.csv",
            "--method",
            "mode-shapes",
            "--band-hz",
            "30:160",
            "--json",
        ],
    )
    .json();
    assert_eq!(without["mode_shapes"]["is_scaled"], false);
    assert!(without["warnings"].to_string().contains("unscaled"), "{without}");
}

#[test]
fn a_roving_sensor_gives_mode_shapes_and_its_mass_is_said() {
    let folder = folder();
    let here = folder.path();
    let points = ["--force-at", "2", "--sensor-at", "1,2,3,4,5"];
    let write_all = |sensor_kg: f64, seed: u64| {
        for point in 0..5 {
            let file = here.join(format!("tap-{}.csv", point + 1));
            write_taps(&file, 1, point, sensor_kg, seed + point as u64);
        }
    };
    write_all(0.0, 20);
    let light = identify(here, &points);
    assert_modes(&light, true);
    assert!(
        light["mode_shapes"]["shifts"].as_array().unwrap().is_empty(),
        "{light}"
    );
    write_all(0.02, 30);
    let heavy = identify(here, &points);
    let shifts = heavy["mode_shapes"]["shifts"].as_array().unwrap();
    // 20 g at the fifth point lower 61 Hz by the factor √(1 + 0.02·1.1²), 1.2 %, at the first by 0.04 %.
    let first = shifts.iter().find(|shift| shift["mode"] == 0).unwrap();
    assert!(
        first["lowest_recordings"].to_string().contains("tap-5.csv"),
        "{first}"
    );
    assert!(
        first["highest_recordings"].to_string().contains("tap-1.csv"),
        "{first}"
    );
    let warnings = heavy["warnings"].to_string();
    assert!(
        warnings.contains("mass of a sensor that moves") && warnings.contains("tap-5.csv"),
        "{warnings}"
    );
}

#[test]
fn points_that_are_not_stated_are_asked_for() {
    let folder = folder();
    let here = folder.path();
    write_taps(&here.join("tap.csv"), 0, 4, 0.0, 40);
    quietcut(here, &["identify", "tap.csv", "--method", "mode-shapes"]).refused(&["tap.csv", "--force-at"]);
    quietcut(
        here,
        &[
            "identify",
            "tap.csv",
            "--method",
            "mode-shapes",
            "--force-at",
            "1,2",
        ],
    )
    .refused(&["--force-at 1,2", "1 recordings"]);
    quietcut(
        here,
        &["identify", "tap.csv", "--method", "linearity", "--force-at", "1"],
    )
    .refused(&["--force-at", "mode-shapes"]);
    let mapped = ["--map", "fx=fx@1:N,x=x@5:m", "--band-hz", "30:160", "--json"];
    let mut arguments = vec!["identify", "tap.csv", "--method", "mode-shapes"];
    arguments.extend(mapped);
    let answer = quietcut(here, &arguments).json();
    assert_eq!(
        answer["mode_shapes"]["modes"].as_array().unwrap().len(),
        2,
        "{answer}"
    );
    // The sidecar that look proposes keeps what --map states.
    let look = quietcut(here, &["look", "tap.csv", "--map", "fx=fx@1:N,x=x@5:m", "--json"]).json();
    let sidecar = look["records"][0]["sidecar"].as_str().unwrap();
    assert!(
        sidecar.contains("at = \"1\"") && sidecar.contains("at = \"5\""),
        "{sidecar}"
    );
}
