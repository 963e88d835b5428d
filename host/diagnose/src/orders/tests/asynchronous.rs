//! Spectrum of the residual and its lines.

use std::f64::consts::TAU;

use super::generator::{NAMES, Random, Spindle, noise, pulses, recording, series_at};
use crate::orders::reduction::{Orders, ReductionSettings};
use crate::orders::spindle_angle::SpindleAngle;

const RATE_HZ: f64 = 10_000.0;

/// A cut of `count` samples with hum of the given amplitude at 50 Hz, in white or coloured noise.
fn cut(seed: u64, count: usize, hum: f64, white: bool) -> Orders {
    let mut random = Random::new(seed);
    let spindle = Spindle {
        hertz: 80.0 + 40.0 * random.share(),
        start_s: 0.001,
        wander: [0.001, 0.9, random.share()],
    };
    let mut channels = if white {
        (0..2)
            .map(|_| (0..count).map(|_| 0.1 * random.normal()).collect())
            .collect()
    } else {
        noise(&mut random, 2, count, 0.05)
    };
    // All orders of the signal are removed: P is at least 4·5000/120 = 166.
    let c = pulses(2, 0.1, 160);
    for samples in &mut channels {
        for (sample, value) in samples.iter_mut().enumerate() {
            let t = sample as f64 / RATE_HZ;
            *value += series_at(&c, spindle.revolutions(t) + 1.0) + hum * (TAU * 50.0 * t).sin();
        }
    }
    let angle = SpindleAngle::from_edges(spindle.edges_s((count - 1) as f64 / RATE_HZ), RATE_HZ);
    let settings = ReductionSettings {
        highest_hz: 1e9,
        alias_factor: 4.0,
        slowest_decay_s: 0.1,
        settled_s: 0.0,
    };
    Orders::with_angle(&recording(RATE_HZ, channels, 0.0), &NAMES[..2], angle, &settings).unwrap()
}

#[test]
fn hum_is_a_line_with_its_frequency_and_amplitude() {
    for seed in 0..20 {
        let orders = cut(seed, 22_000, 0.05, false);
        for channel in 0..2 {
            let line = orders.lines.iter().find(|line| line.channel == channel).unwrap();
            // The distance of two bins is 0.45 Hz.
            assert!((line.frequency_hz - 50.0).abs() < 0.2, "{seed}: {line:?}");
            // The noise of the coloured processes near 50 Hz adds a tenth of the amplitude to the peak.
            assert!((line.amplitude / 0.05 - 1.0).abs() < 0.3, "{seed}: {line:?}");
            assert!(line.probability < 1e-6, "{seed}: {line:?}");
        }
    }
}

#[test]
fn noise_shows_lines_as_rarely_as_stated() {
    let records = 300;
    let found: usize = (0..records)
        .map(|seed| cut(100 + seed, 6000, 0.0, true).lines.len())
        .sum();
    println!("{found} lines in {} channels of white noise", 2 * records);
    // The error rate of 1 % gives 6 of 600 channels; 15 is more than three standard deviations √6 above.
    assert!(found <= 15, "{found}");
}

#[test]
fn the_spectrum_is_the_density_of_the_noise() {
    let orders = cut(9, 60_000, 0.0, true);
    let spectrum = &orders.spectrum;
    // White noise of variance 0.01 has the one-sided density 0.01/(RATE/2). The mean over 500 to 4500 Hz; the removed
    // orders and their aliases, about five of 600 cells per order, lie within 1 %, and 24 000 bins scatter by as much.
    let points = spectrum.density[0].iter().enumerate().filter(|(point, _)| {
        let hertz = spectrum.first_hz + spectrum.step_hz * *point as f64;
        (500.0..4500.0).contains(&hertz)
    });
    let (sum, count) = points.fold((0.0, 0), |(sum, count), (_, density)| (sum + density, count + 1));
    let ratio = sum / f64::from(count) / (0.01 / (0.5 * RATE_HZ));
    assert!((ratio - 1.0).abs() < 0.03, "{ratio}");
}
