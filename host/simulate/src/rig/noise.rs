//! Sensor noise: white and normally distributed, independent for each sample.

use std::collections::BTreeMap;

use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

use quietcut_recording::{Quantity, Recording};

/// Standard deviation of the white noise of each channel.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Noise {
    /// Standard deviation divided by the channel's root mean square, for channels not listed in `absolute`. Those of
    /// them with a tachometer level get no noise.
    pub relative: f64,
    /// Standard deviation by channel name, in the SI unit of the channel.
    pub absolute: BTreeMap<String, f64>,
}

impl Noise {
    /// Adds noise to every channel whose standard deviation is above 0. The same seed gives the same noise; the noise
    /// of each channel is independent.
    pub fn add(&self, recording: &mut Recording, seed: u64) {
        for (index, channel) in recording.channels.iter_mut().enumerate() {
            let deviation = self.absolute.get(&channel.name).copied().unwrap_or_else(|| {
                if channel.quantity == Quantity::Level {
                    return 0.0;
                }
                let sum: f64 = channel.samples.iter().map(|x| x * x).sum();
                self.relative * (sum / channel.samples.len().max(1) as f64).sqrt()
            });
            if deviation > 0.0 {
                let mut random = ChaCha8Rng::seed_from_u64(seed);
                random.set_stream(index as u64);
                for sample in &mut channel.samples {
                    let normal: f64 = StandardNormal.sample(&mut random);
                    *sample += deviation * normal;
                }
            }
        }
    }
}
