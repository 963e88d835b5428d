//! Tests of periodic excitation: on the known structure of the other tests, and on an oscillator with nonlinear stiffness.

use std::f64::consts::TAU;

use num_complex::Complex64;
use quietcut_testkit::rates::assert_share;
use rand::RngExt;
use rand_chacha::ChaCha8Rng;

use super::tests::{RATE, along_y, force_noise, random, receptance, record};
use super::*;
use quietcut_recording::{Channel, Quantity, Sidecar, TestKind};

/// Samples of one period of 4 s.
const PERIOD: usize = 2048;

/// Tones, line and phase, of a realization of random phases.
fn tones(lines: impl Iterator<Item = usize>, random: &mut ChaCha8Rng) -> Vec<(f64, f64)> {
    lines
        .map(|line| (line as f64, random.random_range(0.0..TAU)))
        .collect()
}

/// Multisine Σ a·cos(2π·line·k/PERIOD + φ) over `periods` periods.
fn multisine(tones: &[(f64, f64)], amplitude: f64, periods: f64) -> Vec<f64> {
    let one: Vec<f64> = (0..PERIOD)
        .map(|k| {
            let cosine = |(line, phase): &(f64, f64)| (TAU * line * k as f64 / PERIOD as f64 + phase).cos();
            amplitude * tones.iter().map(cosine).sum::<f64>()
        })
        .collect();
    (0..(periods * PERIOD as f64) as usize)
        .map(|k| one[k % PERIOD])
        .collect()
}

fn of_y(measurement: &Measurement) -> usize {
    let entries = measurement.table.entries();
    entries.iter().position(|entry| entry.name() == "yy").unwrap()
}

#[test]
fn a_multisine_is_recognized_and_gives_receptances_without_its_transient() {
    let mut random = random(60);
    let force = multisine(&tones(40..121, &mut random), 2.0, 8.4);
    let recording = record(TestKind::Shaker, along_y(force), 1e-4, &mut random);
    let measurement = measure(std::slice::from_ref(&recording), &MeasurementSettings::default()).unwrap();
    let group = &measurement.groups[0];
    assert_eq!(group.excitation, Excitation::Multisine);
    let test = group.periodic.as_ref().unwrap();
    assert_eq!(
        (
            test.period_samples,
            test.used[0] + test.dropped[0],
            test.realizations
        ),
        (PERIOD, 8, 1)
    );
    // The transient falls by e^{−ζωT} = 2e-4 in the first two periods; the record begins in the middle of one.
    assert!(test.dropped[0] >= 1, "{test:?}");
    let lines = measurement.table.frequency_hz();
    assert_eq!((lines.len(), lines[0], lines[80]), (81, 10.0, 30.0));
    for name in ["xy", "yy", "zy"] {
        // Noise of 1e-4 of the response is spread over 1024 lines, of which 81 hold the response; the transient is below 2e-3/7.
        let error = super::tests::error(&measurement, name);
        assert!(error < 2e-4, "{name}: {error}");
    }
    let found = &test.distortions[1];
    assert!(
        (found.peak_hz - 17.5).abs() < 0.3 && found.noise < 1e-4,
        "{found:?}"
    );
    assert_eq!((found.even, found.odd, found.total), (None, None, None));
    assert!(
        !measurement
            .warnings
            .iter()
            .any(|warning| warning.contains("periodic"))
    );
}

/// With fewer than four periods a multisine is evaluated in windows, whose leakage lowers the coherence: this is said.
#[test]
fn too_few_periods_of_a_multisine_are_said() {
    let mut random = random(69);
    let tones = tones(40..121, &mut random);
    let mut said = |force: Vec<f64>| {
        let recording = record(TestKind::Shaker, along_y(force), 1e-4, &mut random);
        let measurement = measure(std::slice::from_ref(&recording), &MeasurementSettings::default()).unwrap();
        let of_periods = |warning: &&String| warning.contains("record 4 periods or more");
        let warning = measurement.warnings.iter().find(of_periods).cloned();
        (measurement.groups[0].excitation, warning)
    };
    let (excitation, warning) = said(multisine(&tones, 2.0, 3.2));
    assert_eq!(excitation, Excitation::Random);
    let warning = warning.unwrap();
    assert!(
        warning.contains("after 2048 samples (4.0000 s), and the record holds 3.2 periods"),
        "{warning}"
    );
    assert_eq!(said(multisine(&tones, 2.0, 4.1)), (Excitation::Multisine, None));
    // Three tones are no multisine.
    let few = [(40.0, 0.3), (61.0, 1.0), (83.0, 2.0)];
    assert_eq!(said(multisine(&few, 2.0, 3.2)), (Excitation::Random, None));
}

#[test]
fn a_band_above_half_the_sample_rate_ends_there() {
    let mut random = random(68);
    let force = multisine(&tones(40..121, &mut random), 2.0, 6.0);
    let recording = record(TestKind::Shaker, along_y(force), 1e-4, &mut random);
    let settings = MeasurementSettings {
        band_hz: Some((5.0, RATE)),
        ..MeasurementSettings::default()
    };
    let measurement = measure(std::slice::from_ref(&recording), &settings).unwrap();
    assert_eq!(measurement.groups[0].excitation, Excitation::Multisine);
    assert_eq!(measurement.table.frequency_hz().len(), 81);
    let said = |warning: &String| warning.contains("the band ends at 256 Hz");
    assert!(
        measurement.warnings.iter().any(said),
        "{:?}",
        measurement.warnings
    );
    // A band between two lines of the transform.
    let settings = MeasurementSettings {
        band_hz: Some((31.1, 31.2)),
        excitation: Some(Excitation::Multisine),
        ..settings
    };
    let refused = measure(std::slice::from_ref(&recording), &settings).unwrap_err();
    assert!(refused.to_string().contains("no line of the force"), "{refused}");
}

/// Of two periods that repeat, the first may hold the transient; one period has no scatter.
#[test]
fn one_period_gives_no_interval() {
    let mut random = random(69);
    let first = tones(40..121, &mut random);
    let mut force = multisine(&first, 2.0, 4.0);
    for sample in &mut force[..2 * PERIOD] {
        *sample *= 0.5;
    }
    let recording = record(TestKind::Shaker, along_y(force), 1e-4, &mut random);
    let settings = MeasurementSettings {
        period_s: Some(PERIOD as f64 / RATE),
        ..MeasurementSettings::default()
    };
    let mut measurement = measure(std::slice::from_ref(&recording), &settings).unwrap();
    println!("{:?}", measurement.groups[0].periodic);
    assert_eq!(measurement.groups[0].periodic.as_ref().unwrap().used, [1]);
    assert!(!measurement.has_deviation.contains(&true));
    let entries = measurement.table.entries();
    assert!(entries.iter().all(|entry| entry.coherence.is_none()));
    measurement
        .warnings
        .retain(|warning| warning.contains("one period has no scatter"));
    assert_eq!(measurement.warnings.len(), 1);
}

#[test]
fn a_periodic_chirp_is_periodic_too() {
    let mut random = random(61);
    let chirp = |k: usize| {
        let t = (k % PERIOD) as f64 / RATE;
        // From 10 to 30 Hz in one period of 4 s, with whole periods of both.
        20.0 * (TAU * (10.0 * t + 0.5 * 5.0 * t * t)).sin()
    };
    let force: Vec<f64> = (0..8 * PERIOD).map(chirp).collect();
    let recording = record(TestKind::Shaker, along_y(force), 1e-3, &mut random);
    let settings = MeasurementSettings {
        band_hz: Some((11.0, 29.0)),
        period_s: Some(4.0),
        ..MeasurementSettings::default()
    };
    let measurement = measure(std::slice::from_ref(&recording), &settings).unwrap();
    assert_eq!(measurement.groups[0].excitation, Excitation::Multisine);
    let error = super::tests::error(&measurement, "yy");
    assert!(error < 2e-3, "{error}");
}

/// The 90 % intervals of |H| hold the truth at 81 independent lines of each record; with one recording they are of noise, with three
/// realizations of their scatter.
#[test]
fn intervals_of_noise_hold_the_truth() {
    for (recordings, seeds) in [(1, 100..140), (3, 200..220)] {
        let (mut held, mut counted) = (0, 0);
        for seed in seeds {
            let mut random = random(seed);
            let records: Vec<Recording> = (0..recordings)
                .map(|_| {
                    let force = multisine(&tones(40..121, &mut random), 2.0, 6.0);
                    record(TestKind::Shaker, along_y(force), 0.2, &mut random)
                })
                .collect();
            let measurement = measure(&records, &MeasurementSettings::default()).unwrap();
            let group = &measurement.groups[0];
            assert_eq!(group.periodic.as_ref().unwrap().realizations, recordings);
            let index = of_y(&measurement);
            let entry = &measurement.table.entries()[index];
            for (line, &hertz) in measurement.table.frequency_hz().iter().enumerate() {
                let off = (entry.receptance[line].norm() - receptance(hertz, 1, 1).norm()).abs();
                held +=
                    usize::from(off < measurement.ninety_percent(index) * measurement.deviation[index][line]);
                counted += 1;
            }
        }
        println!("{recordings} recordings: {held} of {counted}");
        assert_share("90 % intervals of a multisine", 0.9, held, counted);
    }
}

/// Noise alone is taken for a distortion once in a thousand tests.
#[test]
fn a_linear_structure_has_no_distortion() {
    let (mut alarms, mut counted) = (0, 0);
    for seed in 300..340 {
        let mut random = random(seed);
        let records: Vec<Recording> = (0..2)
            .map(|_| {
                // Odd lines, of which every third is left out.
                let lines = (41..121).step_by(2).filter(|line| line % 3 != 0);
                let force = multisine(&tones(lines, &mut random), 3.0, 6.0);
                record(TestKind::Shaker, along_y(force), 0.05, &mut random)
            })
            .collect();
        for records in [&records[..1], &records[..]] {
            let measurement = measure(records, &MeasurementSettings::default()).unwrap();
            for found in &measurement.groups[0].periodic.as_ref().unwrap().distortions {
                for level in [found.even, found.odd, found.total].into_iter().flatten() {
                    alarms += usize::from(level.is_significant);
                    counted += 1;
                    // The level of noise: 5 % of the response over 1024 lines, after six periods.
                    assert!(level.ratio < 0.03, "{level:?}");
                }
            }
        }
    }
    println!("{alarms} of {counted}");
    assert_share("false alarms", 1e-3, alarms, counted);
}

/// Mass, damping and stiffness of the nonlinear oscillator: 17.4 Hz, 2 %.
const OSCILLATOR: (f64, f64, f64) = (
    60.0,
    2.0 * 0.02 * 60.0 * TAU * 17.4,
    60.0 * (TAU * 17.4) * (TAU * 17.4),
);

/// Recording of m x'' + c x' + k x + k2 x² + k3 x³ = f, by Runge–Kutta steps of a quarter of a sample.
fn oscillator(tones: &[(f64, f64)], amplitude: f64, [k2, k3]: [f64; 2]) -> Recording {
    let (m, c, k) = OSCILLATOR;
    // The force at every eighth of a sample.
    let eighths = 8 * PERIOD;
    let force: Vec<f64> = (0..eighths)
        .map(|at| {
            let cosine = |(line, phase): &(f64, f64)| (TAU * line * at as f64 / eighths as f64 + phase).cos();
            amplitude * tones.iter().map(cosine).sum::<f64>()
        })
        .collect();
    let at = |eighth: usize| force[eighth % eighths];
    let step = 0.25 / RATE;
    let rate = |[x, v]: [f64; 2], f: f64| [v, (f - c * v - k * x - k2 * x * x - k3 * x * x * x) / m];
    let plus = |[x, v]: [f64; 2], [a, b]: [f64; 2], h: f64| [x + h * a, v + h * b];
    let mut state = [0.0; 2];
    let mut moved = Vec::new();
    for quarter in 0..4 * 8 * PERIOD {
        if quarter % 4 == 0 {
            moved.push(state[0]);
        }
        let (first, middle, last) = (at(2 * quarter), at(2 * quarter + 1), at(2 * quarter + 2));
        let a = rate(state, first);
        let b = rate(plus(state, a, 0.5 * step), middle);
        let d = rate(plus(state, b, 0.5 * step), middle);
        let e = rate(plus(state, d, step), last);
        for i in 0..2 {
            state[i] += step / 6.0 * (a[i] + 2.0 * b[i] + 2.0 * d[i] + e[i]);
        }
    }
    let channel = |name: &str, quantity, samples| Channel {
        name: name.into(),
        quantity,
        samples,
    };
    Recording {
        path: "oscillator.csv".into(),
        sample_rate_hz: RATE,
        start_s: 0.0,
        since_s: 0.0,
        channels: vec![
            channel(
                "fx",
                Quantity::Force,
                (0..8 * PERIOD).map(|k| at(8 * k)).collect(),
            ),
            channel("x", Quantity::Displacement, moved),
        ],
        sidecar: Sidecar {
            kind: Some(TestKind::Shaker),
            ..Sidecar::default()
        },
    }
}

/// For Gaussian motion the mean of k x + k3 x³ over all amplitudes is that of the stiffness k + 3 k3 σ².
#[test]
fn the_best_linear_approximation_of_a_cubic_spring_has_the_stiffness_of_gaussian_motion() {
    let (m, _, k) = OSCILLATOR;
    let mut random = random(62);
    let realizations: Vec<Vec<(f64, f64)>> = (0..8).map(|_| tones(40..121, &mut random)).collect();
    let amplitude = 2.0;
    let linear = oscillator(&realizations[0], amplitude, [0.0; 2]);
    let settled = &linear.channels[1].samples[6 * PERIOD..7 * PERIOD];
    let variance = settled.iter().map(|x| x * x).sum::<f64>() / settled.len() as f64;
    // 3 k3 σ²/k = 2 %: the frequency rises by 1 %, half of the half-power bandwidth.
    let k3 = 0.02 * k / 3.0 / variance;
    let records: Vec<Recording> = realizations
        .iter()
        .map(|tones| oscillator(tones, amplitude, [0.0, k3]))
        .collect();
    let variance = records
        .iter()
        .flat_map(|record| &record.channels[1].samples[6 * PERIOD..7 * PERIOD])
        .map(|x| x * x)
        .sum::<f64>()
        / (8 * PERIOD) as f64;
    let measurement = measure(&records, &MeasurementSettings::default()).unwrap();
    let entry = &measurement.table.entries()[0];
    let (mut sum, mut weights) = (0.0, 0.0);
    for (h, &hertz) in entry.receptance.iter().zip(measurement.table.frequency_hz()) {
        // The errors of 1/H are those of H over H².
        let weight = h.norm_sqr() * h.norm_sqr();
        sum += weight * (h.inv().re + m * (TAU * hertz).powi(2));
        weights += weight;
    }
    let rise = (sum / weights - k) / (3.0 * k3 * variance);
    println!("rise of the stiffness over 3 k3 σ²: {rise}");
    // The scatter of σ² of 8 realizations of a resonance with some four lines is 1/√(2·4·8) = 12 %, which both sides share in part.
    assert!((rise - 1.0).abs() < 0.12, "{rise}");
    let total = measurement.groups[0].periodic.as_ref().unwrap().distortions[0]
        .total
        .unwrap();
    println!("{total:?}");
    // A change of the stiffness by 2 % that comes with the scatter of x² has about the size of the shift over the bandwidth, 2 %/4 %.
    assert!(
        total.is_significant && (0.05..0.6).contains(&total.ratio),
        "{total:?}"
    );
}

#[test]
fn odd_and_even_distortions_show_at_lines_without_force() {
    let mut random = random(63);
    let lines = || (41..121).step_by(2).filter(|line| line % 3 != 0);
    let tones = tones(lines(), &mut random);
    let (_, _, k) = OSCILLATOR;
    let linear = oscillator(&tones, 3.0, [0.0; 2]);
    let settled = &linear.channels[1].samples[6 * PERIOD..7 * PERIOD];
    let deviation = (settled.iter().map(|x| x * x).sum::<f64>() / settled.len() as f64).sqrt();
    for (name, stiffness) in [
        ("none", [0.0; 2]),
        ("odd", [0.0, 0.01 * k / deviation.powi(2)]),
        ("even", [0.002 * k / deviation, 0.0]),
    ] {
        let record = oscillator(&tones, 3.0, stiffness);
        let measurement = measure(std::slice::from_ref(&record), &MeasurementSettings::default()).unwrap();
        let found = &measurement.groups[0].periodic.as_ref().unwrap().distortions[0];
        let (even, odd) = (found.even.unwrap(), found.odd.unwrap());
        println!("{name}: even {even:?}, odd {odd:?}");
        match name {
            "odd" => assert!(odd.is_significant && odd.ratio > 0.02 && even.ratio < 0.01 * odd.ratio),
            // Products of two resonant lines fall far from the resonance, so that even distortion is small; in second order it is odd.
            "even" => assert!(even.is_significant && even.ratio > 1e-5 && even.ratio > odd.ratio),
            // The transient of the first period that is used.
            _ => assert!(even.ratio < 1e-3 && odd.ratio < 1e-3),
        }
        assert_eq!(
            measurement
                .warnings
                .iter()
                .any(|warning| warning.contains("nonlinear")),
            name != "none",
            "{name}: {:?}",
            measurement.warnings
        );
    }
}

#[test]
fn what_is_no_test_of_whole_periods_is_refused() {
    let mut random = random(64);
    let settings = MeasurementSettings {
        excitation: Some(Excitation::Multisine),
        ..MeasurementSettings::default()
    };
    let said = |records: &[Recording], settings: &MeasurementSettings| {
        measure(records, settings).unwrap_err().to_string()
    };
    let of_force =
        |force: Vec<f64>, random: &mut ChaCha8Rng| record(TestKind::Shaker, along_y(force), 0.0, random);
    let white = force_noise(&mut random, 8 * PERIOD, 10.0);
    let found = said(&[of_force(white.clone(), &mut random)], &settings);
    assert!(
        found.contains("no period") && found.contains("--excitation random"),
        "{found}"
    );

    let first = tones(40..121, &mut random);
    let short = of_force(multisine(&first, 2.0, 3.5), &mut random);
    let stated = MeasurementSettings {
        period_s: Some(4.0),
        ..settings.clone()
    };
    let found = said(&[short], &stated);
    assert!(found.contains("3 whole periods of 2048 samples"), "{found}");

    let good = of_force(multisine(&first, 2.0, 6.0), &mut random);
    let broken = MeasurementSettings {
        period_s: Some(4.0003),
        ..settings.clone()
    };
    let found = said(std::slice::from_ref(&good), &broken);
    assert!(
        found.contains("2048.154 samples") && found.contains("whole number"),
        "{found}"
    );

    // Two forces at once, and recordings that share no phases or all of them.
    let mut forces = along_y(multisine(&first, 2.0, 6.0));
    forces[0] = multisine(&first, 1.0, 6.0);
    let found = said(&[record(TestKind::Shaker, forces, 0.0, &mut random)], &settings);
    assert!(found.contains("periodic excitation needs one"), "{found}");
    let second = of_force(multisine(&tones(40..121, &mut random), 2.0, 6.0), &mut random);
    let later = of_force(multisine(&first, 2.0, 6.3)[300..].to_vec(), &mut random);
    let repeated = measure(&[good.clone(), later.clone()], &settings).unwrap();
    assert_eq!(repeated.groups[0].periodic.as_ref().unwrap().realizations, 1);
    assert!(
        repeated
            .warnings
            .iter()
            .any(|warning| warning.contains("same phases"))
    );
    let found = said(&[good, later, second], &settings);
    assert!(found.contains("2 different sets of phases"), "{found}");
}

#[test]
fn periods_with_clipped_samples_are_left_out() {
    let mut random = random(67);
    let force = multisine(&tones(40..121, &mut random), 2.0, 8.0);
    let mut recording = record(TestKind::Shaker, along_y(force), 1e-3, &mut random);
    let samples = &mut recording.channels[2].samples;
    let most = 1.5 * samples.iter().fold(0.0_f64, |most, y| most.max(y.abs()));
    for sample in [
        5 * PERIOD + 100..5 * PERIOD + 105,
        6 * PERIOD + 7..6 * PERIOD + 11,
    ]
    .into_iter()
    .flatten()
    {
        samples[sample] = most;
    }
    let measurement = measure(std::slice::from_ref(&recording), &MeasurementSettings::default()).unwrap();
    let test = measurement.groups[0].periodic.as_ref().unwrap();
    assert!(
        test.used[0] <= 5 && test.used[0] + test.dropped[0] == 8,
        "{test:?}"
    );
    assert!(
        measurement
            .warnings
            .iter()
            .any(|warning| warning.contains("y is clipped at 9 samples: 2 of 8 periods are left out")),
        "{:?}",
        measurement.warnings
    );
    let error = super::tests::error(&measurement, "yy");
    assert!(error < 1e-3, "{error}");
}

/// The natural frequency of a cubic spring rises with the level as √(1 + 3 k3 σ²/k); that of a linear one does not.
#[test]
fn each_force_level_has_its_peak() {
    let (m, _, k) = OSCILLATOR;
    let mut random = random(68);
    let tones = tones(40..121, &mut random);
    let variance = |record: &Recording| {
        let settled = &record.channels[1].samples[6 * PERIOD..7 * PERIOD];
        settled.iter().map(|x| x * x).sum::<f64>() / PERIOD as f64
    };
    let linear = [1.0, 2.0].map(|amplitude| oscillator(&tones, amplitude, [0.0; 2]));
    let k3 = 0.02 * k / 3.0 / variance(&linear[1]);
    let cubic = [2.0, 1.0].map(|amplitude| oscillator(&tones, amplitude, [0.0, k3]));
    let rises = |records: &[Recording]| {
        let levels = crate::measure_levels(records, &MeasurementSettings::default()).unwrap();
        assert_eq!(levels.len(), 2);
        // 81 tones of the amplitude a have the root mean square a √(81/2).
        assert!(
            (levels[0].force_n / 40.5_f64.sqrt() - 1.0).abs() < 1e-3,
            "{}",
            levels[0].force_n
        );
        let frequency = |level: &crate::LevelMeasurement| {
            let table = &level.measurement.table;
            let peak = crate::fitted_peaks(table, &table.entries()[0])[0];
            (peak.frequency_hz, peak.ninety_percent() * peak.frequency_std_hz)
        };
        let ((low, low_half), (high, high_half)) = (frequency(&levels[0]), frequency(&levels[1]));
        [high / low - 1.0, low_half.hypot(high_half) / low]
    };
    let own = (k / m).sqrt() / TAU;
    assert!((own - 17.4).abs() < 1e-9);
    let [none, half] = rises(&linear);
    println!("linear: {none} ± {half}");
    assert!(none.abs() < 1e-4, "{none}");
    let [rise, half] = rises(&cubic);
    let expected = (1.0 + 3.0 * k3 * variance(&cubic[0]) / k).sqrt()
        / (1.0 + 3.0 * k3 * variance(&cubic[1]) / k).sqrt()
        - 1.0;
    println!("cubic: {rise} ± {half}, expected {expected}");
    // The distortion of one realization is in the interval of its fit.
    assert!(
        rise > half && (rise - expected).abs() < 2.0 * half,
        "{rise} ± {half}, expected {expected}"
    );
}

#[test]
fn an_unlabelled_random_force_stays_random() {
    let mut random = random(65);
    let white = force_noise(&mut random, 64 * PERIOD, 10.0);
    let mut recording = record(TestKind::Shaker, along_y(white), 0.01, &mut random);
    recording.sidecar.kind = None;
    let measurement = measure(&[recording], &MeasurementSettings::default()).unwrap();
    assert_eq!(measurement.groups[0].excitation, Excitation::Random);
}

#[test]
fn lines_agree_with_a_transform_of_one_period() {
    // One period of a noise-free steady response: Y/U by the definition of the transform.
    let mut random = random(66);
    let force = multisine(&tones(40..121, &mut random), 2.0, 20.0);
    let recording = record(TestKind::Shaker, along_y(force), 0.0, &mut random);
    let measurement = measure(std::slice::from_ref(&recording), &MeasurementSettings::default()).unwrap();
    let last = |name: &str| {
        let samples = &recording.channel(name).unwrap().samples;
        samples[samples.len() - PERIOD..].to_vec()
    };
    let line = |samples: &[f64], line: usize| -> Complex64 {
        let turn = |k: usize| Complex64::from_polar(1.0, -TAU * (line * k % PERIOD) as f64 / PERIOD as f64);
        samples.iter().enumerate().map(|(k, x)| turn(k) * x).sum()
    };
    let entry = &measurement.table.entries()[of_y(&measurement)];
    for at in [0, 29, 31, 60] {
        let expected = line(&last("y"), 40 + at) / line(&last("fy"), 40 + at);
        // The transient of the first period that is used is at most 2e-3 of the response, averaged over eighteen periods.
        assert!((entry.receptance[at] / expected - 1.0).norm() < 2e-4, "{at}");
    }
}
