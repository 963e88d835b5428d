//! `quietcut diagnose` on published measured records. `QUIETCUT_DATA` names their folder.

#![allow(clippy::unwrap_used)]

use std::path::Path;

use quietcut::case::Case;
use quietcut::diagnose::answer::Outcome;
use quietcut::diagnose::{Diagnosis, Options, diagnose};
use quietcut::identify::response;
use quietcut::identify::restoring_force::{ForceTerm, Record};
use quietcut::recording::{Channel, Quantity, Recording, Sidecar, TestKind};
use quietcut_testkit::measured;

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
        since_s: 0.0,
        channels: vec![
            channel("fx", Quantity::Force, force),
            channel("x", Quantity::Displacement, displacement),
        ],
        sidecar: Sidecar {
            kind: Some(TestKind::Shaker),
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

/// A cause that is added to the baseline is not found a second time.
fn not_again(text: &str, found: &Diagnosis, recordings: &[Recording]) {
    let extended = found.extended_case(text).unwrap();
    let again = ask(&extended, recordings);
    for name in names(found) {
        assert!(!names(&again).contains(&name), "{name} again");
    }
}

const SILVERBOX_RATE_HZ: f64 = 610.35;

#[test]
#[ignore = "measured records: QUIETCUT_DATA names their folder"]
fn the_measured_silverbox_has_a_cubic_spring() {
    let text = std::fs::read_to_string(measured("silverbox/SNLS80mV.csv")).unwrap();
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
    // The linear baseline has the natural frequency and damping ratio of small motions that were published with the record. The
    // stiffness is 1 N/m, because the record is in volts.
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
    // A cubic term that the baseline has is not named again, be it an extension of the case or a term of its structure. The two
    // diagnoses take a minute of processor time each.
    let as_term = format!("{believed}cubic_stiffness = [[{k3:e}]]\n");
    let of_structure = || ask(&as_term, std::slice::from_ref(&train));
    let inside = std::thread::scope(|scope| {
        let inside = scope.spawn(of_structure);
        not_again(&believed, &found, std::slice::from_ref(&train));
        inside.join().unwrap()
    });
    assert!(
        !names(&inside).contains(&"cubic-stiffness"),
        "{:?}",
        names(&inside)
    );

    // Index of the first sample of the arrow-shaped signal, which is not part of the record above.
    let arrow = 40_585;
    let (mass, damping) = (1.0 / (omega * omega), 2.0 * 0.0486 / omega);
    let missed_mv = |k3: f64, gain: f64| {
        let law = [
            (ForceTerm::Mass, mass),
            (ForceTerm::Damping, damping),
            (ForceTerm::Stiffness, 1.0),
            (ForceTerm::CubicStiffness, k3),
        ];
        let motion = response::displacement(&law, &force[..arrow], SILVERBOX_RATE_HZ).unwrap();
        let missed = motion.iter().zip(&displacement).map(|(x, y)| gain * x - y);
        1e3 * (missed.map(|missed| missed * missed).sum::<f64>() / arrow as f64).sqrt()
    };
    let of_sensor = found.causes.iter().find(|cause| cause.name == "sensor-gain");
    let gain = of_sensor.map_or(1.0, |cause| cause.parameters["gain"].value);
    let (before, after) = (missed_mv(0.0, 1.0), missed_mv(k3, gain));
    println!("arrow: {before:.2} mV -> {after:.3} mV, k3 {k3:.3}, sensor gain {gain:.4}");
    assert!(before > 14.0 && after <= 0.96, "{before} {after}");
}

/// Band in which the force is compared, Hz: up to here the motion of the stage exceeds its noise, as `identify` finds.
const BAND_HZ: f64 = 40.0;

#[test]
#[ignore = "measured records: QUIETCUT_DATA names their folder"]
fn the_measured_positioning_stage_has_dry_friction() {
    let raw = Recording::read(measured("emps/DATA_EMPS.mat")).unwrap();
    let samples = |name: &str| raw.channel(name).unwrap().samples.clone();
    // The factor from volts to newtons is `gtau` of the file.
    let force: Vec<f64> = samples("vir").iter().map(|volts| 35.150_651_88 * volts).collect();
    let record = recording("emps.csv", 1000.0, &force, &samples("qm"), None);
    // The baseline has the mass and the viscous damping that fit best without friction.
    let believed = case_text(95.208, 411.26, 0.0);
    let found = ask(&believed, std::slice::from_ref(&record));
    assert_eq!(names(&found), ["damping", "coulomb-friction"]);
    let near = |name: &str, key: &str, published: f64| {
        let cause = found.causes.iter().find(|cause| cause.name == name).unwrap();
        let value = cause.parameters[key].value;
        println!("{name}.{key}: {value:.2}, published {published:.2}");
        assert!((value / published - 1.0).abs() < 0.03, "{name}.{key}: {value}");
    };
    // The published friction is 20.394 N in both directions, with an offset of −3.165 N.
    near("damping", "damping_ns_per_m", 203.50);
    near("coulomb-friction", "fc_n", 20.394 - 3.165);
    near("coulomb-friction", "fc_minus_n", 20.394 + 3.165);
    let extended = found.extended_case(&believed).unwrap();
    let again = ask(&extended, std::slice::from_ref(&record));
    let (before, after) = (found.baseline.nrmse_heldout, again.baseline.nrmse_heldout);
    println!("force error {:.2} % -> {:.2} %", 100.0 * before, 100.0 * after);
    assert!(names(&again).is_empty(), "{:?}", names(&again));
    // NRMSE on the held-out segments, a third of the record.
    assert!(before > 0.167 && after < 0.3 * before, "{before} {after}");
    let of = |name: &str, key: &str| {
        let cause = found.causes.iter().find(|cause| cause.name == name).unwrap();
        cause.parameters[key].value
    };
    let (plus, minus) = (
        of("coulomb-friction", "fc_n"),
        of("coulomb-friction", "fc_minus_n"),
    );
    let law = [
        (ForceTerm::Mass, 95.208),
        (ForceTerm::Damping, of("damping", "damping_ns_per_m")),
        (ForceTerm::CoulombFriction, 0.5 * (plus + minus)),
        (ForceTerm::Offset, 0.5 * (plus - minus)),
    ];
    // The published errors refer to the whole record.
    let whole = Record {
        force: &force,
        motion: &samples("qm"),
        quantity: Quantity::Displacement,
        rate_hz: 1000.0,
    };
    let error = |law: &[(ForceTerm, f64)]| whole.force_error(law, [0.0, BAND_HZ], 0.1);
    let believed = error(&[(ForceTerm::Mass, 95.208), (ForceTerm::Damping, 411.26)]);
    let extended = error(&law);
    println!(
        "force error of the whole record {:.2} % -> {:.2} %",
        100.0 * believed,
        100.0 * extended
    );
    assert!(believed > 0.16 && extended <= 0.041, "{believed} {extended}");
}
const DAMPER_RATE_HZ: f64 = 1024.0;

/// Factors from inches to meters and from kips to newtons.
const INCH_M: f64 = 0.0254;
const KIP_N: f64 = 4_448.221_6;

fn damper_record(folder: &Path, name: &str) -> Recording {
    let text = std::fs::read_to_string(folder.join(format!("{name}.json"))).unwrap();
    let json: serde_json::Value = serde_json::from_str(&text).unwrap();
    let column = |index: usize, unit: f64| -> Vec<f64> {
        json["data"]
            .as_array()
            .unwrap()
            .iter()
            .map(|row| unit * row[index].as_f64().unwrap())
            .collect()
    };
    recording(
        &format!("{name}.csv"),
        DAMPER_RATE_HZ,
        &column(2, KIP_N),
        &column(1, INCH_M),
        Some("x"),
    )
}

/// Median travel, in inches, after a reversal over which the force stays below this share of the sliding force.
fn plateau_in(record: &Recording, share: f64) -> f64 {
    let smooth = |name: &str| -> Vec<f64> {
        let samples = &record.channel(name).unwrap().samples;
        samples
            .windows(9)
            .map(|nine| nine.iter().sum::<f64>() / 9.0)
            .collect()
    };
    let (force, x) = (smooth("fx"), smooth("x"));
    let sliding = |sign: f64| {
        let most = force.iter().map(|f| sign * f).fold(0.0, f64::max);
        let mut high: Vec<f64> = force
            .iter()
            .map(|f| sign * f)
            .filter(|f| *f > 0.5 * most)
            .collect();
        high.sort_by(f64::total_cmp);
        high[high.len() / 2]
    };
    let (plus, minus) = (sliding(1.0), sliding(-1.0));
    // Each width is the travel from the last sample with force on one side to the first sample with force on the other side.
    let mut widths = Vec::new();
    let (mut side, mut left_at) = (0.0, 0.0);
    for i in 0..x.len() {
        let now = if force[i] > share * plus {
            1.0
        } else if force[i] < -share * minus {
            -1.0
        } else {
            0.0
        };
        if now != 0.0 {
            if side == -now {
                widths.push((x[i] - left_at).abs() / INCH_M);
            }
            (side, left_at) = (now, x[i]);
        }
    }
    widths.sort_by(f64::total_cmp);
    widths[widths.len() / 2]
}

/// The published backlash of the damper, in.
const PUBLISHED_IN: f64 = 0.125;

#[test]
#[ignore = "measured records: QUIETCUT_DATA names their folder"]
fn the_measured_banded_damper_has_friction_behind_a_backlash() {
    let folder = measured("friction_backlash");
    let records =
        ["0.5Hz25lbtension", "1Hz35lbtension", "1Hz70lbtension"].map(|name| damper_record(&folder, name));
    // The baseline is a sliding rod without spring and with a small viscous damper.
    let believed = case_text(1.0, 1e3, 1e3);
    let mut gaps_in = Vec::new();
    for some in [&records[..1], &records[1..2], &records[2..], &records[..]] {
        let found = ask(&believed, some);
        assert_eq!(names(&found), ["coulomb-friction", "backlash"]);
        let gap = &found.causes[1].parameters["gap_mm"];
        let [gap_in, from_in, to_in] = [gap.value, gap.ci90[0], gap.ci90[1]].map(|mm| 1e-3 * mm / INCH_M);
        let removed = found.gain.unwrap().residual_energy_removed;
        println!(
            "{} records: gap {gap_in:.4} in, 90 % {from_in:.3} to {to_in:.3}, energy removed {removed:.3}",
            some.len()
        );
        assert!(removed > 0.95, "{removed}");
        // The loop of force and displacement is part of the views of the answer.
        assert!(found.views.iter().all(|view| view.missing.is_some()));
        gaps_in.push([gap_in, from_in, to_in]);
        not_again(&believed, &found, some);
    }
    // The published backlash is 0.125 in. All records together give it within 0.015 in, with an interval that contains it. One
    // record alone is less certain: the end of the backlash is gradual, because friction builds up gradually.
    let all = gaps_in.len() - 1;
    let [gap_in, from_in, to_in] = gaps_in[all];
    assert!((gap_in - PUBLISHED_IN).abs() < 0.015, "{gap_in}");
    assert!((from_in..to_in).contains(&PUBLISHED_IN), "{from_in} to {to_in}");
    for [gap_in, ..] in &gaps_in[..all] {
        assert!((0.06..0.145).contains(gap_in), "{gap_in}");
    }
    for record in &records {
        let widths = [0.03, 0.05, 0.10, 0.15].map(|share| plateau_in(record, share));
        println!(
            "{}: below 3, 5, 10, 15 % over {widths:.3?} in",
            record.path.display()
        );
        assert!(widths[3] - widths[0] > 0.05, "{widths:?}");
    }
}
