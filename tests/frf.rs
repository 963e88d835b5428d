//! `quietcut frf`: tables and charts from recordings of a known structure, and refused input.
#![allow(clippy::expect_used)]

use std::f64::consts::TAU;
use std::path::Path;

use num_complex::Complex64;
use quietcut::frf::{FrfTable, MeasurementSettings, measure};
use quietcut::recording::{Channel, Quantity, Recording, Sidecar, TestKind};
use quietcut::simulate::rig::{Rig, Signal};
use quietcut::structure::Direction;
use quietcut_tests::command::{folder, quietcut};
use serde_json::Value;

const RATE: f64 = 1024.0;
const FREQUENCY_HZ: f64 = 17.4;
const DAMPING: f64 = 0.02;
const MASS_KG: f64 = 60.0;

/// Acceleration at the sensor after impacts along y with the length of one sample: exact impulse responses of the structure.
fn impacts(ratio: f64) -> Recording {
    let samples = (50.0 * RATE) as usize;
    let mut force = vec![0.0; samples];
    let mut acceleration = vec![0.0; samples];
    let own = TAU * FREQUENCY_HZ;
    let pole = own * Complex64::new(-DAMPING, (1.0 - DAMPING * DAMPING).sqrt());
    for (at, newtons) in [(1.0, 300.0), (13.0, 400.0), (25.5, 350.0), (37.5, 500.0)] {
        let first = (at * RATE) as usize;
        // The impact is a raised cosine of eight samples, whose spectrum is negligible above a fifth of the sample rate.
        let pulse: Vec<f64> = (0..9)
            .map(|k| newtons * 0.5 * (1.0 - (TAU * f64::from(k) / 8.0).cos()))
            .collect();
        for (k, value) in pulse.iter().enumerate() {
            force[first + k] += value;
            // Acceleration of the response 1/(m ω_d) e^{−ζωt} sin ω_d t, without the direct part f/m.
            for (n, sample) in acceleration[first + k..].iter_mut().enumerate() {
                let t = n as f64 / RATE;
                let modal = pole * pole * (pole * t).exp() / pole.im;
                let half = if n == 0 { 0.5 } else { 1.0 };
                *sample += ratio * half * value / RATE / MASS_KG * modal.im;
            }
            acceleration[first + k] += ratio * value / MASS_KG;
        }
    }
    let channel = |name: &str, quantity, samples| Channel {
        name: name.into(),
        quantity,
        samples,
    };
    Recording {
        path: "hammer.csv".into(),
        sample_rate_hz: RATE,
        start_s: 0.0,
        since_s: 0.0,
        channels: vec![
            channel("fy", Quantity::Force, force),
            channel("ay", Quantity::Acceleration, acceleration),
        ],
        sidecar: Sidecar {
            kind: Some(TestKind::Hammer),
            ..Sidecar::default()
        },
    }
}

fn truth(hertz: f64) -> Complex64 {
    let (omega, own) = (TAU * hertz, TAU * FREQUENCY_HZ);
    Complex64::new(own * own - omega * omega, 2.0 * DAMPING * own * omega).inv() / MASS_KG
}

#[test]
fn a_hammer_test_becomes_tables_and_pictures() {
    let folder = folder();
    let at = |name: &str| folder.path().join(name);
    impacts(1.0).write(&at("hammer.csv")).expect("written");
    impacts(1.0)
        .write_uff(&at("hammer.uff"), quietcut::recording::UffForm::Binary)
        .expect("written");
    let answer = quietcut(
        folder.path(),
        &[
            "frf",
            "hammer.csv",
            "--band-hz",
            "12:24",
            "--json",
            "--out",
            "a.csv",
            "--out",
            "a.uff",
            "--out",
            "a.svg",
            "--out",
            "a.html",
        ],
    )
    .json();
    assert_eq!(answer["parts"][0]["blows"]["used"], 4);
    assert_eq!(answer["parts"][0]["excitation"], "hammer");
    let peak = &answer["receptances"][0];
    assert_eq!(peak["name"], "yy");
    let value = peak["peak_m_per_n"]["value"].as_f64().expect("a number");
    // The peak is at most half a line of 0.085 Hz from a line, which changes the peak of a mode 0.7 Hz wide by 0.6 %.
    let expected = truth(FREQUENCY_HZ).norm();
    assert!((value / expected - 1.0).abs() < 0.012, "{value} {expected}");
    let tables = ["a.csv", "a.uff"].map(|name| FrfTable::read(at(name)).expect("a table"));
    for table in &tables {
        let entry = table.entry(Direction::Y, Direction::Y).expect("hyy");
        for (&hertz, h) in table.frequency_hz().iter().zip(&entry.receptance) {
            // The error comes from the band limit of the sampled impulse and from the vibration at the end of a segment.
            assert!(
                (h - truth(hertz)).norm() < 0.01 * expected,
                "{hertz}: {h} {}",
                truth(hertz)
            );
        }
        assert!(
            entry
                .coherence
                .as_ref()
                .expect("coherence")
                .iter()
                .all(|c| *c > 0.999)
        );
    }
    for name in ["a.svg", "a.html"] {
        let text = std::fs::read_to_string(at(name)).expect("text");
        assert!(
            text.contains("receptance [µm/N]") && text.contains("coherence"),
            "{name}"
        );
    }
    // The binary UFF file without a sidecar gives the same table.
    let from_uff = quietcut(
        folder.path(),
        &["frf", "hammer.uff", "--band-hz", "12:24", "--json"],
    )
    .json();
    assert_eq!(from_uff["receptances"][0]["name"], "yy");
    let again = from_uff["receptances"][0]["peak_m_per_n"]["value"]
        .as_f64()
        .expect("a number");
    // The CSV file has nine digits.
    assert!((again / value - 1.0).abs() < 1e-6);
}

#[test]
fn a_sensor_on_the_housing_is_calibrated_to_the_tool_tip() {
    let folder = folder();
    let ratio = 0.7;
    for (name, ratio) in [("tip", 1.0), ("housing", ratio)] {
        let path = folder.path().join(format!("{name}-test.csv"));
        impacts(ratio).write(&path).expect("written");
        let (record, out) = (format!("{name}-test.csv"), format!("{name}.csv"));
        quietcut(
            folder.path(),
            &["frf", &record, "--band-hz", "12:24", "--out", &out, "--json"],
        )
        .json();
    }
    let answer = quietcut(
        folder.path(),
        &[
            "frf",
            "housing-test.csv",
            "--band-hz",
            "12:24",
            "--housing",
            "housing.csv",
            "--tip",
            "tip.csv",
            "--out",
            "calibrated.csv",
            "--json",
        ],
    )
    .json();
    let found = answer["calibration"][0]["tip_to_housing"]
        .as_f64()
        .expect("a number");
    assert!((found * ratio - 1.0).abs() < 1e-3, "{found}");
    let read = |name: &str| FrfTable::read(folder.path().join(name)).expect("a table");
    let (calibrated, tip) = (read("calibrated.csv"), read("tip.csv"));
    let peak = |table: &FrfTable| {
        let entry = &table.entries()[0];
        entry.receptance.iter().map(|h| h.norm()).fold(0.0, f64::max)
    };
    assert!((peak(&calibrated) / peak(&tip) - 1.0).abs() < 0.02);
}

#[test]
fn what_cannot_be_measured_is_refused_with_the_reason() {
    let folder = folder();
    let here: &Path = folder.path();
    impacts(1.0).write(&here.join("hammer.csv")).expect("written");
    std::fs::write(here.join("idle.csv"), "t [s],ax [m/s^2]\n0,0\n0.1,1\n0.2,0\n").expect("written");
    quietcut(here, &["frf", "idle.csv"]).refused(&["idle.csv", "no force"]);
    quietcut(here, &["frf", "none.csv"]).refused(&["none.csv"]);
    quietcut(here, &["frf", "hammer.csv", "--channel", "fq"]).refused(&["hammer.csv", "\"fq\"", "fy"]);
    quietcut(here, &["frf", "hammer.csv", "--out", "a.xyz"]).refused(&["a.xyz", "svg"]);
    quietcut(here, &["frf", "hammer.csv", "--band-hz", "30:10"]).refused(&["30:10"]);
    quietcut(here, &["frf", "hammer.csv", "--resolution-hz", "0.001"]).refused(&["hammer.csv"]);
    quietcut(
        here,
        &[
            "frf",
            "hammer.csv",
            "--housing",
            "hammer.csv",
            "--tip",
            "hammer.csv",
        ],
    )
    .refused(&["hammer.csv"]);
}

#[test]
fn a_step_sine_test_at_several_forces_is_evaluated_at_the_given_force() {
    // The stiffness of this mode falls with amplitude, so that its resonance frequency depends on the force level.
    let structure = quietcut_testkit::case("kuka-kr90-y17-low").structure.unwrap();
    let frequencies: Vec<f64> = (0..9).map(|k| 17.0 + 0.1 * f64::from(k)).collect();
    let signal = Signal::step_sine(&frequencies, &[1.8, 9.5], 20.0, 4.0);
    let rig = Rig::new(Direction::Y, signal, 128.0);
    let (recording, _) = rig.record(&structure, Path::new("steps.csv")).unwrap();
    let measured = |force_n| {
        let settings = MeasurementSettings {
            force_n,
            channels: vec!["fy".into(), "y".into()],
            ..MeasurementSettings::default()
        };
        measure(std::slice::from_ref(&recording), &settings)
    };
    let said = measured(None).unwrap_err().to_string();
    assert!(
        said.contains("1.80") && said.contains("9.50") && said.contains("--force-n"),
        "{said}"
    );
    assert!(measured(Some(4.0)).unwrap_err().to_string().contains("9.50"));
    let peaks = [1.8, 9.5].map(|force_n| {
        let measurement = measured(Some(force_n)).unwrap();
        let table = measurement.table;
        assert_eq!(table.frequency_hz().len(), frequencies.len());
        let sizes = table.entries()[0].receptance.iter().map(|h| h.norm());
        sizes.fold(0.0, f64::max)
    });
    // Cubic damping lowers the resonance peak: at 9.5 N far more than at 1.8 N.
    assert!(peaks[1] < 0.9 * peaks[0], "{peaks:?}");
}

#[test]
fn a_band_above_half_the_rate_and_an_output_over_an_input_are_refused() {
    let folder = folder();
    let here = folder.path();
    impacts(1.0).write(&here.join("hammer.csv")).expect("written");
    let before = std::fs::read(here.join("hammer.csv")).expect("the recording");
    quietcut(here, &["frf", "hammer.csv", "--band-hz", "90000:100000"]).refused(&[
        "hammer.csv",
        "90000 Hz",
        "samples per second",
    ]);
    let cut = quietcut(here, &["frf", "hammer.csv", "--band-hz", "12:100000", "--json"]);
    assert_eq!(cut.status, Some(0), "{cut:?}");
    assert!(cut.stderr.contains("half the sample rate"), "{cut:?}");
    for (line, reason) in [
        ("frf hammer.csv --band-hz 12:24 --out hammer.csv", "overwrite"),
        (
            "identify hammer.csv --method modes --out ./hammer.csv",
            ".toml, .html or .svg is needed",
        ),
    ] {
        let arguments: Vec<&str> = line.split(' ').collect();
        quietcut(here, &arguments).refused(&["--out", reason, "hammer.csv"]);
    }
    assert_eq!(
        std::fs::read(here.join("hammer.csv")).expect("the recording"),
        before
    );
}

#[test]
fn the_interval_of_an_unfiltered_record_holds_what_a_fast_record_shows() {
    let folder = folder();
    let here = folder.path();
    let case = std::path::PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("cases/kuka-kr90-acetal.toml");
    let peak = |rate: &str, more: &[&str]| -> (f64, f64, f64) {
        let case = case.display().to_string();
        let tap = [
            "simulate",
            &case,
            "--experiment",
            "hammer",
            "--direction",
            "y",
            "--force-n",
            "300",
            "--sample-rate-hz",
            rate,
            "--noise-percent",
            "0.1",
            "--out",
            "tap.csv",
        ];
        assert_eq!(quietcut(here, &tap).status, Some(0));
        let answer = quietcut(
            here,
            &[&["frf", "tap.csv", "--band-hz", "10:30", "--json"], more].concat(),
        )
        .json();
        let receptances = answer["receptances"].as_array().expect("receptances");
        let hyy = receptances.iter().find(|one| one["name"] == "yy").expect("Hyy");
        let number = |value: &Value| value.as_f64().expect("a number");
        let found = &hyy["peak_m_per_n"];
        (
            number(&found["value"]),
            number(&found["ci90"][0]),
            number(&found["ci90"][1]),
        )
    };
    // 16 times the rate folds a hundredth of what 512 Hz does.
    let (truth, ..) = peak("8192", &[]);
    for more in [&[][..], &["--exponential-window-s", "3"]] {
        let (value, from, to) = peak("512", more);
        assert!((from..to).contains(&truth), "{truth} {value} {from} {to}");
        assert!(to - from < 0.1 * truth, "{from} {to}");
    }
}

/// Multisines of the virtual rig, a linear and a cubic structure, through the command; then a mass on the tool, and two levels.
#[test]
fn a_multisine_tells_noise_from_distortion_and_levels_from_changes() {
    let folder = folder();
    let here: &Path = folder.path();
    let case = |name: &str, mass: f64, cubic: &str| {
        let text = format!(
            "[structure]\nkind = \"matrices\"\ndirections = [\"y\"]\nmass = [[{mass}]]\ndamping = [[305.0]]\nstiffness = [[2.26e6]]\n{cubic}"
        );
        std::fs::write(here.join(name), text).expect("written");
    };
    case("linear.toml", 188.0, "");
    case("heavier.toml", 192.0, "");
    case("cubic.toml", 188.0, "cubic_stiffness = [[-5e12]]\n");
    let simulated = |case: &str, more: &str, out: &str| {
        let words = format!(
            "simulate {case} --experiment multisine --frequency-hz 14:21 --period-s 16 --sample-rate-hz 256 --noise-percent 1 {more} --out {out}"
        );
        let words: Vec<&str> = words.split_whitespace().collect();
        assert_eq!(quietcut(here, &words).status, Some(0), "{words:?}");
    };
    let answer = |words: &str| {
        let words: Vec<&str> = words.split_whitespace().collect();
        quietcut(here, &words).json()
    };
    for (case, level) in [("linear", 5.0), ("heavier", 5.0), ("cubic", 5.0)] {
        for seed in [1, 2] {
            simulated(
                &format!("{case}.toml"),
                &format!("--force-n {level} --seed {seed}"),
                &format!("{case}-{seed}.csv"),
            );
        }
        let found = answer(&format!(
            "frf {case}-1.csv {case}-2.csv --out {case}-frf.csv --json"
        ));
        let part = &found["parts"][0];
        assert_eq!(part["excitation"], "multisine");
        assert_eq!(part["period_s"], 16.0);
        assert_eq!(part["realizations"], 2);
        let distortion = &part["distortion"][0];
        assert_eq!(
            distortion["distortion_db"].is_null(),
            case != "cubic",
            "{distortion}"
        );
        assert!(
            distortion["noise_db"].as_f64().expect("a number") < -30.0,
            "{distortion}"
        );
    }
    let changed = answer("frf --compare linear-frf.csv heavier-frf.csv --json");
    assert_eq!(changed["has_changed"], true);
    let number = |value: &Value| value.as_f64().expect("a number");
    let change = &changed["peaks"][0]["frequency_hz"]["change"];
    // √(188/192) of 17.45 Hz.
    let expected = (2.26e6_f64 / 188.0).sqrt() / TAU * ((188.0_f64 / 192.0).sqrt() - 1.0);
    assert!(
        (number(&change["value"]) - expected).abs() < 0.02 && number(&change["ci90"][1]) < 0.0,
        "{change} {expected}"
    );
    let same = answer("frf --compare linear-frf.csv linear-frf.csv --json");
    assert_eq!(same["has_changed"], false);
    quietcut(
        here,
        &[
            "frf",
            "--compare",
            "linear-frf.csv",
            "heavier-frf.csv",
            "--out",
            "change.svg",
        ],
    );
    let svg = std::fs::read_to_string(here.join("change.svg")).expect("a picture");
    assert!(svg.contains("before") && svg.contains("after"));

    simulated("cubic.toml", "--force-n 1 --seed 3", "low.csv");
    let levels = answer("frf cubic-1.csv low.csv --by-level --json");
    let found = &levels["dependences"][0];
    assert!(
        found["is_nonlinear"] == true && number(&found["frequency"]["value"]) < 0.0,
        "{levels}"
    );
    quietcut(here, &["frf", "low.csv", "--by-level"]).refused(&["one force level", "--by-level"]);
}
