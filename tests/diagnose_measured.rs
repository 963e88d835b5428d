//! `quietcut diagnose` on records that others measured: `QUIETCUT_DATA` names the folder.

#![allow(clippy::unwrap_used)]

use std::path::{Path, PathBuf};

use quietcut::case::Case;
use quietcut::diagnose::answer::Outcome;
use quietcut::diagnose::{Diagnosis, Options, diagnose};
use quietcut::recording::{Channel, Kind, Quantity, Recording, Sidecar};

fn folder(name: &str) -> Option<PathBuf> {
    let folder = std::env::var_os("QUIETCUT_DATA").map(|data| PathBuf::from(data).join(name));
    if folder.is_none() {
        println!("QUIETCUT_DATA is not set: {name} is not looked at");
    }
    folder
}

fn recording(
    name: &str,
    rate_hz: f64,
    force: &[f64],
    displacement: &[f64],
    input: Option<&str>,
) -> Recording {
    let channel = |name: &str, quantity, samples: &[f64]| Channel {
        name: name.into(),
        quantity,
        samples: samples.to_vec(),
    };
    Recording {
        path: name.into(),
        sample_rate_hz: rate_hz,
        start_s: 0.0,
        channels: vec![
            channel("fx", Quantity::Force, force),
            channel("x", Quantity::Displacement, displacement),
        ],
        sidecar: Sidecar {
            kind: Some(Kind::Shaker),
            input: input.map(|name| vec![name.into()]),
            ..Sidecar::default()
        },
    }
}

fn case_text(mass_kg: f64, damping_ns_per_m: f64, stiffness_n_per_m: f64) -> String {
    format!(
        "name = \"believed\"\n[structure]\nkind = \"matrices\"\ndirections = [\"x\"]\nmass = [[{mass_kg:e}]]\ndamping = [[{damping_ns_per_m:e}]]\nstiffness = [[{stiffness_n_per_m:e}]]\n"
    )
}

fn ask(text: &str, recordings: &[Recording]) -> Diagnosis {
    let case = Case::parse(Path::new("believed.toml"), text).unwrap();
    let diagnosis = diagnose(&case, recordings, &Options::default()).unwrap();
    println!("{}", serde_json::to_string_pretty(&diagnosis).unwrap());
    diagnosis
}

fn names(diagnosis: &Diagnosis) -> Vec<&'static str> {
    diagnosis.causes.iter().map(|cause| cause.name).collect()
}

/// What is found stays found: with it in the baseline it is not named again.
fn not_again(text: &str, found: &Diagnosis, recordings: &[Recording]) {
    let extended = found.extended_case(text).unwrap();
    let again = ask(&extended, recordings);
    for name in names(found) {
        assert!(!names(&again).contains(&name), "{name} again");
    }
}

const SILVERBOX_RATE_HZ: f64 = 610.35;

#[test]
fn the_silverbox_has_a_cubic_spring() {
    let Some(folder) = folder("silverbox") else { return };
    let text = std::fs::read_to_string(folder.join("SNLS80mV.csv")).unwrap();
    let rows = text
        .lines()
        .skip(1)
        .filter(|line| !line.trim_matches(',').is_empty());
    let mut columns = [Vec::new(), Vec::new()];
    for row in rows {
        for (column, field) in columns.iter_mut().zip(row.split(',')) {
            column.push(field.trim().parse::<f64>().unwrap());
        }
    }
    let [force, displacement] = columns.map(|column| {
        let mean = column.iter().sum::<f64>() / column.len() as f64;
        column.into_iter().map(|x| x - mean).collect::<Vec<f64>>()
    });
    // The linear case: natural frequency and damping of small motion as published with the record, a spring of 1 N/m (the
    // record is in volts).
    let omega = std::f64::consts::TAU * 68.33;
    let believed = case_text(1.0 / (omega * omega), 2.0 * 0.0486 / omega, 1.0);
    let train = recording(
        "train.csv",
        SILVERBOX_RATE_HZ,
        &force[49_270..80_000],
        &displacement[49_270..80_000],
        None,
    );
    let found = ask(&believed, std::slice::from_ref(&train));
    assert_eq!(found.outcome, Outcome::Cause);
    assert_eq!(found.causes[0].name, "cubic-stiffness");
    let k3 = found.causes[0].parameters["k3_n_per_m3"].value;
    assert!((k3 / 3.99 - 1.0).abs() < 0.02, "{k3}");
    not_again(&believed, &found, &[train]);
}

#[test]
fn the_positioning_stage_has_dry_friction() {
    let Some(folder) = folder("emps") else { return };
    let raw = Recording::read(folder.join("DATA_EMPS.mat")).unwrap();
    let samples = |name: &str| raw.channel(name).unwrap().samples.clone();
    // gtau of the file.
    let force: Vec<f64> = samples("vir").iter().map(|volts| 35.150_651_88 * volts).collect();
    let record = recording("emps.csv", 1000.0, &force, &samples("qm"), None);
    let believed = case_text(95.109, 203.50, 0.0);
    let found = ask(&believed, std::slice::from_ref(&record));
    assert!(names(&found).contains(&"coulomb-friction"));
    let friction = found
        .causes
        .iter()
        .find(|cause| cause.name == "coulomb-friction")
        .unwrap();
    println!("{friction:?}");
    let (before, after) = (
        found.baseline.nrmse_heldout,
        found.extended.unwrap().nrmse_heldout,
    );
    println!("force error {:.2} % -> {:.2} %", 100.0 * before, 100.0 * after);
    assert!(after <= 0.041, "{after}");
    not_again(&believed, &found, &[record]);
}

#[test]
fn the_banded_damper_has_friction_behind_a_play() {
    let Some(folder) = folder("friction_backlash") else {
        return;
    };
    let records: Vec<Recording> = ["0.5Hz25lbtension", "1Hz35lbtension", "1Hz70lbtension"]
        .iter()
        .map(|name| {
            let text = std::fs::read_to_string(folder.join(format!("{name}.json"))).unwrap();
            let json: serde_json::Value = serde_json::from_str(&text).unwrap();
            let rows = json["data"].as_array().unwrap();
            let column = |index: usize, unit: f64| -> Vec<f64> {
                rows.iter()
                    .map(|row| unit * row[index].as_f64().unwrap())
                    .collect()
            };
            // Inches and kips.
            let (displacement, force) = (column(1, 0.0254), column(2, 4_448.221_6));
            recording(name, 1024.0, &force, &displacement, Some("x"))
        })
        .collect();
    // What a linear fit takes for the damper: a dashpot and hardly a spring.
    let believed = case_text(1.0, 2e4, 1e4);
    for record in &records {
        let found = ask(&believed, std::slice::from_ref(record));
        let names = names(&found);
        assert!(
            names.contains(&"backlash") && names.contains(&"coulomb-friction"),
            "{names:?}"
        );
        let backlash = found
            .causes
            .iter()
            .find(|cause| cause.name == "backlash")
            .unwrap();
        let gap_in = backlash.parameters["gap_mm"].value / 25.4;
        println!("{}: gap {gap_in:.4} in", record.path.display());
        assert!((gap_in / 0.125 - 1.0).abs() < 0.1, "{gap_in}");
        not_again(&believed, &found, std::slice::from_ref(record));
    }
}
