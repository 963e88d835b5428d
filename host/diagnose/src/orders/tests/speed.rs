//! Speed from the orders alone.

use quietcut_testkit::slice;
use std::f64::consts::TAU;

use rayon::prelude::*;

use super::generator::{NAMES, Random, noise, pulses, recording, series_at};
use crate::orders::reduction::ReductionSettings;
use crate::orders::speed_from_orders::angle_from_orders;

const RATE_HZ: f64 = 10_000.0;
const RECORDS: u64 = 200;

fn settings() -> ReductionSettings {
    ReductionSettings {
        highest_hz: 1e9,
        alias_factor: 3.0,
        slowest_decay_s: 1e9,
        settled_s: 0.0,
    }
}

#[test]
fn speeds_without_tachometer_lie_within_their_deviation() {
    let sets = [(0, 25.0, 0.1), (1000, 100.0, 0.2), (2000, 300.0, 0.5)];
    for (first, revolutions, level) in sets.into_iter().take(slice(1, 3) as usize) {
        let ratios: Vec<f64> = (0..RECORDS)
            .into_par_iter()
            .map(|record| {
                let mut random = Random::new(first + record);
                let hertz = 200.0 + 60.0 * random.share();
                let count = (revolutions * RATE_HZ / hertz) as usize;
                let c = pulses(2, 0.15, if first == 1 { 15 } else { 55 });
                let phase = TAU * random.share();
                let mut channels = noise(&mut random, 3, count, level);
                for (channel, samples) in channels.iter_mut().enumerate() {
                    for (sample, value) in samples.iter_mut().enumerate() {
                        let at = hertz * sample as f64 / RATE_HZ + phase;
                        *value += (1.0 + channel as f64) * series_at(&c, at);
                    }
                }
                let stated = 60.0 * hertz * (1.0 + 0.025 * (2.0 * random.share() - 1.0));
                let record = recording(RATE_HZ, channels, stated);
                let angle = angle_from_orders(&record, &NAMES[..3], &settings()).unwrap();
                (angle.frequency_hz - hertz) / angle.frequency_deviation_hz
            })
            .collect();
        let within = ratios.iter().filter(|ratio| ratio.abs() < 1.645).count() as f64 / RECORDS as f64;
        let square = ratios.iter().map(|ratio| ratio * ratio).sum::<f64>() / RECORDS as f64;
        println!(
            "seeds from {first}, {revolutions} revolutions: within 90 % {within:.3}, mean square {square:.2}"
        );
        // ±0.07 is 3.3 standard deviations √(0.09/200). Above, the deviation in ambiguous records (one in ten) is cautious;
        // below, the spectrum of 25 revolutions has 18 values between lines.
        assert!((0.82..=0.97).contains(&within), "{first}: {within}");
    }
}

#[test]
fn noise_alone_gives_no_speed() {
    let channels = noise(&mut Random::new(7), 3, 4000, 0.1);
    let error =
        angle_from_orders(&recording(RATE_HZ, channels, 12_000.0), &NAMES[..3], &settings()).unwrap_err();
    assert!(error.to_string().contains("show no orders"), "{error}");
}
