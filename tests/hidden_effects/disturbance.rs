//! What a workshop adds to a cut and its records: teeth that cut with another force in every passing, a spindle speed that wanders, noise
//! whose density falls with frequency, mains hum, and steps of the converter.

use std::f64::consts::TAU;

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

use super::machine::between;

/// Number of tooth passings after which their forces repeat: more than a record has.
const PASSINGS: usize = 1024;

/// Disturbances of one cut.
#[derive(Clone, Debug)]
pub(crate) struct Disturbance {
    /// Force of each tooth passing over its mean.
    factors: Vec<f64>,
    /// Parts of the wandering speed: relative amplitude, frequency over that of the spindle, phase.
    wander: Vec<[f64; 3]>,
    /// Standard deviation of the noise between the samples, over that of all noise.
    white: f64,
    /// Frequency of the mains, Hz.
    mains_hz: f64,
    /// Amplitude of the hum over the standard deviation of the noise.
    hum: f64,
    bits: i32,
    /// Standard deviation of the tachometer, in samples.
    jitter: f64,
}

impl Disturbance {
    pub(crate) fn draw(random: &mut ChaCha8Rng) -> Self {
        let scatter = between(random, 0.02, 0.05);
        let wander = between(random, 5e-4, 5e-3);
        let factors = (0..PASSINGS)
            .map(|_| {
                let deviate: f64 = StandardNormal.sample(random);
                1.0 + scatter * deviate
            })
            .collect();
        let parts = 4;
        Self {
            factors,
            wander: (0..parts)
                .map(|_| {
                    [
                        wander / f64::from(parts),
                        between(random, 0.02, 0.2),
                        random.random_range(0.0..TAU),
                    ]
                })
                .collect(),
            white: random.random_range(0.5..0.9),
            mains_hz: if random.random() { 50.0 } else { 60.0 },
            hum: random.random_range(0.0..1.0),
            bits: random.random_range(12..=16),
            jitter: random.random_range(0.02..0.2),
        }
    }

    /// Force over its mean while a tooth is at `angle`, rad from the start of its first passing.
    pub(crate) fn factor(&self, tooth: usize, teeth: usize, angle: f64) -> f64 {
        let turn = (angle / TAU).floor() as i64;
        let passing = turn * teeth as i64 + tooth as i64;
        self.factors[passing.rem_euclid(PASSINGS as i64) as usize]
    }

    /// What the wandering speed adds to the spindle angle at a time from the start of the record, rad.
    pub(crate) fn wandered(&self, t: f64, omega: f64) -> f64 {
        self.wander
            .iter()
            .map(|[share, ratio, phase]| {
                let rate = ratio * omega;
                share / ratio * (phase.cos() - (rate * t + phase).cos())
            })
            .sum()
    }

    /// Standard deviation of the spindle angle in samples.
    pub(crate) fn jitter(&self) -> f64 {
        self.jitter
    }

    /// The samples of a sensor with noise of the standard deviation `sigma`, as a converter of a recorder gives them.
    pub(crate) fn recorded(&self, samples: &[f64], sigma: f64, rate_hz: f64, seed: u64) -> Vec<f64> {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        let mut normal = || -> f64 { StandardNormal.sample(&mut random) };
        // A sum of first-order processes an octave apart has a density that falls as 1/f between them.
        let octaves = 10;
        let keep: Vec<f64> = (0..octaves).map(|octave| (-0.5_f64.powi(octave)).exp()).collect();
        let mut slow: Vec<f64> = keep.iter().map(|_| normal()).collect();
        let phase = TAU * normal();
        let slow_share = ((1.0 - self.white * self.white) / f64::from(octaves)).sqrt();
        let largest = samples.iter().fold(0.0_f64, |most, value| most.max(value.abs()));
        let step = 1.5 * 2.0 * largest / 2.0_f64.powi(self.bits);
        samples
            .iter()
            .enumerate()
            .map(|(index, value)| {
                for (slow, keep) in slow.iter_mut().zip(&keep) {
                    *slow = keep * *slow + (1.0 - keep * keep).sqrt() * normal();
                }
                let hum = self.hum * (TAU * self.mains_hz * index as f64 / rate_hz + phase).sin();
                let noise = self.white * normal() + slow_share * slow.iter().sum::<f64>() + hum;
                ((value + sigma * noise) / step).round() * step
            })
            .collect()
    }
}
