//! UFF 58 files that quietcut writes are read by the independent reader pyuff.
#![allow(clippy::expect_used)]

use std::path::{Path, PathBuf};
use std::process::Command;

use quietcut::frf::{Frf, FrfTable};
use quietcut::recording::{Channel, Quantity, Recording, Sidecar, UffForm};
use quietcut::structure::Direction;
use serde_json::Value;

/// Python program that prints the content of a UFF file as pyuff reads it.
const SCRIPT: &str = r#"
import json, sys, pyuff
file = pyuff.UFF(sys.argv[1])
sets = []
for kind, data in zip(file.get_set_types(), file.read_sets()):
    if kind != 58:
        sets.append({"type": int(kind), "length": float(data["length"]), "force": float(data["force"])})
        continue
    values = [complex(value) for value in data["data"]]
    sets.append({
        "type": 58,
        "function": int(data["func_type"]),
        "response": [data["rsp_ent_name"].strip(), int(data["rsp_dir"])],
        "reference": int(data["ref_dir"]),
        "kinds": [int(data["ordinate_spec_data_type"]), int(data["orddenom_spec_data_type"])],
        "units": [data["ordinate_axis_units_lab"].strip(), data["orddenom_axis_units_lab"].strip()],
        "x": [float(value) for value in data["x"]],
        "re": [value.real for value in values],
        "im": [value.imag for value in values],
    })
print(json.dumps(sets))
"#;

/// The Python interpreter for which `tests/install-tools` has installed pyuff.
fn python() -> PathBuf {
    let python = Path::new(env!("CARGO_MANIFEST_DIR")).join("../target/tools/bin/python");
    assert!(
        python.exists(),
        "{} is missing: run tests/install-tools",
        python.display()
    );
    python
}

fn read_by_pyuff(python: &Path, file: &Path) -> Vec<Value> {
    let output = Command::new(python)
        .args(["-W", "ignore", "-c", SCRIPT])
        .arg(file)
        .output()
        .expect("python starts");
    assert!(
        output.status.success(),
        "{}",
        String::from_utf8_lossy(&output.stderr)
    );
    serde_json::from_slice::<Vec<Value>>(&output.stdout).expect("JSON")
}

fn numbers(value: &Value) -> Vec<f64> {
    let values = value.as_array().expect("a list");
    values
        .iter()
        .map(|value| value.as_f64().expect("a number"))
        .collect()
}

/// Asserts that numbers agree to this number of digits after the first.
fn assert_same(found: &Value, expected: impl IntoIterator<Item = f64>, digits: i32, what: &str) {
    let found = numbers(found);
    let expected: Vec<f64> = expected.into_iter().collect();
    assert_eq!(found.len(), expected.len(), "{what}");
    for (a, b) in found.iter().zip(&expected) {
        assert!(
            (a - b).abs() <= 10f64.powi(-digits) * b.abs().max(1e-30),
            "{what}: {a} {b}"
        );
    }
}

#[test]
#[ignore = "program of others: tests/install-tools gets pyuff"]
fn recordings_are_read_by_pyuff() {
    let python = python();
    let folder = tempfile::tempdir().expect("a folder");
    let samples = |scale: f64| {
        (0..25)
            .map(|k| scale * (f64::from(k) * 0.7).sin())
            .collect::<Vec<f64>>()
    };
    let channel = |name: &str, quantity, scale| Channel {
        name: name.into(),
        quantity,
        samples: samples(scale),
    };
    let recording = Recording {
        path: "a.uff".into(),
        sample_rate_hz: 10_240.0,
        start_s: 0.25,
        since_s: 0.0,
        channels: vec![
            channel("fx", Quantity::Force, 123.456_789),
            channel("ay", Quantity::Acceleration, -9.8e-4),
            channel("tacho", Quantity::Level, 1.0),
        ],
        sidecar: Sidecar::default(),
    };
    for form in [UffForm::Text, UffForm::Binary] {
        let path = folder.path().join("a.uff");
        recording.write_uff(&path, form).expect("written");
        let sets = read_by_pyuff(&python, &path);
        assert_eq!(sets.len(), 4);
        assert_eq!((&sets[0]["type"], &sets[0]["length"]), (&164.into(), &1.0.into()));
        for (set, (channel, direction, kind, unit)) in sets[1..].iter().zip([
            (&recording.channels[0], 1, 13, "N"),
            (&recording.channels[1], 2, 12, "m/s^2"),
            (&recording.channels[2], 0, 1, "1"),
        ]) {
            let name = &channel.name;
            assert_eq!(set["function"], 1, "{name}");
            assert_eq!(set["response"][0], name.as_str());
            assert_eq!(set["response"][1], direction, "{name}");
            assert_eq!((&set["kinds"][0], &set["units"][0]), (&kind.into(), &unit.into()));
            // The file stores the time step with seven digits.
            assert_same(
                &set["x"],
                (0..25).map(|k| 0.25 + f64::from(k) / 10_240.0),
                7,
                name,
            );
            assert_same(&set["re"], channel.samples.iter().copied(), 12, name);
        }
    }
}

#[test]
#[ignore = "program of others: tests/install-tools gets pyuff"]
fn frequency_response_functions_are_read_by_pyuff() {
    let python = python();
    let folder = tempfile::tempdir().expect("a folder");
    for uneven in [0.0, 0.01] {
        let frequency_hz: Vec<f64> = (0..40)
            .map(f64::from)
            .map(|k| 5.0 + 0.5 * k + uneven * k * k)
            .collect();
        let receptance = frequency_hz
            .iter()
            .map(|f| num_complex::Complex64::new(1e-6 / f, -2e-7 * f))
            .collect();
        let entry = Frf {
            response: Direction::Z,
            force: Direction::Y,
            receptance,
            coherence: Some(frequency_hz.iter().map(|f| 5.0 / f).collect()),
            folding: None,
        };
        let table = FrfTable::new(Path::new("a.uff"), frequency_hz.clone(), vec![entry]).expect("a table");
        for form in [UffForm::Text, UffForm::Binary] {
            let path = folder.path().join("a.uff");
            table.write_uff(&path, form).expect("written");
            let sets = read_by_pyuff(&python, &path);
            assert_eq!(sets.len(), 3);
            let (frf, coherence) = (&sets[1], &sets[2]);
            assert_eq!((&frf["function"], &coherence["function"]), (&4.into(), &6.into()));
            assert_eq!((&frf["response"][1], &frf["reference"]), (&3.into(), &2.into()));
            assert_eq!(frf["kinds"], serde_json::json!([8, 13]));
            assert_eq!(frf["units"], serde_json::json!(["m", "N"]));
            let entry = &table.entries()[0];
            for set in [frf, coherence] {
                // In the text form the file stores seven digits.
                assert_same(&set["x"], frequency_hz.iter().copied(), 6, "frequency");
            }
            assert_same(&frf["re"], entry.receptance.iter().map(|h| h.re), 12, "real");
            assert_same(&frf["im"], entry.receptance.iter().map(|h| h.im), 12, "imaginary");
            let known = entry.coherence.iter().flatten().copied();
            assert_same(&coherence["re"], known, 12, "coherence");
        }
    }
}
