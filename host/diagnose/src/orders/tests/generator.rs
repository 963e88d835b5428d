//! Cuts with known orders: a periodic signal of the spindle angle, coloured noise common to the channels, and a spindle
//! whose speed wanders.

use std::f64::consts::{PI, TAU};

use num_complex::Complex64;
use quietcut_recording::{Channel, Quantity, RecordedCut, Recording, Sidecar};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

/// Names of the channels of a cut.
pub(super) const NAMES: [&str; 7] = ["fx", "fy", "fz", "ax", "ay", "az", "x"];

/// Standard normal numbers.
pub(super) struct Random(ChaCha8Rng);

impl Random {
    pub(super) fn new(seed: u64) -> Self {
        Self(ChaCha8Rng::seed_from_u64(seed))
    }

    pub(super) fn normal(&mut self) -> f64 {
        StandardNormal.sample(&mut self.0)
    }

    pub(super) fn share(&mut self) -> f64 {
        self.0.random::<f64>()
    }
}

/// A spindle: revolutions r(t) = f (t − t₀ + Σ δ/ω sin(ωt + ψ)), t in s.
#[derive(Clone)]
pub(super) struct Spindle {
    pub hertz: f64,
    pub start_s: f64,
    /// Relative amplitude δ, frequency in Hz and phase ψ.
    pub wander: [f64; 3],
}

impl Spindle {
    pub(super) fn revolutions(&self, t: f64) -> f64 {
        let [delta, hertz, phase] = self.wander;
        let omega = TAU * hertz;
        let lead = |t: f64| {
            if delta == 0.0 {
                0.0
            } else {
                delta / omega * (omega * t + phase).sin()
            }
        };
        self.hertz * (t - self.start_s + lead(t) - lead(self.start_s))
    }

    /// Times at which revolutions 0, 1 … begin, up to `end_s`.
    pub(super) fn edges_s(&self, end_s: f64) -> Vec<f64> {
        (0..)
            .map(|revolution| {
                let mut t = self.start_s + f64::from(revolution) / self.hertz;
                for _ in 0..50 {
                    t -= (self.revolutions(t) - f64::from(revolution)) / self.hertz;
                }
                t
            })
            .take_while(|t| *t <= end_s)
            .collect()
    }
}

/// Fourier coefficients k = 0 … `highest` of `teeth` pulses per revolution, each a sine from 0 to π/2 that jumps to zero
/// at its end; the pulse of each tooth is larger than that of the one before by `unequal`.
pub(super) fn pulses(teeth: usize, unequal: f64, highest: usize) -> Vec<Complex64> {
    (0..=highest)
        .map(|order| {
            // ∫ sin φ e^{−ikφ} dφ/2π from 0 to π/2, as two exponentials.
            let integral = |rate: f64| {
                if rate == 0.0 {
                    Complex64::from(PI / 2.0)
                } else {
                    (Complex64::from_polar(1.0, rate * PI / 2.0) - 1.0) / Complex64::new(0.0, rate)
                }
            };
            let k = order as f64;
            let pulse = (integral(1.0 - k) - integral(-1.0 - k)) / Complex64::new(0.0, 2.0) / TAU;
            (0..teeth)
                .map(|tooth| {
                    let angle = TAU * tooth as f64 / teeth as f64;
                    pulse * Complex64::from_polar(1.0 + unequal * tooth as f64, -k * angle)
                })
                .sum()
        })
        .collect()
}

/// Value at `revolutions` of the signal of [`pulses`] with all its orders.
pub(super) fn pulses_at(teeth: usize, unequal: f64, revolutions: f64) -> f64 {
    (0..teeth)
        .map(|tooth| {
            let phi = TAU * (revolutions - tooth as f64 / teeth as f64).rem_euclid(1.0);
            let size = 1.0 + unequal * tooth as f64;
            if phi < PI / 2.0 { size * phi.sin() } else { 0.0 }
        })
        .sum()
}

/// c_0 + 2 Re Σ c_k e^{ikθ}, summed term by term.
pub(super) fn series_at(c: &[Complex64], revolutions: f64) -> f64 {
    let step = Complex64::from_polar(1.0, TAU * revolutions.fract());
    let mut power = Complex64::ONE;
    let mut sum = c[0].re;
    for (index, c) in c.iter().enumerate().skip(1) {
        // Rounding of the powers grows with their number.
        power = if index % 16 == 0 {
            Complex64::from_polar(1.0, TAU * (revolutions.fract() * index as f64))
        } else {
            power * step
        };
        sum += 2.0 * (c * power).re;
    }
    sum
}

/// Noise of `channels` channels: three autoregressive processes of order two, each in all channels, and white noise of
/// each channel, all multiplied by `level`.
pub(super) fn noise(random: &mut Random, channels: usize, count: usize, level: f64) -> Vec<Vec<f64>> {
    // Poles at radius and angle: damped modes within the orders, broad against the spindle frequency.
    let poles = [(0.75, 0.25), (0.8, 0.9), (0.7, 1.9)];
    let mut of = vec![vec![0.0; count]; channels];
    for (source, (radius, angle)) in poles.into_iter().enumerate() {
        let mix: Vec<f64> = (0..channels)
            .map(|channel| ((1 + source) as f64 * (channel + 1) as f64).sin())
            .collect();
        let (mut last, mut before) = (0.0, 0.0);
        // The first samples let the process settle: 0.8^100 = 2e-10.
        for sample in 0..count + 100 {
            let value: f64 =
                random.normal() + 2.0 * radius * f64::cos(angle) * last - radius * radius * before;
            (before, last) = (last, value);
            if let Some(sample) = sample.checked_sub(100) {
                for (samples, mix) in of.iter_mut().zip(&mix) {
                    samples[sample] += level * mix * value;
                }
            }
        }
    }
    for samples in &mut of {
        for value in samples.iter_mut() {
            *value += level * 0.5 * random.normal();
        }
    }
    of
}

/// A recording of the channels, the first of [`NAMES`].
pub(super) fn recording(rate_hz: f64, channels: Vec<Vec<f64>>, rpm: f64) -> Recording {
    let cut = RecordedCut {
        spindle_rpm: Some(rpm),
        ..RecordedCut::default()
    };
    Recording {
        path: "cut.csv".into(),
        sample_rate_hz: rate_hz,
        start_s: 0.0,
        since_s: 0.0,
        channels: channels
            .into_iter()
            .zip(NAMES)
            .map(|(samples, name)| Channel {
                name: name.into(),
                quantity: Quantity::Force,
                samples,
            })
            .collect(),
        sidecar: Sidecar {
            cut: Some(cut),
            ..Sidecar::default()
        },
    }
}
