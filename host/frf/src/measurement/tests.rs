//! Tests on known structures with synthetic excitation. Responses are exact: closed-form modes, forces linear between samples.

use std::f64::consts::TAU;

use nalgebra::Matrix2;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

use super::*;
use crate::{HammerWindows, Window};
use quietcut_recording::{Channel, Quantity, Sidecar, TestKind};

pub(super) const RATE: f64 = 512.0;

/// A mode: natural frequency, damping ratio, modal mass, mode shape in x, y, z.
struct Mode {
    hertz: f64,
    damping: f64,
    mass_kg: f64,
    shape: [f64; 3],
}

/// Two modes that couple all directions.
const MODES: [Mode; 2] = [
    Mode {
        hertz: 17.4,
        damping: 0.02,
        mass_kg: 60.0,
        shape: [0.3, 1.0, -0.2],
    },
    Mode {
        hertz: 21.0,
        damping: 0.03,
        mass_kg: 80.0,
        shape: [1.0, -0.4, 0.5],
    },
];

/// Receptance H_pq(f) of the structure times sinc²(f/rate): the factor between the spectrum of the samples and that of a force that is linear
/// between them.
pub(super) fn receptance(hertz: f64, p: usize, q: usize) -> Complex64 {
    let omega = TAU * hertz;
    let half = std::f64::consts::PI * hertz / RATE;
    let linear = (half.sin() / half).powi(2);
    MODES
        .iter()
        .map(|mode| {
            let own = TAU * mode.hertz;
            let denominator = Complex64::new(own * own - omega * omega, 2.0 * mode.damping * own * omega);
            linear * mode.shape[p] * mode.shape[q] / (mode.mass_kg * denominator)
        })
        .sum()
}

/// Exact displacements, m, under forces that are linear between samples, as a band-limited force nearly is.
fn displacements(forces: &[Vec<f64>; 3]) -> [Vec<f64>; 3] {
    let samples = forces[0].len();
    let mut moved: [Vec<f64>; 3] = std::array::from_fn(|_| vec![0.0; samples]);
    let step = 1.0 / RATE;
    for mode in &MODES {
        let own = TAU * mode.hertz;
        let a = Matrix2::new(0.0, 1.0, -own * own, -2.0 * mode.damping * own);
        let exact = (a * step).exp();
        let inverse = a.try_inverse().unwrap();
        let b = nalgebra::Vector2::new(0.0, 1.0 / mode.mass_kg);
        // Solution of x' = A x + b (f0 + (f1 − f0) t/T) over one sampling interval: constant part and ramp of the force.
        let held = inverse * (exact - Matrix2::identity()) * b;
        let ramp = inverse * inverse * (exact - Matrix2::identity()) * b / step - inverse * b;
        let modal: Vec<f64> = (0..samples)
            .map(|k| (0..3).map(|q| mode.shape[q] * forces[q][k]).sum())
            .collect();
        let mut state = nalgebra::Vector2::zeros();
        for k in 0..samples {
            for (moved, shape) in moved.iter_mut().zip(mode.shape) {
                moved[k] += shape * state[0];
            }
            let next = modal.get(k + 1).copied().unwrap_or(modal[k]);
            state = exact * state + held * modal[k] + ramp * (next - modal[k]);
        }
    }
    moved
}

pub(super) fn random(seed: u64) -> ChaCha8Rng {
    println!("seed {seed}");
    ChaCha8Rng::seed_from_u64(seed)
}

/// Random force with little power near half the sampling rate: white noise after a two-pole low pass.
pub(super) fn force_noise(random: &mut ChaCha8Rng, samples: usize, size: f64) -> Vec<f64> {
    let (mut a, mut b) = (0.0, 0.0);
    (0..samples)
        .map(|_| {
            let white: f64 = StandardNormal.sample(random);
            a += 0.5 * (size * white - a);
            b += 0.5 * (a - b);
            b
        })
        .collect()
}

fn with_noise(signal: &[f64], part: f64, random: &mut ChaCha8Rng) -> Vec<f64> {
    let rms = (signal.iter().map(|x| x * x).sum::<f64>() / signal.len() as f64).sqrt();
    signal
        .iter()
        .map(|x| {
            let white: f64 = StandardNormal.sample(random);
            x + part * rms * white
        })
        .collect()
}

/// A recording of forces, and of displacements with noise; a force that is zero throughout has no channel.
pub(super) fn record(
    kind: TestKind,
    forces: [Vec<f64>; 3],
    noise: f64,
    random: &mut ChaCha8Rng,
) -> Recording {
    let moved = displacements(&forces);
    let channel = |name: &str, quantity, samples| Channel {
        name: name.into(),
        quantity,
        samples,
    };
    let mut channels = Vec::new();
    for (name, force) in ["fx", "fy", "fz"].into_iter().zip(forces) {
        if force.iter().any(|f| *f != 0.0) {
            channels.push(channel(name, Quantity::Force, force));
        }
    }
    for (name, signal) in ["x", "y", "z"].into_iter().zip(&moved) {
        channels.push(channel(
            name,
            Quantity::Displacement,
            with_noise(signal, noise, random),
        ));
    }
    Recording {
        path: "test.csv".into(),
        sample_rate_hz: RATE,
        start_s: 0.0,
        since_s: 0.0,
        channels,
        sidecar: Sidecar {
            kind: Some(kind),
            ..Sidecar::default()
        },
    }
}

pub(super) fn along_y(force: Vec<f64>) -> [Vec<f64>; 3] {
    let rest = vec![0.0; force.len()];
    [rest.clone(), force, rest]
}

fn in_band() -> MeasurementSettings {
    MeasurementSettings {
        band_hz: Some((10.0, 30.0)),
        ..MeasurementSettings::default()
    }
}

/// Largest error of a measured receptance, as a fraction of the peak of the true receptance.
pub(super) fn error(measurement: &Measurement, name: &str) -> f64 {
    let entry = measurement
        .table
        .entries()
        .iter()
        .find(|entry| entry.name() == name)
        .unwrap();
    let (p, q) = (entry.response.axis().unwrap(), entry.force.axis().unwrap());
    let truth = |hertz: &f64| receptance(*hertz, p, q);
    let frequency_hz = measurement.table.frequency_hz();
    let peak = frequency_hz
        .iter()
        .map(|hertz| truth(hertz).norm())
        .fold(0.0, f64::max);
    let worst = frequency_hz
        .iter()
        .zip(&entry.receptance)
        .map(|(hertz, h)| (h - truth(hertz)).norm())
        .fold(0.0, f64::max);
    worst / peak
}

#[test]
fn welch_finds_the_receptances_of_one_force() {
    let mut random = random(1);
    let forces = along_y(force_noise(&mut random, (600.0 * RATE) as usize, 10.0));
    let recording = record(TestKind::Shaker, forces, 0.01, &mut random);
    let settings = MeasurementSettings {
        resolution_hz: Some(0.05),
        ..in_band()
    };
    let measurement = measure(std::slice::from_ref(&recording), &settings).unwrap();
    assert_eq!(measurement.table.entries().len(), 3);
    for name in ["xy", "yy", "zy"] {
        // The window widens a peak of 0.7 Hz by 0.075 Hz, which lowers it by 1 %; noise of 1 % with some 50 averages adds to that.
        let error = error(&measurement, name);
        assert!(error < 0.03, "{name}: {error}");
    }
    let group = &measurement.groups[0];
    // 59 segments that overlap by half have 1/18 fewer effective averages.
    assert!((group.averages - 56.8).abs() < 2.5, "{}", group.averages);
}

#[test]
fn segments_with_clipped_samples_are_left_out() {
    let mut random = random(4);
    let force = force_noise(&mut random, (600.0 * RATE) as usize, 10.0);
    let whole = record(TestKind::Shaker, along_y(force), 0.01, &mut random);
    let settings = MeasurementSettings {
        resolution_hz: Some(0.05),
        ..in_band()
    };
    let clipped_at = |share: f64| {
        let mut recording = whole.clone();
        let samples = &mut recording.channels[2].samples;
        let most = share * samples.iter().fold(0.0_f64, |most, y| most.max(y.abs()));
        samples.iter_mut().for_each(|y| *y = y.clamp(-most, most));
        measure(&[recording], &settings)
    };
    // A response that is 0.9 of its largest for some samples of a period is in few of 59 segments.
    let measurement = clipped_at(0.9).unwrap();
    let warning = measurement
        .warnings
        .iter()
        .find(|warning| warning.contains("clipped"))
        .unwrap();
    assert!(
        warning.starts_with("y is clipped at ")
            && warning.ends_with("of 59 segments are left out; a larger range of the sensor keeps them"),
        "{warning}"
    );
    let averages = measurement.groups[0].averages;
    assert!((30.0..56.0).contains(&averages), "{averages}");
    // As without clipping, in `welch_finds_the_receptances_of_one_force`.
    let error = error(&measurement, "yy");
    assert!(error < 0.03, "{error}");
    let refused = clipped_at(0.4).unwrap_err().to_string();
    assert!(
        refused.contains("y is clipped") && refused.contains("of 59 segments; what remains"),
        "{refused}"
    );
}

#[test]
fn clipped_impacts_are_left_out() {
    let mut random = random(32);
    let mut force = vec![0.0; (64.0 * RATE) as usize];
    for (index, at_s) in [1.0, 13.1, 25.3, 37.2, 49.4].into_iter().enumerate() {
        impact(&mut force, at_s, 200.0 + 30.0 * index as f64);
    }
    let mut recording = record(TestKind::Hammer, along_y(force), 0.0, &mut random);
    let samples = &mut recording.channels[2].samples;
    // Between the responses to 290 and to 320 N.
    let most = 0.93 * samples.iter().fold(0.0_f64, |most, y| most.max(y.abs()));
    samples.iter_mut().for_each(|y| *y = y.clamp(-most, most));
    let measurement = measure(&[recording], &in_band()).unwrap();
    let (used, _) = measurement.groups[0].impacts.clone().unwrap();
    assert_eq!(used.len(), 4);
    assert!(
        measurement
            .warnings
            .iter()
            .any(|warning| warning.starts_with("impacts with clipped samples are left out: at 49.4")),
        "{:?}",
        measurement.warnings
    );
    let error = error(&measurement, "yy");
    assert!(error < 0.02, "{error}");
}

#[test]
fn estimators_differ_by_where_the_noise_is_and_coherence_is_their_ratio() {
    let mut random = random(2);
    let force = force_noise(&mut random, (1200.0 * RATE) as usize, 10.0);
    let clean = record(TestKind::Shaker, along_y(force.clone()), 0.0, &mut random);
    let mut noisy_force = clean.clone();
    let force_with_noise = with_noise(&force, 0.3, &mut random);
    noisy_force.channels[0].samples = force_with_noise;
    let measured = |recording: &Recording, estimator| {
        let settings = MeasurementSettings {
            estimator,
            resolution_hz: Some(0.1),
            ..in_band()
        };
        let measurement = measure(std::slice::from_ref(recording), &settings).unwrap();
        let entry = measurement
            .table
            .entry(Direction::Y, Direction::Y)
            .unwrap()
            .clone();
        let mean = |of: &dyn Fn(usize, f64) -> f64| {
            let lines = measurement.table.frequency_hz();
            lines
                .iter()
                .enumerate()
                .map(|(k, &hertz)| of(k, hertz))
                .sum::<f64>()
                / lines.len() as f64
        };
        let ratio = mean(&|k, hertz| entry.receptance[k].norm() / receptance(hertz, 1, 1).norm());
        (ratio, entry)
    };
    let (h1, first) = measured(&noisy_force, Estimator::H1);
    let (h2, second) = measured(&noisy_force, Estimator::H2);
    let (mean, _) = measured(&noisy_force, Estimator::Mean);
    // White noise with 9 % of the power of the force has 1.7 % of its spectral density at 10 Hz and 2.7 % at 30 Hz. The window changes
    // both by a few thousandths.
    assert!(
        (0.973..0.983).contains(&(h1 / h2)) && (h2 - 1.0).abs() < 0.006,
        "{h1} {h2}"
    );
    assert!((mean - 0.5 * (h1 + h2)).abs() < 5e-3, "{mean}");
    for (k, coherence) in first.coherence.unwrap().iter().enumerate() {
        let ratio = (first.receptance[k] / second.receptance[k]).re;
        // The coherence equals H1/H2 by definition, within rounding.
        assert!((ratio - coherence).abs() < 1e-9, "{ratio} {coherence}");
    }
}

/// Reference values of scipy 1.17.1: `csd(f, x, fs=512, window=w, nperseg=64, noverlap=32)` over `welch` and coherence,
/// for f_k = sin(0.3k) + sin(0.001k²), x_k = f_{k−1} − 0.5 f_{k−3} + cos(0.7k), k < 400 (0 before the start); lines 3, 10
/// and 20.
#[test]
fn one_force_agrees_with_scipy() {
    let f = |k: i32| {
        let t = f64::from(k);
        if k < 0 {
            0.0
        } else {
            (0.3 * t).sin() + (0.001 * t * t).sin()
        }
    };
    let force: Vec<f64> = (0..400).map(f).collect();
    let x: Vec<f64> = (0..400)
        .map(|k| f(k - 1) - 0.5 * f(k - 3) + (0.7 * f64::from(k)).cos())
        .collect();
    let mut recording = record(TestKind::Shaker, along_y(force), 0.0, &mut random(3));
    recording.channels = vec![
        recording.channels[0].clone(),
        Channel {
            name: "y".into(),
            quantity: Quantity::Displacement,
            samples: x,
        },
    ];
    for (window, expected) in SCIPY {
        let settings = MeasurementSettings {
            window,
            resolution_hz: Some(RATE / 64.0),
            ..MeasurementSettings::default()
        };
        let measurement = measure(std::slice::from_ref(&recording), &settings).unwrap();
        let entry = &measurement.table.entries()[0];
        for (line, re, im, coherence) in expected {
            // The table begins with line 1 of the transform. The reference has ten digits.
            let h = entry.receptance[line - 1];
            assert!(
                (h - Complex64::new(re, im)).norm() < 2e-9 * h.norm(),
                "{line}: {h}"
            );
            assert!((entry.coherence.as_ref().unwrap()[line - 1] - coherence).abs() < 2e-9);
        }
    }
}

/// Line, real and imaginary part of H1, coherence.
type Reference = (usize, f64, f64, f64);

const SCIPY: [(Window, [Reference; 3]); 3] = [
    (
        Window::Hann,
        [
            (3, 6.4524587080e-01, 9.4994603580e-02, 9.9868730403e-01),
            (10, 1.1241023482e+00, -5.9789549369e-01, 6.0696973685e-01),
            (20, 8.0091194064e-01, -2.5453970019e-01, 3.5191655571e-01),
        ],
    ),
    (
        Window::Hamming,
        [
            (3, 6.4164898027e-01, 9.6064146933e-02, 9.9890759173e-01),
            (10, 6.9751200999e-01, -8.5022229352e-02, 7.1955256745e-01),
            (20, 6.0031061135e-01, -2.0209303240e-02, 4.0004257865e-01),
        ],
    ),
    (
        Window::Rectangular,
        [
            (3, 6.2092224488e-01, 1.0092401725e-01, 9.9568021880e-01),
            (10, 7.3167889332e-01, -2.1169792569e-01, 3.5817162371e-01),
            (20, 5.9855377746e-01, -2.2550829083e-02, 3.9704021130e-01),
        ],
    ),
];

#[test]
fn three_forces_at_once_give_nine_receptances_and_intervals_that_cover() {
    let mut covered = 0;
    let mut counted = 0;
    for seed in 10..14 {
        let mut random = random(seed);
        let samples = (400.0 * RATE) as usize;
        let common = force_noise(&mut random, samples, 6.0);
        // The three forces are partly correlated, as cutting forces are.
        let forces: [Vec<f64>; 3] = std::array::from_fn(|q| {
            let own = force_noise(&mut random, samples, 10.0);
            own.iter()
                .zip(&common)
                .map(|(a, b)| a + [1.0, -1.0, 0.5][q] * b)
                .collect()
        });
        let recording = record(TestKind::Cutting, forces, 0.1, &mut random);
        let settings = MeasurementSettings {
            resolution_hz: Some(0.05),
            ..in_band()
        };
        let measurement = measure(std::slice::from_ref(&recording), &settings).unwrap();
        assert_eq!(measurement.table.entries().len(), 9);
        assert!((0.5..1.0).contains(&measurement.groups[0].least_singular));
        for (entry, deviation) in measurement.table.entries().iter().zip(&measurement.deviation) {
            let (p, q) = (entry.response.axis().unwrap(), entry.force.axis().unwrap());
            // The intervals cover random errors only. Away from resonances the window causes no bias.
            for (k, &hertz) in measurement.table.frequency_hz().iter().enumerate() {
                if (12.0..16.0).contains(&hertz) || (24.0..29.0).contains(&hertz) {
                    let off = (entry.receptance[k].re - receptance(hertz, p, q).re).abs();
                    covered += usize::from(off < 1.645 * deviation[k]);
                    counted += 1;
                }
            }
        }
    }
    // Expected are 90 % of some six thousand values; those at neighbouring lines are correlated.
    let part = f64::from(covered as u32) / f64::from(counted as u32);
    assert!((0.87..0.93).contains(&part), "{part} of {counted}");
}

#[test]
fn dependent_forces_are_refused_and_further_tests_make_them_independent() {
    let mut random = random(20);
    let samples = (240.0 * RATE) as usize;
    // As in cuts, the three forces are multiples of one signal; each immersion has another proportion.
    let cuts: Vec<Recording> = [[1.0, 0.5, 0.1], [-0.3, 1.0, 0.2], [0.2, -0.6, 0.5]]
        .iter()
        .map(|proportion: &[f64; 3]| {
            let common = force_noise(&mut random, samples, 10.0);
            let forces = proportion.map(|part| common.iter().map(|f| part * f).collect());
            record(TestKind::Cutting, forces, 0.002, &mut random)
        })
        .collect();
    let settings = |estimator| MeasurementSettings {
        estimator,
        resolution_hz: Some(0.02),
        ..in_band()
    };
    for cuts in [&cuts[..1], &cuts[..2]] {
        let said = measure(cuts, &settings(Estimator::PseudoInverse))
            .unwrap_err()
            .to_string();
        assert!(
            said.contains("fx, fy, fz drive no independent motion") && said.contains("immersions"),
            "{said}"
        );
    }
    for estimator in [Estimator::H1, Estimator::PseudoInverse] {
        let measurement = measure(&cuts, &settings(estimator)).unwrap();
        for (entry, deviation) in measurement.table.entries().iter().zip(&measurement.deviation) {
            let (p, q) = (entry.response.axis().unwrap(), entry.force.axis().unwrap());
            let truth: Vec<Complex64> = measurement
                .table
                .frequency_hz()
                .iter()
                .map(|&f| receptance(f, p, q))
                .collect();
            let peak = truth.iter().map(|h| h.norm()).fold(0.0, f64::max);
            for (k, truth) in truth.iter().enumerate() {
                // Five standard deviations are exceeded by one value in a million. The window lowers peaks by 1 %.
                let off = (entry.receptance[k] - truth).norm();
                assert!(
                    off < 5.0 * deviation[k] + 0.01 * peak,
                    "{}: {off} {}",
                    entry.name(),
                    deviation[k]
                );
            }
            // The forces in x and y are large, so that the errors of their columns are small.
            assert!(
                q == 2 || error(&measurement, &entry.name()) < 0.08,
                "{}: {}",
                entry.name(),
                error(&measurement, &entry.name())
            );
            let coherence = entry.coherence.as_ref().unwrap();
            let mean = coherence.iter().sum::<f64>() / coherence.len() as f64;
            assert!(mean > 0.97, "{mean}");
        }
    }
}

/// Adds an impact to the force from `at_s` on: a squared half sine of 30 ms with the peak `newtons`.
fn impact(force: &mut [f64], at_s: f64, newtons: f64) {
    let (first, width) = ((at_s * RATE) as usize, (0.03 * RATE) as usize);
    for k in 0..=width {
        force[first + k] += newtons * (std::f64::consts::PI * k as f64 / width as f64).sin().powi(2);
    }
}

#[test]
fn impacts_become_segments_and_double_impacts_are_left_out() {
    let mut random = random(30);
    let mut force = vec![0.0; (64.0 * RATE) as usize];
    for (index, at_s) in [1.0, 13.1, 25.3, 37.2, 49.4].into_iter().enumerate() {
        impact(&mut force, at_s, 200.0 + 30.0 * index as f64);
    }
    impact(&mut force, 25.3 + 0.11, 40.0);
    let mut recording = record(TestKind::Hammer, along_y(force), 0.002, &mut random);
    recording.channels[0].samples = with_noise(&recording.channels[0].samples, 0.002, &mut random);
    let measurement = measure(std::slice::from_ref(&recording), &in_band()).unwrap();
    let (used, double) = measurement.groups[0].impacts.clone().unwrap();
    assert_eq!((used.len(), double.len()), (4, 1));
    assert!((used[0].peak_n - 200.0).abs() < 5.0 && (used[0].time_s - 1.015).abs() < 0.005);
    let (delay_s, part) = double[0].second.unwrap();
    assert!(
        (delay_s - 0.11).abs() < 0.005 && (part - 40.0 / 260.0).abs() < 0.02,
        "{delay_s} {part}"
    );
    // Noise of 0.2 % of the signal acts over eleven seconds of each segment, much longer than the decay.
    let error = error(&measurement, "yy");
    assert!(error < 0.02, "{error}");
}

/// A strike within the time of bounces after another is a pulse of the hammer nevertheless.
#[test]
fn strikes_in_quick_succession_are_those_of_a_hammer() {
    let mut force = vec![0.0; (8.0 * RATE) as usize];
    for (at_s, newtons) in [(0.4, 470.0), (1.0, 370.0), (1.2, 380.0)] {
        impact(&mut force, at_s, newtons);
    }
    let force = with_noise(&force, 0.0005, &mut random(32));
    assert!(crate::hammer::is_struck(&force, RATE));
}

#[test]
fn an_impact_without_a_whole_segment_is_left_out_with_a_warning() {
    let mut random = random(31);
    let mut force = vec![0.0; (40.0 * RATE) as usize];
    for at_s in [1.0, 13.1, 25.3, 37.2] {
        impact(&mut force, at_s, 200.0);
    }
    let recording = record(TestKind::Hammer, along_y(force), 0.002, &mut random);
    let settings = MeasurementSettings {
        hammer: HammerWindows {
            segment_s: Some(10.0),
            ..HammerWindows::default()
        },
        ..in_band()
    };
    let measurement = measure(std::slice::from_ref(&recording), &settings).unwrap();
    let (used, double) = measurement.groups[0].impacts.clone().unwrap();
    assert_eq!((used.len(), double.len()), (3, 0));
    let expected = "impacts without a whole segment of 10.000 s in the record are left out: at 37.2";
    assert!(
        measurement
            .warnings
            .iter()
            .any(|warning| warning.starts_with(expected)),
        "{:?}",
        measurement.warnings
    );
}

#[test]
fn a_frequency_step_with_few_samples_per_period_is_left_out_with_a_warning() {
    let mut random = random(52);
    let mut force = Vec::new();
    for hertz in [16.0, 18.0, 0.3 * RATE] {
        force.extend((0..(12.0 * RATE) as usize).map(|k| 10.0 * (TAU * hertz * k as f64 / RATE).sin()));
        force.extend(vec![0.0; (1.5 * RATE) as usize]);
    }
    let recording = record(TestKind::StepSine, along_y(force), 0.0, &mut random);
    let measurement = measure(std::slice::from_ref(&recording), &MeasurementSettings::default()).unwrap();
    assert_eq!(measurement.table.frequency_hz().len(), 2);
    assert!(
        measurement
            .warnings
            .iter()
            .any(|warning| warning.contains("fewer than 5 samples per period are left out: at about 154 Hz;")),
        "{:?}",
        measurement.warnings
    );
}

#[test]
fn a_frequency_without_force_is_left_out_with_a_warning() {
    let spectra = |force: f64| {
        let samples: Vec<f64> = (0..64)
            .map(|k| force * (TAU * 4.0 * f64::from(k) / 64.0).cos())
            .collect();
        let segments = crate::cross_spectra::Segments {
            weights: vec![1.0; 64],
            starts: vec![0],
            without_mean: false,
            averages: 1.0,
        };
        crate::cross_spectra::averaged(&[&samples, &samples], 64.0, &segments, 4..6)
    };
    let counts = ChannelCounts {
        forces: 1,
        responses: 1,
    };
    let warning = |force: f64| {
        let spectra = [spectra(force)];
        let lines = estimate::lines(&spectra, counts, Estimator::H1);
        singular_lines(&spectra, &lines)
    };
    assert!(
        warning(0.0)
            .unwrap()
            .contains("at 2 frequencies, which are left out (the first is 4.000 Hz)")
    );
    assert_eq!(warning(1.0), None);
}

#[test]
fn the_damping_of_an_exponential_window_is_taken_off_again() {
    let mut random = random(31);
    let mut force = vec![0.0; (26.0 * RATE) as usize];
    for at_s in [1.0, 5.1, 9.3, 13.2, 17.4, 21.5] {
        impact(&mut force, at_s, 200.0);
    }
    let recording = record(TestKind::Hammer, along_y(force), 0.0, &mut random);
    let tau = 0.8;
    let settings = MeasurementSettings {
        hammer: HammerWindows {
            segment_s: Some(3.9),
            exponential_s: Some(tau),
        },
        ..in_band()
    };
    let measurement = measure(std::slice::from_ref(&recording), &settings).unwrap();
    let entry = measurement.table.entry(Direction::Y, Direction::Y).unwrap();
    let lines = measurement.table.frequency_hz();
    let peak = lines
        .iter()
        .map(|&f| receptance(f, 1, 1).norm())
        .fold(0.0, f64::max);
    for (&hertz, h) in lines.iter().zip(&entry.receptance) {
        // The free decay after the previous impact, e^{−ζωt}, has fallen below 1 %; the mode grows by σ_w/σ = 1.6.
        let truth = receptance(hertz, 1, 1);
        assert!((h - truth).norm() < 0.025 * peak, "{hertz}: {h} {truth}");
    }
    // A window that makes nearly all of the decay leaves nothing to be told.
    let short = MeasurementSettings {
        hammer: HammerWindows {
            segment_s: Some(3.9),
            exponential_s: Some(0.01),
        },
        ..in_band()
    };
    let refused = measure(std::slice::from_ref(&recording), &short)
        .unwrap_err()
        .to_string();
    assert!(refused.contains("exponential window"), "{refused}");
}

#[test]
fn a_slow_sweep_gives_receptances_in_its_frequency_range() {
    let mut random = random(40);
    let seconds = 300.0;
    let force: Vec<f64> = (0..(seconds * RATE) as usize)
        .map(|k| {
            let t = k as f64 / RATE;
            14.0 * (TAU * (8.0 * t + 0.5 * (30.0 - 8.0) / seconds * t * t)).sin()
        })
        .collect();
    let recording = record(TestKind::Sweep, along_y(force), 0.01, &mut random);
    let measurement = measure(std::slice::from_ref(&recording), &MeasurementSettings::default()).unwrap();
    let frequency_hz = measurement.table.frequency_hz();
    let (first, last) = (frequency_hz[0], frequency_hz[frequency_hz.len() - 1]);
    // The spectrum of a sweep does not end sharply at its last frequency: it falls to a thousandth within a few tenths of a hertz.
    assert!(
        (first - 8.0).abs() < 0.6 && (last - 30.0).abs() < 0.6,
        "{first} {last}"
    );
    let measurement = measure(
        std::slice::from_ref(&recording),
        &MeasurementSettings {
            band_hz: Some((9.0, 29.0)),
            ..MeasurementSettings::default()
        },
    )
    .unwrap();
    // Noise of 1 % is spread over 256 Hz, of which the sweep covers 22 Hz.
    let error = error(&measurement, "yy");
    assert!(error < 0.01, "{error}");
}

#[test]
fn step_sine_is_demodulated_with_drift_and_reports_unsettled_steps() {
    let mut random = random(50);
    let frequencies: Vec<f64> = (0..17).map(|k| 15.0 + 0.5 * f64::from(k)).collect();
    let (stay_s, pause_s) = (12.0, 1.5);
    let mut force = Vec::new();
    let mut phase = 0.0;
    for (index, hertz) in frequencies.iter().enumerate() {
        // Two force levels in turn, without force between the steps.
        let newtons = if index % 2 == 0 { 14.0 } else { 2.5 };
        for _ in 0..(stay_s * RATE) as usize {
            force.push(newtons * f64::sin(phase));
            phase += TAU * hertz / RATE;
        }
        force.extend(vec![0.0; (pause_s * RATE) as usize]);
    }
    let mut recording = record(TestKind::StepSine, along_y(force), 0.0, &mut random);
    let rms = |samples: &[f64]| (samples.iter().map(|x| x * x).sum::<f64>() / samples.len() as f64).sqrt();
    let drift = 5.0 * rms(&recording.channels[2].samples);
    for (k, sample) in recording.channels[2].samples.iter_mut().enumerate() {
        *sample += drift * (k as f64 / 30_000.0).sin();
    }
    recording.channels[0].samples = with_noise(&recording.channels[0].samples, 0.01, &mut random);
    let measurement = measure(std::slice::from_ref(&recording), &MeasurementSettings::default()).unwrap();
    let found = measurement.table.frequency_hz();
    assert_eq!(found.len(), frequencies.len(), "{found:?}");
    for (found, expected) in found.iter().zip(&frequencies) {
        assert!((found - expected).abs() < 1e-4 * expected, "{found} {expected}");
    }
    for name in ["xy", "yy", "zy"] {
        // 1 % noise of the force is averaged over seconds; settled subsegments deviate by up to 0.2 %.
        let error = error(&measurement, name);
        assert!(error < 5e-3, "{name}: {error}");
    }
    assert!(
        !measurement.warnings.iter().any(|said| said.contains("settled")),
        "{:?}",
        measurement.warnings
    );
    let short: Vec<Channel> = recording
        .channels
        .iter()
        .map(|channel| Channel {
            samples: channel
                .samples
                .chunks(((stay_s + pause_s) * RATE) as usize)
                .flat_map(|step| &step[..(1.0 * RATE) as usize])
                .copied()
                .collect(),
            ..channel.clone()
        })
        .collect();
    let hurried = Recording {
        channels: short,
        ..recording.clone()
    };
    let measurement = measure(std::slice::from_ref(&hurried), &MeasurementSettings::default()).unwrap();
    assert!(
        measurement
            .warnings
            .iter()
            .any(|said| said.contains("had not settled at")),
        "{:?}",
        measurement.warnings
    );
}

#[test]
fn records_that_cannot_be_measured_are_refused_with_the_reason() {
    let mut random = random(60);
    let noise = force_noise(&mut random, 4096, 1.0);
    let good = record(TestKind::Shaker, along_y(noise), 0.0, &mut random);
    let said = |change: &dyn Fn(&mut Recording), settings: &MeasurementSettings| {
        let mut recording = good.clone();
        change(&mut recording);
        measure(&[recording], settings).unwrap_err().to_string()
    };
    let plain = MeasurementSettings::default();
    assert!(said(&|r| r.channels.truncate(1), &plain).contains("no response"));
    assert!(said(&|r| drop(r.channels.remove(0)), &plain).contains("no force"));
    assert!(said(&|r| r.channels[0].samples.fill(1.0), &plain).contains("no force"));
    assert!(said(&|r| r.sidecar.input = Some(vec!["x".into()]), &plain).contains("needs a force"));
    assert!(said(&|r| r.sidecar.input = Some(vec!["q".into()]), &plain).contains("\"q\""));
    let mut twice = good.clone();
    twice.channels.push(Channel {
        name: "ay".into(),
        quantity: Quantity::Acceleration,
        samples: good.channels[0].samples.clone(),
    });
    let chosen = measure(&[twice], &plain).unwrap();
    assert!(
        chosen.warnings[0].contains("y is taken for the response in y, not ay"),
        "{:?}",
        chosen.warnings
    );
    assert_eq!(
        chosen.table,
        measure(std::slice::from_ref(&good), &plain).unwrap().table
    );
    let fine = MeasurementSettings {
        resolution_hz: Some(0.01),
        ..plain.clone()
    };
    assert!(said(&|_| {}, &fine).contains("resolution of 0.01 Hz"));
    let chosen = MeasurementSettings {
        channels: vec!["q".into()],
        ..plain.clone()
    };
    assert!(said(&|_| {}, &chosen).contains("channel \"q\""));
    let hammer = MeasurementSettings {
        excitation: Some(Excitation::Hammer),
        ..plain.clone()
    };
    assert!(
        said(
            &|r| r.channels[0]
                .samples
                .iter_mut()
                .enumerate()
                .for_each(|(k, f)| *f = f64::from((k % 7) as u32)),
            &hammer
        )
        .contains("impact")
    );
    let stepped = MeasurementSettings {
        excitation: Some(Excitation::StepSine),
        ..plain
    };
    assert!(said(&|_| {}, &stepped).contains("step-sine"));
}

/// Nobody strikes in x and in y with the same pauses.
#[test]
fn taps_in_x_and_y_with_different_pauses_have_common_lines() {
    let mut random = random(4);
    let pulses = |between_s: f64, axis: usize| {
        let samples = (RATE * between_s * 4.5) as usize;
        let mut forces: [Vec<f64>; 3] = std::array::from_fn(|_| vec![0.0; samples]);
        for impact in 0..4 {
            let first = (RATE * (0.3 + between_s * f64::from(impact))) as usize;
            for k in 0..=8 {
                forces[axis][first + k] = 100.0 * (std::f64::consts::PI * k as f64 / 8.0).sin();
            }
        }
        forces
    };
    let recordings = [(6.0, 0), (5.3, 1)]
        .map(|(between_s, axis)| record(TestKind::Hammer, pulses(between_s, axis), 1e-4, &mut random));
    let measurement = measure(&recordings, &in_band()).unwrap();
    assert_eq!(measurement.table.entries().len(), 6);
    for name in ["xx", "xy", "yy"] {
        // Slow decay of 17.4 Hz and 2 %: e^(−2.19·5.2) = 1e-5 of the response is left at the end of a segment. The rest is
        // the noise of 1e-4 and the bounded band of the pulse.
        assert!(
            error(&measurement, name) < 5e-3,
            "{name}: {}",
            error(&measurement, name)
        );
    }
}
