//! Frequency and damping over the amplitude, from decays and from receptances at several force levels, as a user asks for them.

#![allow(clippy::unwrap_used)]

use std::f64::consts::TAU;
use std::fmt::Write;
use std::path::Path;

use quietcut_tests::command::{folder, quietcut};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use serde_json::Value;

const RATE_HZ: f64 = 512.0;

fn noise(random: &mut ChaCha8Rng) -> f64 {
    StandardNormal.sample(random)
}

/// Decay x = A·cos φ with dA/dt = −ζω₀A and dφ/dt = ω₀(1 + β(A/A₀)²), in closed form, at 21 Hz.
fn write_decay(path: &Path, damping_ratio: f64, beta: f64, seed: u64) {
    let (omega, start) = (TAU * 21.0, 2e-4);
    let rate = damping_ratio * omega;
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let mut text = String::from("t [s],x [m]\n");
    for sample in 0..(8.0 * RATE_HZ) as usize {
        let t = sample as f64 / RATE_HZ;
        let amplitude = start * (-rate * t).exp();
        let phase = omega * (t + beta * (1.0 - (-2.0 * rate * t).exp()) / (2.0 * rate));
        let _ = writeln!(
            text,
            "{t},{}",
            amplitude * phase.cos() + 1e-7 * noise(&mut random)
        );
    }
    std::fs::write(path, text).unwrap();
    std::fs::write(path.with_extension("toml"), "kind = \"free-decay\"\n").unwrap();
}

/// Steady response of a mode of 0.8 kg to `periods` periods of a multisine of random phases, each line with the amplitude
/// `force_n`.
fn write_multisine(
    path: &Path,
    periods: i32,
    [frequency_hz, damping_ratio]: [f64; 2],
    force_n: f64,
    seed: u64,
) {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let period = 4096;
    let lines: Vec<(f64, f64, f64, f64)> = (120..220)
        .map(|line| {
            let omega = TAU * f64::from(line) / 8.0;
            let own = TAU * frequency_hz;
            let (re, im) = (
                0.8 * (own * own - omega * omega),
                0.8 * 2.0 * damping_ratio * own * omega,
            );
            (omega, TAU * noise(&mut random), 1.0 / re.hypot(im), -im.atan2(re))
        })
        .collect();
    let mut text = String::from("t [s],fx [N],x [m]\n");
    for sample in 0..periods * period {
        let t = f64::from(sample) / RATE_HZ;
        let (mut force, mut motion) = (0.0, 0.0);
        for (omega, phase, gain, angle) in &lines {
            force += force_n * (omega * t + phase).cos();
            motion += force_n * gain * (omega * t + phase + angle).cos();
        }
        let _ = writeln!(
            text,
            "{t},{},{}",
            force,
            motion * (1.0 + 1e-4 * noise(&mut random))
        );
    }
    std::fs::write(path, text).unwrap();
    std::fs::write(path.with_extension("toml"), "kind = \"shaker\"\n").unwrap();
}

fn interval(figure: &Value) -> [f64; 3] {
    [&figure["value"], &figure["ci90"][0], &figure["ci90"][1]].map(|number| number.as_f64().unwrap())
}

#[test]
fn decays_and_force_levels_give_curves_in_one_call() {
    let folder = folder();
    let here = folder.path();
    write_decay(&here.join("linear.csv"), 0.01, 0.0, 1);
    write_decay(&here.join("hardening.csv"), 0.01, 0.05, 2);
    write_multisine(&here.join("low.csv"), 5, [21.0, 0.01], 0.1, 3);
    write_multisine(&here.join("high.csv"), 5, [21.4, 0.013], 1.0, 4);
    let arguments = [
        "identify",
        "linear.csv",
        "hardening.csv",
        "low.csv",
        "high.csv",
        "--method",
        "backbone",
        "--json",
        "--out",
        "curve.csv",
        "--out",
        "curve.svg",
        "--out",
        "curve.html",
    ];
    let answer = quietcut(here, &arguments).json();
    let decays = answer["backbone"]["decays"].as_array().unwrap();
    assert_eq!(decays[0]["is_flat"], true, "{}", decays[0]);
    assert_eq!(decays[1]["is_flat"], false, "{}", decays[1]);
    let (mut held, mut count) = (0, 0);
    for (decay, beta) in decays.iter().zip([0.0, 0.05]) {
        for point in decay["points"].as_array().unwrap() {
            let [amplitude, ..] = interval(&point["amplitude_m"]);
            let share = amplitude / 2e-4;
            // |p| of p = −ζω₀ + iω₀(1 + βA²).
            let omega = 1.0 + beta * share * share;
            let frequency = 21.0 * omega.hypot(0.01);
            let [value, low, high] = interval(&point["frequency_hz"]);
            assert!((value / frequency - 1.0).abs() < 5e-3, "{point} {frequency}");
            held += usize::from((low..=high).contains(&frequency));
            let [value, low, high] = interval(&point["damping_ratio"]);
            let damping = 0.01 / omega.hypot(0.01);
            // Four deviations; near the noise the interval is as wide as the damping ratio itself.
            assert!(
                (value - damping).abs() < 2.5 * 0.5 * (high - low),
                "{point} {damping}"
            );
            assert!(amplitude < 1e-6 || high - low < 0.2 * damping, "{point}");
            held += usize::from((low..=high).contains(&damping));
            count += 2;
        }
    }
    // 90 % intervals of neighbouring windows are correlated; with half of the windows independent, fewer than 70 % of
    // them have a probability below 1e-3.
    assert!(10 * held > 7 * count, "{held} of {count}");
    let warnings = answer["warnings"].to_string();
    for words in [
        "hardening.csv: frequency and damping of this decay change",
        "averages over",
        "Hxx: frequency or damping differ",
    ] {
        assert!(warnings.contains(words), "{words}: {warnings}");
    }
    assert!(!warnings.contains("linear.csv"), "{warnings}");
    let levels = &answer["backbone"]["levels"][0];
    assert_eq!(
        (&levels["name"], &levels["is_nonlinear"]),
        (&"xx".into(), &true.into())
    );
    for (point, [hertz, damping, force]) in levels["points"]
        .as_array()
        .unwrap()
        .iter()
        .zip([[21.0, 0.01, 0.1], [21.4, 0.013, 1.0]])
    {
        let [value, ..] = interval(&point["frequency_hz"]);
        assert!((value / hertz - 1.0).abs() < 1e-3, "{point}");
        let [value, ..] = interval(&point["damping_ratio"]);
        assert!((value / damping - 1.0).abs() < 2e-2, "{point}");
        // RMS of a hundred sines, and of the response of the mode: σ² = Σ½F²|H|².
        let rms = force * (100.0_f64 / 2.0).sqrt();
        assert!(
            (point["force_n"].as_f64().unwrap() / rms - 1.0).abs() < 1e-6,
            "{point}"
        );
        let own = TAU * hertz;
        let square: f64 = (120..220)
            .map(|line| {
                let omega = TAU * f64::from(line) / 8.0;
                let size = 0.8 * (own * own - omega * omega).hypot(2.0 * damping * own * omega);
                (force / size).powi(2)
            })
            .sum();
        // The amplitude counts the response within five half-power bandwidths.
        let amplitude = point["amplitude_m"].as_f64().unwrap();
        assert!(
            (0.9..1.001).contains(&(amplitude / square.sqrt())),
            "{point} {}",
            square.sqrt()
        );
    }
    let table = std::fs::read_to_string(here.join("curve.csv")).unwrap();
    assert!(
        table.starts_with("source,channel,force [N],t [s],amplitude [m],"),
        "{table}"
    );
    let fields = table.lines().next().unwrap().split(',').count();
    assert!(
        table.lines().all(|line| line.split(',').count() == fields),
        "{table}"
    );
    assert!(
        std::fs::read_to_string(here.join("curve.svg"))
            .unwrap()
            .contains("damping ratio [%]")
    );
    assert!(
        std::fs::read_to_string(here.join("curve.html"))
            .unwrap()
            .contains("averages over")
    );
    let text = quietcut(here, &["identify", "linear.csv", "--method", "backbone"]);
    assert_eq!(text.status, Some(0), "{text:?}");
    for words in [
        "amplitude [µm]",
        "frequency [Hz]",
        "damping ratio [%]",
        "no dependence on the amplitude",
    ] {
        assert!(text.stdout.contains(words), "{words}: {}", text.stdout);
    }
}

/// A linear law fitted to a nonlinear decay says that it is an average; fitted to a linear one it does not.
#[test]
fn a_linear_law_of_a_nonlinear_decay_is_said_to_be_an_average() {
    let folder = folder();
    let here = folder.path();
    write_decay(&here.join("linear.csv"), 0.01, 0.0, 5);
    write_decay(&here.join("softening.csv"), 0.01, -0.06, 6);
    let warnings = |file: &str, surface: &str| {
        let arguments = [
            "identify",
            file,
            "--method",
            "restoring-force",
            "--mass-kg",
            "1",
            "--surface",
            surface,
            "--json",
        ];
        quietcut(here, &arguments).json()["warnings"].to_string()
    };
    let words = "are averages over";
    assert!(warnings("softening.csv", "damping,stiffness").contains(words));
    assert!(!warnings("linear.csv", "damping,stiffness").contains(words));
    assert!(!warnings("softening.csv", "damping,stiffness,cubic-stiffness").contains(words));
    quietcut(
        here,
        &[
            "identify",
            "linear.csv",
            "--method",
            "backbone",
            "--until-s",
            "0.3",
        ],
    )
    .refused(&["too short", "linear.csv"]);
}

/// A file that the method does not write is refused before anything is read: the recordings do not exist.
#[test]
fn files_that_a_method_does_not_write_are_refused_at_once() {
    let folder = folder();
    for (method, file, words) in [
        (
            "modes",
            "x.csv",
            "writes no table; methods that do: mode-shapes, backbone; ",
        ),
        (
            "restoring-force",
            "x.csv",
            ".toml or .html is needed, such as x.toml",
        ),
        (
            "linearity",
            "x.svg",
            "writes no picture; methods that do: modes, mode-shapes, backbone; ",
        ),
        (
            "backbone",
            "x.toml",
            ".csv, .html or .svg is needed, such as x.csv",
        ),
        (
            "ncma",
            "x.toml",
            "writes no case; methods that do: modes, harmonic-balance, ",
        ),
    ] {
        let arguments = ["identify", "absent.csv", "--method", method, "--out", file];
        quietcut(folder.path(), &arguments).refused(&[&format!("--out {file}: --method {method} "), words]);
    }
}

/// Three periods are too few for averages over periods: `frf` says so beside the receptances with leakage, `identify` where these have no peak.
#[test]
fn a_multisine_of_three_periods_is_said_to_be_too_short() {
    let folder = folder();
    let here = folder.path();
    write_multisine(&here.join("short.csv"), 3, [21.0, 0.01], 1.0, 7);
    quietcut(here, &["identify", "short.csv", "--method", "backbone"]).refused(&[
        "no force level",
        "after 4096 samples (8.0000 s)",
        "the record holds 3.0 periods",
        "record 4 periods or more",
    ]);
    let answer = quietcut(here, &["frf", "short.csv", "--json"]).json();
    assert!(
        answer["warnings"]
            .to_string()
            .contains("record 4 periods or more"),
        "{answer}"
    );
}
