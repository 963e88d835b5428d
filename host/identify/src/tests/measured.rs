//! Identification from published measurements; `QUIETCUT_DATA` names their folder.

use crate::nonlinear::periodic_fit::{self, Period};
use crate::nonlinear::response;
use crate::nonlinear::restoring_force::{ForceTerm, Options, Record, Surface};
use quietcut_recording::Quantity;
use quietcut_testkit::measured;

/// Input and output of the Silverbox in volts, without their means.
fn silverbox() -> [Vec<f64>; 2] {
    let text = std::fs::read_to_string(measured("silverbox/SNLS80mV.csv")).unwrap();
    let mut columns = [Vec::new(), Vec::new()];
    for line in text
        .lines()
        .skip(1)
        .filter(|line| !line.trim_matches(',').is_empty())
    {
        let mut fields = line.split(',');
        for column in &mut columns {
            column.push(fields.next().unwrap().trim().parse::<f64>().unwrap());
        }
    }
    columns.map(|column| {
        let mean = column.iter().sum::<f64>() / column.len() as f64;
        column.into_iter().map(|x| x - mean).collect()
    })
}

const RATE_HZ: f64 = 610.35;

/// RMS prediction error on the arrow signal, V, and the ratio k3/k1 of a law.
fn judge_silverbox(surface: &[(ForceTerm, f64)], [u, y]: &[Vec<f64>; 2], what: &str) -> (f64, f64) {
    let arrow = 40_585;
    let predicted = response::displacement(surface, &u[..arrow], RATE_HZ).unwrap();
    let sum: f64 = predicted.iter().zip(y).map(|(a, b)| (a - b) * (a - b)).sum();
    let rmse = (sum / arrow as f64).sqrt();
    let of = |wanted| {
        surface
            .iter()
            .find(|(term, _)| *term == wanted)
            .map_or(0.0, |(_, value)| *value)
    };
    let ratio = of(ForceTerm::CubicStiffness) / of(ForceTerm::Stiffness);
    println!(
        "{what}: {:.3} mV on the arrow, k3/k1 = {ratio:.4} 1/V²",
        1e3 * rmse
    );
    (rmse, ratio)
}

fn law_of(surface: &Surface) -> Vec<(ForceTerm, f64)> {
    surface
        .terms
        .iter()
        .copied()
        .zip(surface.theta.iter().copied())
        .collect()
}

#[test]
#[ignore = "measured records: QUIETCUT_DATA names their folder"]
fn silverbox_by_its_restoring_force() {
    let data = silverbox();
    let train = 49_270..80_000;
    let surface = Record {
        force: &data[0][train.clone()],
        motion: &data[1][train],
        quantity: Quantity::Displacement,
        rate_hz: RATE_HZ,
    }
    .surface(&Options {
        terms: vec![
            ForceTerm::Mass,
            ForceTerm::Damping,
            ForceTerm::Stiffness,
            ForceTerm::CubicStiffness,
        ],
        mass_kg: None,
        band_hz: None,
        trim_s: 1.0,
    })
    .unwrap();
    println!(
        "band {:?}, force error {:.4}",
        surface.band_hz, surface.force_error
    );
    let (rmse, ratio) = judge_silverbox(&law_of(&surface), &data, "restoring force");
    assert!(rmse <= 0.96e-3, "{rmse}");
    assert!((ratio / 3.99 - 1.0).abs() < 0.01, "{ratio}");
    // The linear law has a fifteen times larger prediction error.
    let linear: Vec<_> = law_of(&surface)
        .into_iter()
        .filter(|(term, _)| *term != ForceTerm::CubicStiffness)
        .collect();
    assert!(judge_silverbox(&linear, &data, "linear").0 > 10e-3);
}

#[test]
#[ignore = "measured records: QUIETCUT_DATA names their folder"]
fn silverbox_by_harmonic_balance() {
    let data = silverbox();
    // Ends of three realizations of the multisine; the last 8192 samples of each are one period.
    let periods: Vec<Period<'_>> = [57_877, 66_571, 75_264]
        .iter()
        .map(|end| Period {
            force: &data[0][end - 8192..*end],
            displacement: &data[1][end - 8192..*end],
        })
        .collect();
    let terms = [
        ForceTerm::Mass,
        ForceTerm::Damping,
        ForceTerm::Stiffness,
        ForceTerm::CubicStiffness,
    ];
    let fit = periodic_fit::fit(&periods, RATE_HZ, &terms).unwrap();
    for ((term, value), deviation) in fit.law.iter().zip(&fit.deviations) {
        println!("{} = {value:.6e} ± {deviation:.1e}", term.key());
    }
    println!("fit error {:.3} %", 100.0 * fit.relative_error);
    let (rmse, ratio) = judge_silverbox(&fit.law, &data, "harmonic balance");
    assert!(rmse <= 0.96e-3, "{rmse}");
    assert!((ratio / 3.99 - 1.0).abs() < 0.01, "{ratio}");
}

#[test]
#[ignore = "measured records: QUIETCUT_DATA names their folder"]
fn the_positioning_stage_has_its_published_friction() {
    let recording = quietcut_recording::Recording::read(measured("emps/DATA_EMPS.mat"));
    let recording = match recording {
        Ok(recording) => recording,
        Err(error) => panic!("{error}"),
    };
    let samples = |name: &str| &recording.channel(name).unwrap().samples;
    // Force constant `gtau` from the data file.
    let force: Vec<f64> = samples("vir").iter().map(|volts| 35.150_651_88 * volts).collect();
    let surface = Record {
        force: &force,
        motion: samples("qm"),
        quantity: Quantity::Displacement,
        rate_hz: 1000.0,
    }
    .surface(&Options {
        terms: vec![
            ForceTerm::Mass,
            ForceTerm::Damping,
            ForceTerm::CoulombFriction,
            ForceTerm::Offset,
        ],
        mass_kg: None,
        band_hz: None,
        trim_s: 0.1,
    })
    .unwrap();
    println!(
        "band {:?}, force error {:.4}",
        surface.band_hz, surface.force_error
    );
    let published = [
        (ForceTerm::Mass, 95.109),
        (ForceTerm::Damping, 203.50),
        (ForceTerm::CoulombFriction, 20.394),
    ];
    for (term, truth) in published {
        let found = surface.value(term).unwrap();
        println!(
            "{}: {found:.4}, {:+.3} %",
            term.key(),
            100.0 * (found / truth - 1.0)
        );
        assert!((found / truth - 1.0).abs() < 0.01, "{}", term.key());
    }
    assert!(surface.force_error <= 0.041, "{}", surface.force_error);
}
