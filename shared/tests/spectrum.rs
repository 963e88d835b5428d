//! Power spectra and peaks compared with closed forms.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)] // a test may fail

use std::f64::consts::TAU;

use quietcut_core::peaks::{Rotation, Search};
use quietcut_core::spectrum::{self, Overlap, PowerSpectrum, STRUCTURE_POINTS, TOOL_POINTS};
use quietcut_core::units::Hertz;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::StandardNormal;

/// Acceleration of one unit of a sample: 0.488 mg divided by 2¹².
const UNIT: f64 = 0.488e-3 * 9.80665 / 4096.0;
const TOOL_RATE: f64 = 13_333.5;
const STRUCTURE_RATE: f64 = 1666.6875;

/// A block of samples from the signal x[n] of each axis in m/s².
fn block<const N: usize>(signal: impl Fn(usize) -> [f64; 3]) -> Overlap<N> {
    let mut overlap = Overlap::new();
    for n in 0..N {
        overlap.push(signal(n).map(|a| (a / UNIT).round() as i32), N);
    }
    overlap
}

fn tool<T>(block: &Overlap<TOOL_POINTS>, axes: &[usize], then: impl Fn(PowerSpectrum<'_>) -> T) -> T {
    let (mut work, mut power) = ([0; TOOL_POINTS], [0.0; spectrum::TOOL_BINS]);
    then(spectrum::tool_spectrum(
        block,
        axes,
        Hertz(TOOL_RATE as f32),
        UNIT as f32,
        &mut work,
        &mut power,
    ))
}

fn structure<T>(
    block: &Overlap<STRUCTURE_POINTS>,
    axes: &[usize],
    then: impl Fn(PowerSpectrum<'_>) -> T,
) -> T {
    let (mut work, mut power) = ([0.0; STRUCTURE_POINTS], [0.0; spectrum::STRUCTURE_BINS]);
    let rate = Hertz(STRUCTURE_RATE as f32);
    then(spectrum::structure_spectrum(
        block,
        axes,
        rate,
        UNIT as f32,
        &mut work,
        &mut power,
    ))
}

/// One-sided power by its definition in double precision: window in time, then the sum.
fn direct_power(samples: &[f64], k: usize) -> f64 {
    let points = samples.len() as f64;
    let mean = samples.iter().sum::<f64>() / points;
    let (mut re, mut im) = (0.0, 0.0);
    for (n, x) in samples.iter().enumerate() {
        let angle = TAU * n as f64 / points;
        let windowed = (x - mean) * (0.5 - 0.5 * angle.cos());
        re += windowed * (angle * k as f64).cos();
        im -= windowed * (angle * k as f64).sin();
    }
    let sides = if k == 0 || 2 * k == samples.len() {
        1.0
    } else {
        2.0
    };
    sides * (re * re + im * im) / (0.5 * points).powi(2)
}

/// Every bin of both spectra equals the definition, for signals on three axes and gravity.
#[test]
fn spectra_equal_their_definition() {
    let seed = 3;
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let samples: Vec<[f64; 3]> = (0..STRUCTURE_POINTS)
        .map(|n| {
            let x = 40.0 * (0.01 * n as f64).sin() + rng.sample::<f64, _>(StandardNormal);
            [x, 9.81 + 0.2 * x, -3.0 * rng.sample::<f64, _>(StandardNormal)]
        })
        .collect();
    let check = |name: &str, points: usize, power: &[f32]| {
        assert_eq!(power.len(), points / 2 + 1);
        for (k, &found) in power
            .iter()
            .enumerate()
            .step_by(7)
            .chain([(points / 2, &power[points / 2])])
        {
            let expected: f64 = (0..3)
                .map(|axis| direct_power(&samples[..points].iter().map(|s| s[axis]).collect::<Vec<_>>(), k))
                .sum();
            // The tolerance is single precision, and the rounding of samples to units of 1e-6 m/s².
            assert!(
                (f64::from(found) - expected).abs() <= 2e-5 * expected + 1e-9,
                "{name}, bin {k}: {found} for {expected} (seed {seed})"
            );
        }
    };
    tool(&block(|n| samples[n]), &[0, 1, 2], |s| {
        check("tool", TOOL_POINTS, s.power)
    });
    structure(&block(|n| samples[n]), &[0, 1, 2], |s| {
        check("structure", STRUCTURE_POINTS, s.power)
    });
}

#[test]
fn power_is_mean_square_of_a_tone_and_density_of_noise() {
    let amplitude = 2.5;
    let tone = |bin: f64, points: usize| {
        move |n: usize| [amplitude * (TAU * bin * n as f64 / points as f64).cos(), 0.0, 0.0]
    };
    let at_bin = |s: PowerSpectrum<'_>| f64::from(s.power[100]);
    let expected = amplitude * amplitude / 2.0;
    for found in [
        tool(&block(tone(100.0, TOOL_POINTS)), &[0], at_bin),
        structure(&block(tone(100.0, STRUCTURE_POINTS)), &[0], at_bin),
    ] {
        assert!((found / expected - 1.0).abs() < 1e-5, "{found} for {expected}");
    }
    let seed = 11;
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let sigma = 0.3;
    let (mut sum, mut count) = (0.0, 0);
    for _ in 0..40 {
        let samples: Vec<f64> = (0..TOOL_POINTS)
            .map(|_| sigma * rng.sample::<f64, _>(StandardNormal))
            .collect();
        tool(&block(|n| [samples[n], 0.0, 0.0]), &[0], |s| s.power.to_vec())
            .iter()
            .skip(2)
            .for_each(|p| {
                sum += f64::from(*p);
                count += 1;
            });
    }
    let density = sigma * sigma / (TOOL_RATE / 2.0);
    let per_bin = density * f64::from(spectrum::HANN_NOISE_BINS) * TOOL_RATE / TOOL_POINTS as f64;
    let found = sum / f64::from(count);
    // The standard error over 20 000 bins, two thirds of them independent, is 0.9 %.
    assert!(
        (found / per_bin - 1.0).abs() < 0.03,
        "{found} for {per_bin} (seed {seed})"
    );
}

#[test]
fn blocks_come_due_with_the_hop() {
    let mut overlap = Overlap::<TOOL_POINTS>::new();
    let mut due = Vec::new();
    for n in 1..=4000i32 {
        if overlap.push([n, 0, 0], 300) {
            due.push(n);
        }
    }
    assert_eq!(due, (1024..=4000).step_by(300).collect::<Vec<_>>());
    overlap.reset();
    assert!((0..1023).all(|_| !overlap.push([0; 3], 300)));
    assert!(overlap.push([0; 3], 300));
}

/// A tone in noise, with two equally strong tones four to nine bins away.
///
/// A tone with 20 dB more power than all the noise of its block is 42 dB above the noise of its bin. Its frequency is found to a
/// hundredth of a bin. A tone that is only 20 dB above the noise of its bin (2 dB *less* power than the noise) has a frequency
/// error of 0.065 bin rms from the noise alone, so that 0.1 bin is 1.5 standard deviations. From 30 dB on it is five standard
/// deviations.
#[test]
fn frequency_is_right_to_a_tenth_of_a_bin() {
    let seed = 23;
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    for (snr_db, share, rms_bound) in [(20.0f64, 0.8, 0.08), (30.0, 1.0, 0.025), (42.0, 1.0, 0.01)] {
        let trials = 300;
        let (mut within, mut squares, mut worst) = (0, 0.0, 0f64);
        for _ in 0..trials {
            let bin = rng.random_range(30.0..480.0f64);
            let tones = [
                bin,
                bin - rng.random_range(4.0..9.0),
                bin + rng.random_range(4.0..9.0),
            ]
            .map(|bin| (bin, rng.random_range(0.0..TAU)));
            // The noise floor per bin is 3σ²/N, the power of a tone in the middle of a bin A²/2.
            let sigma = (TOOL_POINTS as f64 / 6.0 / 10f64.powf(snr_db / 10.0)).sqrt();
            let noise: Vec<f64> = (0..TOOL_POINTS)
                .map(|_| sigma * rng.sample::<f64, _>(StandardNormal))
                .collect();
            let samples = block(|n| {
                let t = TAU * n as f64 / TOOL_POINTS as f64;
                [
                    noise[n]
                        + tones
                            .iter()
                            .map(|(bin, phase)| (bin * t + phase).cos())
                            .sum::<f64>(),
                    0.0,
                    0.0,
                ]
            });
            let found = tool(&samples, &[0], |s| {
                let near = |bins: f64| Hertz(((bin + bins) * f64::from(s.bin.0)) as f32);
                let peak = s.dominant(near(-1.0), near(1.0)).expect("a peak");
                f64::from(peak.frequency.0 / s.bin.0)
            });
            let error = (found - bin).abs();
            within += u32::from(error <= 0.1);
            squares += error * error;
            worst = worst.max(error);
        }
        let rms = (squares / f64::from(trials)).sqrt();
        println!(
            "SNR {snr_db} dB: {within} of {trials} within 0.1 bin, rms {rms:.4}, worst {worst:.4} (seed {seed})"
        );
        assert!(rms <= rms_bound, "SNR {snr_db} dB, seed {seed}");
        assert!(
            f64::from(within) >= share * f64::from(trials),
            "SNR {snr_db} dB, seed {seed}"
        );
    }
}

/// The error from strong neighbours without noise: five times stronger tones four bins away give at most a tenth of a bin.
#[test]
fn strong_neighbours_move_a_peak_little() {
    let mut worst = 0f64;
    for step in 0..100 {
        let bin = 100.0 + 0.01 * f64::from(step);
        for (below, above) in [(0.0, 0.7), (0.3, 0.1), (0.6, 0.9)] {
            let samples = block(|n| {
                let t = TAU * n as f64 / TOOL_POINTS as f64;
                let tone = |bin: f64, turns: f64| (bin * t + TAU * turns).cos();
                [
                    tone(bin, 0.2) + 5.0 * tone(bin - 4.0, below) + 5.0 * tone(bin + 4.0, above),
                    0.0,
                    0.0,
                ]
            });
            let found = tool(&samples, &[0], |s| {
                let near = |bins: f64| Hertz(((bin + bins) * f64::from(s.bin.0)) as f32);
                f64::from(s.dominant(near(-0.6), near(0.6)).expect("a peak").frequency.0 / s.bin.0)
            });
            worst = worst.max((found - bin).abs());
        }
    }
    println!("worst {worst:.4} bins");
    assert!(worst <= 0.1, "{worst} bins");
}

/// In pure noise, and in harmonics of the spindle with all their side lobes, no tone is found.
#[test]
fn no_tone_is_found_in_noise_or_in_harmonics() {
    let seed = 41;
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let (from, to) = (Hertz(50.0), Hertz(5_000.0));
    for trial in 0..200 {
        let noise: Vec<[f64; 3]> = (0..TOOL_POINTS)
            .map(|_| [0; 3].map(|_| rng.sample::<f64, _>(StandardNormal)))
            .collect();
        let spindle = rng.random_range(150.0..700.0);
        let rotation = Rotation {
            frequency: Hertz(spindle as f32),
            uncertainty: Hertz(0.0),
        };
        let phases: Vec<f64> = (0..50).map(|_| rng.random_range(0.0..TAU)).collect();
        let harmonics = |n: usize| -> f64 {
            let angle = TAU * spindle * n as f64 / TOOL_RATE;
            let orders = (1..).take_while(|&order| f64::from(order) * spindle < TOOL_RATE / 2.0);
            orders
                .map(|order| {
                    30.0 * (f64::from(order) * angle + phases[order as usize]).cos() / f64::from(order)
                })
                .sum()
        };
        let quiet = tool(&block(|n| noise[n]), &[0, 1, 2], |s| s.dominant(from, to));
        assert_eq!(quiet, None, "noise, trial {trial}, seed {seed}");
        for loudness in [1e-4, 1.0] {
            let samples = block(|n| noise[n].map(|x| loudness * x + harmonics(n)));
            let found = tool(&samples, &[0, 1, 2], |s| {
                s.dominant_non_harmonic(rotation, from, to)
            });
            assert_eq!(
                found,
                Search::Nothing { resolved_to: to },
                "{spindle} Hz, trial {trial}, seed {seed}"
            );
        }
    }
}

/// Tones and gravity do not raise the noise floor. The mean square near a tone is that of the tone, at any position between the
/// bins.
#[test]
fn the_floor_is_that_of_the_noise_and_the_power_near_a_tone_is_that_of_the_tone() {
    let seed = 43;
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let noise: Vec<f64> = (0..TOOL_POINTS)
        .map(|_| 0.1 * rng.sample::<f64, _>(StandardNormal))
        .collect();
    let floor_of = |tones: bool| {
        let samples = block(|n| {
            let t = TAU * n as f64 / TOOL_POINTS as f64;
            let comb: f64 = (1..25).map(|i| (20.3 * f64::from(i) * t).sin()).sum();
            [9.81 + noise[n] + if tones { comb } else { 0.0 }, 0.0, 0.0]
        });
        tool(&samples, &[0], |s| s.noise_floor(203))
    };
    let (with, without) = (floor_of(true), floor_of(false));
    // Halfway between two peaks of this comb, the side lobes are 58 dB below the peaks, far below the noise.
    assert!(
        with < 2.0 * without && without < 2.0 * with,
        "{with} with tones, {without} without (seed {seed})"
    );
    // The median of an exponential distribution is ln 2 times its mean, which is 3σ²/N here.
    let expected = 2f32.ln() * 3.0 * 1e-2 / TOOL_POINTS as f32;
    assert!(
        (without / expected - 1.0).abs() < 0.25,
        "{without} for {expected} (seed {seed})"
    );

    for step in 0..20 {
        let bin = 300.0 + 0.05 * f64::from(step);
        let samples = block(|n| [2.0 * (TAU * bin * n as f64 / TOOL_POINTS as f64).sin(), 0.0, 0.0]);
        let found = tool(&samples, &[0], |s| {
            s.mean_square_near(Hertz(bin as f32 * s.bin.0))
        });
        // Five bins contain at least 99.5 % of the main lobe.
        assert!((found / 2.0 - 1.0).abs() < 0.005, "bin {bin}: {found}");
    }
}

/// Spindle harmonics and a weaker tone between two of them, in the structure band.
#[test]
fn chatter_is_distinguished_from_harmonics() {
    let seed = 31;
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    for trial in 0..60 {
        let spindle = rng.random_range(12.0..40.0f64);
        let order = rng.random_range(1..8u32);
        // The tone is more than two bins plus the tolerance away from both harmonics.
        let off = rng.random_range(0.25..0.75);
        let chatter = (f64::from(order) + off) * spindle;
        let chatter_amplitude = rng.random_range(0.05..3.0);
        let phases: Vec<f64> = (0..40).map(|_| rng.random_range(0.0..TAU)).collect();
        let noise: Vec<f64> = (0..STRUCTURE_POINTS)
            .map(|_| 0.02 * rng.sample::<f64, _>(StandardNormal))
            .collect();
        let signal = |with_chatter: bool| {
            block(|n| {
                let t = n as f64 / STRUCTURE_RATE;
                let harmonics: f64 = (1..40)
                    .filter(|&h| f64::from(h) * spindle < 400.0)
                    .map(|h| {
                        (TAU * f64::from(h) * spindle * t + phases[h as usize]).cos() * 5.0 / f64::from(h)
                    })
                    .sum();
                let chatter = if with_chatter {
                    chatter_amplitude * (TAU * chatter * t).sin()
                } else {
                    0.0
                };
                [0.6 * harmonics + noise[n], chatter, 0.8 * harmonics]
            })
        };
        let rotation = Rotation {
            frequency: Hertz((spindle * 1.0003) as f32),
            uncertainty: Hertz((spindle * 0.001) as f32),
        };
        let search = |with| {
            structure(&signal(with), &[0, 1, 2], |s| {
                s.dominant_non_harmonic(rotation, Hertz(5.0), Hertz(400.0))
            })
        };
        let context = format!("trial {trial}: spindle {spindle} Hz, chatter {chatter} Hz, seed {seed}");
        match search(true) {
            Search::Found(found) => {
                let error_bins =
                    (f64::from(found.peak.frequency.0) - chatter) * STRUCTURE_POINTS as f64 / STRUCTURE_RATE;
                assert!(error_bins.abs() <= 0.1, "{context}: {error_bins} bins");
                let amplitude = f64::from(found.peak.amplitude.0);
                assert!(
                    (amplitude / chatter_amplitude - 1.0).abs() < 0.1,
                    "{context}: {amplitude} for {chatter_amplitude}"
                );
                let orders = f64::from(found.nearest_order) + f64::from(found.orders_off);
                assert!(
                    (orders - chatter / spindle).abs() < 0.01,
                    "{context}: order {orders}"
                );
            }
            other => panic!("{context}: {other:?}"),
        }
        let without = search(false);
        assert!(
            matches!(without, Search::Nothing { .. }),
            "{context}, none there: {without:?}"
        );
    }
}

#[test]
fn harmonics_closer_than_the_resolution_are_not_searched() {
    let noise = block(|n| [(n * n % 17) as f64, 0.0, 0.0]);
    let rotation = |frequency, uncertainty| Rotation {
        frequency: Hertz(frequency),
        uncertainty: Hertz(uncertainty),
    };
    let search = |rotation| {
        tool(&noise, &[0], |s| {
            s.dominant_non_harmonic(rotation, Hertz(100.0), Hertz(5000.0))
        })
    };
    // The bins are 13 Hz wide. Harmonics of 20 Hz fill all of them, as do harmonics of a spindle speed that is known to 40 %
    // only.
    for rotation in [
        rotation(20.0, 0.0),
        rotation(200.0, 80.0),
        rotation(0.0, 0.0),
        rotation(f32::NAN, 0.0),
    ] {
        assert_eq!(search(rotation), Search::Unresolved, "{rotation:?}");
    }
}
