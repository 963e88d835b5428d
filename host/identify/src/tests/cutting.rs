//! Force coefficients from virtual cuts; the simulation has its own code for chip thickness and forces.

use std::path::Path;

use rayon::prelude::*;

use crate::cutting::force_coefficients::{ForceCoefficientError, KEYS, fit, runout};
use crate::cutting::force_test::{CuttingTest, Setup};
use quietcut_model::case::Case;
use quietcut_numerics::statistics::NINETY_PERCENT;
use quietcut_recording::Recording;
use quietcut_simulate::rig::Noise;
use quietcut_simulate::{Entry, Recorder, TachometerModel, VirtualCut};
use quietcut_testkit::rates::assert_share;
use quietcut_testkit::results::Campaign;

/// A case with a structure stiff enough for steel, whose two modes vibrate by a fraction of the feed, and a tool for which every
/// coefficient contributes to every direction.
const CASE: &str = r#"
[structure]
kind = "matrices"
directions = ["x", "y", "z"]
mass = [[1.0, 0.0, 0.0], [0.0, 1.2, 0.0], [0.0, 0.0, 3.0]]
damping = [[600.0, 0.0, 0.0], [0.0, 800.0, 0.0], [0.0, 0.0, 2000.0]]
stiffness = [[2e7, 0.0, 0.0], [0.0, 3e7, 0.0], [0.0, 0.0, 1e8]]

[tool]
teeth = 3
edge_angle_deg = 70.0
diameter_mm = 16.0
runout_um = 12.0
runout_angle_deg = 40.0

[material]
ktc_mpa = 1835.0
krc_mpa = 1132.0
kac_mpa = 280.0
kte_n_per_mm = 25.0
kre_n_per_mm = 45.0
kae_n_per_mm = 10.0

[cut]
start_deg = 60.0
exit_deg = 180.0
feed_per_tooth_mm = 0.1
feed_direction_deg = 20.0
"#;

const SETUP: Setup = Setup {
    edge_angle_deg: 70.0,
    feed_direction_deg: 20.0,
    full_cut_s: None,
};

fn case(feed_mm: f64) -> Case {
    let mut case = Case::parse(Path::new("cut.toml"), CASE).unwrap();
    case.cut.as_mut().unwrap().feed_per_tooth_mm = feed_mm;
    case
}

fn record(feed_mm: f64, entry: Entry, seconds: f64) -> Recording {
    recorded(&case(feed_mm), entry, seconds)
}

fn recorded(case: &Case, entry: Entry, seconds: f64) -> Recording {
    let cut = VirtualCut {
        entry,
        air_s: 0.05,
        ..VirtualCut::new(3000.0, 0.5, seconds)
    };
    let recorder = Recorder::Ideal { rate_hz: 20_000.0 };
    let (recording, _) = cut
        .record(case, recorder, TachometerModel::ONE_MARK, Path::new("cut.csv"))
        .unwrap();
    recording
}

fn truth() -> [f64; 6] {
    let material = case(0.1).material.unwrap();
    [
        material.ktc_mpa,
        material.krc_mpa,
        material.kac_mpa,
        material.kte_n_per_mm,
        material.kre_n_per_mm,
        material.kae_n_per_mm,
    ]
}

#[test]
fn coefficients_and_runout_are_identified_from_virtual_cuts() {
    let tests: Vec<CuttingTest> = [0.06, 0.12]
        .map(|feed| CuttingTest::new(&record(feed, Entry::Feed, 3.0), SETUP).unwrap())
        .into();
    let fit = fit(&tests).unwrap();
    println!("left {:.1e} of the force", fit.relative_error);
    assert!(fit.relative_error < 6e-3, "{}", fit.relative_error);
    for ((key, found), truth) in KEYS.iter().zip(fit.coefficients).zip(truth()) {
        // The surface is interpolated linearly between samples, and entry and exit are located to a tenth of a sample: errors of a
        // few thousandths of a chip.
        let off = found.unwrap().value / truth - 1.0;
        println!("{key} {off:.2e}");
        assert!(off.abs() < 5e-3, "{key}: {off}");
    }
    let runout = runout(&fit).unwrap();
    assert!((runout.offset_um - 12.0).abs() < 0.05, "{runout:?}");
    assert!((runout.angle_deg - 40.0).abs() < 0.5, "{runout:?}");
}

#[test]
fn mean_forces_without_runout_give_the_same_coefficients() {
    let tests: Vec<CuttingTest> = [0.06, 0.12]
        .map(|feed_mm| {
            let mut case = case(feed_mm);
            case.tool.as_mut().unwrap().runout = None;
            CuttingTest::new(&recorded(&case, Entry::None, 0.5), SETUP).unwrap()
        })
        .into();
    let fit = fit(&tests).unwrap();
    for ((key, found), truth) in KEYS.iter().zip(fit.averaged.unwrap()).zip(truth()) {
        let off = found.unwrap().value / truth - 1.0;
        println!("{key} by mean forces {off:.2e}");
        // A settled stable vibration is equal at every tooth and does not change the chip thickness.
        assert!(off.abs() < 1e-4, "{key} by mean forces: {off}");
    }
    assert!(fit.apart().is_empty(), "{:?}", fit.apart());
}

#[test]
fn vibration_biases_the_coefficients_unless_displacement_is_measured() {
    let with: Vec<Recording> = [0.06, 0.12].map(|feed| record(feed, Entry::None, 0.6)).into();
    let without = with.iter().map(|recording| {
        let mut recording = recording.clone();
        recording.channels.retain(|channel| channel.name.len() > 1);
        recording
    });
    let error = |recordings: Vec<Recording>| {
        let tests: Vec<CuttingTest> = recordings
            .iter()
            .map(|recording| CuttingTest::new(recording, SETUP).unwrap())
            .collect();
        fit(&tests).unwrap().relative_error
    };
    let (blind, seeing) = (error(without.collect()), error(with));
    assert!(blind > 10.0 * seeing, "{blind} {seeing}");
}

#[test]
fn tests_that_do_not_determine_the_coefficients_are_refused() {
    let recording = record(0.1, Entry::None, 0.4);
    let mut planar = recording.clone();
    planar.channels.retain(|channel| channel.name != "fz");
    let error = fit(&[CuttingTest::new(&planar, SETUP).unwrap()]).unwrap_err();
    assert!(matches!(error, ForceCoefficientError::NoAxialForce(_)), "{error}");
    let mut nothing = recording.clone();
    nothing.sidecar.cut.as_mut().unwrap().start_deg = None;
    let error = CuttingTest::new(&nothing, SETUP).unwrap_err().to_string();
    assert!(error.contains("start_deg"), "{error}");
    let short = Setup {
        full_cut_s: Some([0.1, 0.15]),
        ..SETUP
    };
    let error = CuttingTest::new(&recording, short).unwrap_err().to_string();
    assert!(error.contains("whole revolutions"), "{error}");
    // With one feed the variation over the arc of engagement determines the coefficients that the mean force cannot.
    let one = fit(&[CuttingTest::new(&recording, SETUP).unwrap()]).unwrap();
    assert!(one.averaged.is_none() && one.feeds == 1);
}

/// Share of 90 % intervals that contain the truth, for each coefficient.
fn coverage(seeds: u64) -> [f64; 6] {
    let clean: Vec<Recording> = [0.06, 0.12].map(|feed| record(feed, Entry::None, 0.5)).into();
    let of_seed = |seed: u64| {
        let tests: Vec<CuttingTest> = clean
            .iter()
            .enumerate()
            .map(|(index, recording)| {
                let mut noisy = recording.clone();
                let mut noise = Noise::default();
                for channel in ["fx", "fy", "fz"] {
                    noise.absolute.insert(channel.into(), 30.0);
                }
                for channel in ["x", "y", "z"] {
                    noise.absolute.insert(channel.into(), 2e-7);
                }
                noise.add(&mut noisy, 2 * seed + index as u64);
                CuttingTest::new(&noisy, SETUP).unwrap()
            })
            .collect();
        let found = fit(&tests).unwrap().coefficients;
        std::array::from_fn::<bool, 6, _>(|index| {
            let value = found[index].unwrap();
            (value.value - truth()[index]).abs() <= NINETY_PERCENT * value.deviation
        })
    };
    let all: Vec<[bool; 6]> = (0..seeds).into_par_iter().map(of_seed).collect();
    std::array::from_fn(|index| all.iter().filter(|held| held[index]).count() as f64 / seeds as f64)
}

/// Prints the coverage of each coefficient. Returns it, with the mean over all coefficients.
fn measured_coverage(seeds: u64) -> ([f64; 6], f64) {
    let shares = coverage(seeds);
    let said: Vec<String> = KEYS
        .iter()
        .zip(shares)
        .map(|(key, share)| format!("{key} {:.0} %", 100.0 * share))
        .collect();
    let mean = shares.iter().sum::<f64>() / 6.0;
    println!(
        "seeds 0 to {}: {}; all {:.1} %",
        seeds - 1,
        said.join(", "),
        100.0 * mean
    );
    (shares, mean)
}

/// Checks that the intervals of each coefficient hold the truth as often as they claim, and that the mean over all lies in `pooled`.
fn check_coverage(seeds: u64, (shares, mean): ([f64; 6], f64), pooled: std::ops::RangeInclusive<f64>) {
    assert!(pooled.contains(&mean), "{mean}");
    for (key, share) in KEYS.iter().zip(shares) {
        assert_share(key, 0.9, (share * seeds as f64).round() as usize, seeds as usize);
    }
}

#[test]
fn ninety_percent_intervals_hold_the_truth_nine_times_of_ten() {
    check_coverage(20, measured_coverage(20), 0.8..=0.98);
}

#[test]
#[ignore = "a campaign: QUIETCUT_SEEDS seeds, a hundred without it"]
fn coverage_of_force_coefficients() {
    let seeds = std::env::var("QUIETCUT_SEEDS")
        .ok()
        .and_then(|seeds| seeds.parse().ok())
        .unwrap_or(100);
    let (shares, mean) = measured_coverage(seeds);
    let percent = |share: f64| format!("{:.1} %", 100.0 * share);
    let mut figures: Vec<_> = KEYS
        .iter()
        .zip(shares)
        .map(|(key, share)| {
            (
                format!("90 % intervals of {key} that hold the truth"),
                percent(share),
            )
        })
        .collect();
    figures.push(("all together".to_owned(), percent(mean)));
    Campaign {
        name: "force-coefficients",
        title: "Cutting force coefficients from measured forces",
        command: &format!(
            "QUIETCUT_SEEDS={seeds} cargo test --release -p quietcut-identify --lib -- --ignored --nocapture coverage_of_force_coefficients"
        ),
        seeds: &format!("0 to {}", seeds - 1),
    }
    .record(&figures);
    check_coverage(seeds, (shares, mean), 0.85..=0.95);
}
