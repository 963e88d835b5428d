//! Derivatives, integrals and filters of whole records by the discrete Fourier transform.
//!
//! A record is not periodic. For a band from 0 Hz, and for a weighted spectrum, the straight line through its ends is
//! subtracted, and the remaining signal is continued by point reflection about its end, so that value and slope are
//! continuous. For a higher band, and about a resonance, the record is mirrored at its ends. At both ends of the
//! filtered record an error remains, over about one period of the lowest frequency of the band; callers leave these
//! ends out.

use std::f64::consts::TAU;
use std::sync::Arc;

use num_complex::Complex64;
use quietcut_recording::Quantity;
use rustfft::{Fft, FftPlanner};

/// Discrete Fourier transforms of records of one length.
#[derive(Clone)]
pub struct Spectral {
    forward: Arc<dyn Fft<f64>>,
    inverse: Arc<dyn Fft<f64>>,
    rate_hz: f64,
    /// Number of samples of a record.
    length: usize,
    /// Number of samples that are transformed: the record forwards and backwards, with each end sample once.
    period: usize,
}

/// Continuation of a record beyond its ends before its Fourier transform.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Continuation {
    /// Point reflection of the record about its ends, after the straight line through them is subtracted: value and
    /// slope are continuous.
    Points,
    /// Mirror reflection of the record at its ends: the value is continuous. The integral of such a record does not
    /// drift.
    Mirror,
}

impl Spectral {
    /// Plans the Fourier transforms of records of `length` samples (at least two) at the sample rate `rate_hz`.
    pub fn new(length: usize, rate_hz: f64) -> Self {
        let period = (2 * length).saturating_sub(2).max(2);
        let mut planner = FftPlanner::new();
        Self {
            forward: planner.plan_fft_forward(period),
            inverse: planner.plan_fft_inverse(period),
            rate_hz,
            length,
            period,
        }
    }

    /// Frequency of a line of the transform, Hz; negative in the upper half of the lines.
    fn frequency_hz(&self, line: usize) -> f64 {
        let signed = if 2 * line > self.period {
            line as f64 - self.period as f64
        } else {
            line as f64
        };
        signed * self.rate_hz / self.period as f64
    }

    /// The record filtered with the frequency response `filter`(f), f in Hz. [`Continuation::Points`] subtracts a
    /// straight line first; `of_line` maps the value of that line at the middle of the record and its slope per second
    /// to those of the filtered line.
    fn through(
        &self,
        samples: &[f64],
        turn: Continuation,
        filter: impl Fn(f64) -> Complex64,
        of_line: impl Fn(f64, f64) -> [f64; 2],
    ) -> Vec<f64> {
        let (Some(&first), Some(&last)) = (samples.first(), samples.last()) else {
            return Vec::new();
        };
        let (sign, first, slope) = match turn {
            Continuation::Points => (-1.0, first, (last - first) / (self.length.max(2) - 1) as f64),
            Continuation::Mirror => (1.0, 0.0, 0.0),
        };
        let rest = |i: usize| samples[i] - first - slope * i as f64;
        let mut line: Vec<Complex64> = (0..self.length)
            .map(|i| Complex64::new(rest(i), 0.0))
            .chain(
                (1..self.length.max(2) - 1)
                    .rev()
                    .map(|i| Complex64::new(sign * rest(i), 0.0)),
            )
            .collect();
        line.resize(self.period, Complex64::ZERO);
        self.forward.process(&mut line);
        for (index, value) in line.iter_mut().enumerate() {
            *value *= filter(self.frequency_hz(index));
        }
        self.inverse.process(&mut line);
        let scale = 1.0 / self.period as f64;
        let middle = 0.5 * (self.length as f64 - 1.0);
        let [level, rise] = of_line(first + slope * middle, slope * self.rate_hz);
        line[..self.length]
            .iter()
            .enumerate()
            .map(|(i, x)| x.re * scale + level + rise * (i as f64 - middle) / self.rate_hz)
            .collect()
    }

    /// The record within `band_hz`, differentiated `order` times over time, or integrated for a negative order. With a
    /// band from 0 Hz the straight line through the ends of the record is kept, but not in integrals. With a band from
    /// above 0 Hz the lower band edge is gradual, and the record is mirrored at its ends.
    pub fn derivative(&self, samples: &[f64], order: i32, band_hz: [f64; 2]) -> Vec<f64> {
        let nyquist = 0.5 * self.rate_hz;
        let filter = |frequency: f64| {
            let within = if frequency.abs() <= band_hz[1] {
                above(frequency.abs(), band_hz[0])
            } else {
                0.0
            };
            // At half the sample rate an odd derivative of a real record is zero.
            let edge = order % 2 != 0 && frequency.abs() >= nyquist * (1.0 - 1e-12);
            if within == 0.0 || edge || (frequency == 0.0 && order < 0) {
                Complex64::ZERO
            } else {
                Complex64::new(0.0, TAU * frequency).powi(order) * within
            }
        };
        let turn = if band_hz[0] > 0.0 {
            Continuation::Mirror
        } else {
            Continuation::Points
        };
        self.through(samples, turn, filter, |level, slope| match (turn, order) {
            (Continuation::Points, 0) => [level, slope],
            (Continuation::Points, 1) => [slope, 0.0],
            _ => [0.0, 0.0],
        })
    }

    /// The record about `centre_hz`, differentiated `order` times over time, or integrated for a negative order, by a
    /// filter whose impulse response dies within a few periods of the centre frequency: an error at an end of the
    /// record stays there. Apart from the factor of the derivative, the gain of the filter rises smoothly from 0 at a
    /// tenth of the centre frequency to 1 at 0.7 of it, and falls from 1 at 3.5 times this frequency, above the third
    /// harmonic, to 0 at 5 times it.
    pub(crate) fn near_resonance(&self, samples: &[f64], order: i32, centre_hz: f64) -> Vec<f64> {
        let nyquist = 0.5 * self.rate_hz;
        let filter = |frequency: f64| {
            let ratio = frequency.abs() / centre_hz;
            let gain = smooth_step((ratio - 0.1) / 0.6) * smooth_step((5.0 - ratio) / 1.5);
            if gain == 0.0 || frequency.abs() >= nyquist * (1.0 - 1e-12) {
                Complex64::ZERO
            } else {
                Complex64::new(0.0, TAU * frequency).powi(order) * gain
            }
        };
        self.through(samples, Continuation::Mirror, filter, |_, _| [0.0, 0.0])
    }

    /// The record with its spectrum multiplied by a real `weight` of the frequency in Hz, so that no phase shifts.
    pub fn weighted(&self, samples: &[f64], weight: impl Fn(f64) -> f64) -> Vec<f64> {
        let still = weight(0.0);
        self.through(
            samples,
            Continuation::Points,
            |frequency| Complex64::new(weight(frequency.abs()), 0.0),
            |level, slope| [still * level, still * slope],
        )
    }
}

/// Step with two continuous derivatives: 0 up to u = 0, u − sin(2πu)/2π between, 1 from u = 1 on.
fn smooth_step(u: f64) -> f64 {
    let u = u.clamp(0.0, 1.0);
    u - (TAU * u).sin() / TAU
}

/// Gain of a gradual lower band edge: 1 above `low`, 0 below half of it, half a cosine between. A sharp edge would ring
/// through the whole record.
fn above(frequency: f64, low: f64) -> f64 {
    if frequency >= low {
        1.0
    } else {
        let share = (2.0 * frequency / low - 1.0).max(0.0);
        0.5 - 0.5 * (std::f64::consts::PI * share).cos()
    }
}

/// Power spectrum of a record averaged over successive frequency intervals of about 1/400 of the sample rate, at least
/// three lines, and the width of these intervals, Hz.
fn smooth_power(samples: &[f64], rate_hz: f64) -> (Vec<f64>, f64) {
    let length = samples.len();
    // A Hann window reduces the leakage from the ends of the record.
    let mut windowed: Vec<Complex64> = samples
        .iter()
        .enumerate()
        .map(|(i, x)| Complex64::new(x * 0.5 * (1.0 - (TAU * i as f64 / length as f64).cos()), 0.0))
        .collect();
    FftPlanner::new().plan_fft_forward(length).process(&mut windowed);
    let power: Vec<f64> = windowed[..length / 2].iter().map(Complex64::norm_sqr).collect();
    let width = (length / 400).max(3);
    let smooth = power
        .chunks(width)
        .map(|chunk| chunk.iter().sum::<f64>() / chunk.len() as f64)
        .collect();
    (smooth, width as f64 * rate_hz / length as f64)
}

fn strongest(smooth: &[f64]) -> usize {
    let mut strongest = 0;
    for (index, power) in smooth.iter().enumerate() {
        if *power > smooth[strongest] {
            strongest = index;
        }
    }
    strongest
}

/// Frequency at which a record has the largest smoothed power, Hz, with a resolution of 1/400 of the sample rate, or of
/// three lines if those are wider.
pub fn dominant_frequency_hz(samples: &[f64], rate_hz: f64) -> f64 {
    let (smooth, width_hz) = smooth_power(samples, rate_hz);
    (strongest(&smooth) as f64 + 0.5) * width_hz
}

/// Frequency of the largest line of the spectrum of a free decay above 0 Hz, in Hz; with `band_hz` of the largest line
/// within that band. The lines are 1/duration apart.
///
/// It is the spectrum of the velocity if displacement or velocity is measured, otherwise that of the acceleration. The
/// velocity after a release at the static displacement x₀ has lines of x₀/(2ζ) at the resonance, and the drift of a
/// high pass none above x₀. There is no window, since it would remove the beginning, where the decay is large.
pub(super) fn peak_frequency_hz(
    samples: &[f64],
    rate_hz: f64,
    quantity: Quantity,
    band_hz: Option<[f64; 2]>,
) -> f64 {
    let order = i32::from(quantity == Quantity::Displacement);
    let length = samples.len();
    let mean = samples.iter().sum::<f64>() / length.max(1) as f64;
    let mut lines: Vec<Complex64> = samples.iter().map(|x| Complex64::new(x - mean, 0.0)).collect();
    FftPlanner::new().plan_fft_forward(length).process(&mut lines);
    let mut largest = (0.0, 1);
    let hertz = rate_hz / length.max(1) as f64;
    let [low, high] = band_hz.unwrap_or([0.0, 0.5 * rate_hz]);
    for (index, line) in lines.iter().enumerate().take(length / 2).skip(1) {
        let size = line.norm() * (index as f64).powi(order);
        if size > largest.0 && (low..=high).contains(&(index as f64 * hertz)) {
            largest = (size, index);
        }
    }
    largest.1 as f64 * hertz
}

/// Frequency band in which a record exceeds its noise, Hz: the contiguous intervals around the dominant frequency whose
/// smoothed power exceeds the noise power by a factor of more than `margin`.
///
/// The noise power is the 5 % quantile of the smoothed power spectrum.
pub fn band_of(samples: &[f64], rate_hz: f64, margin: f64) -> [f64; 2] {
    let (smooth, width_hz) = smooth_power(samples, rate_hz);
    let mut sorted = smooth.clone();
    sorted.sort_by(f64::total_cmp);
    let floor = sorted.get(sorted.len() / 20).copied().unwrap_or(0.0);
    let strongest = strongest(&smooth);
    let stands = |index: &usize| smooth[*index] > margin * floor;
    let last = (strongest..smooth.len())
        .take_while(stands)
        .last()
        .unwrap_or(strongest);
    let first = (0..=strongest)
        .rev()
        .take_while(stands)
        .last()
        .unwrap_or(strongest);
    [
        first as f64 * width_hz,
        ((last + 1) as f64 * width_hz).min(0.5 * rate_hz),
    ]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn derivatives_and_integrals_are_those_of_the_sine() {
        let (rate, length) = (200.0, 2000);
        let omega = TAU * 3.07;
        // The signal is a sine with a drift; the record does not hold a whole number of periods.
        let at = |i: usize| (omega * i as f64 / rate).sin();
        let x: Vec<f64> = (0..length).map(|i| at(i) + 0.2 * i as f64 / rate).collect();
        let spectral = Spectral::new(length, rate);
        let twice = spectral.derivative(&x, 2, [0.0, 60.0]);
        let once = spectral.derivative(&x, 1, [0.0, 60.0]);
        let plain: Vec<f64> = (0..length).map(at).collect();
        let back = spectral.derivative(&spectral.derivative(&plain, 2, [0.0, 60.0]), -2, [1.0, 60.0]);
        for i in 500..length - 500 {
            let slope = omega * (omega * i as f64 / rate).cos() + 0.2;
            // The compared samples lie at least 2.5 s from the ends. The error from the corners of the continued record
            // falls with the distance from the ends; a mirrored record has corners in its slope, which integration
            // amplifies.
            assert!(
                (twice[i] + omega * omega * at(i)).abs() < 2e-3 * omega * omega,
                "{i}"
            );
            assert!((once[i] - slope).abs() < 2e-3 * omega, "{i}");
            assert!((back[i] - at(i)).abs() < 5e-2, "{i}: {} {}", back[i], at(i));
        }
    }

    #[test]
    fn the_band_is_where_the_signal_stands_out() {
        let rate = 500.0;
        let mut state = 1_u64;
        let x: Vec<f64> = (0..20_000)
            .map(|i| {
                let t = i as f64 / rate;
                state = state
                    .wrapping_mul(6_364_136_223_846_793_005)
                    .wrapping_add(1_442_695_040_888_963_407);
                let noise = (state >> 11) as f64 / (1_u64 << 53) as f64 - 0.5;
                let tones: f64 = (20..=60)
                    .map(|f| (TAU * f64::from(f) * t + f64::from(f * f)).cos())
                    .sum();
                tones + 0.01 * noise
            })
            .collect();
        let [low, high] = band_of(&x, rate, 1e3);
        // Both ends are accurate to two smoothed intervals, each 1/400 of the sample rate of 500 Hz.
        assert!(
            (low - 20.0).abs() < 2.6 && (high - 60.0).abs() < 2.6,
            "{low} {high}"
        );
    }
}
