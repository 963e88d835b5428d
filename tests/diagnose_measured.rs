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
