//! Derivatives, integrals and weights of whole records by the discrete Fourier transform.
//!
//! A record is not periodic. The line through its ends is subtracted, and the rest is continued by point reflection about its end,
//! so that value and slope are continuous. An error remains over about one period of the lowest frequency at both ends; callers
//! leave it out.

use std::f64::consts::TAU;
use std::sync::Arc;

use num_complex::Complex64;
use rustfft::{Fft, FftPlanner};

/// Transforms of records of one length.
#[derive(Clone)]
pub struct Spectral {
    forward: Arc<dyn Fft<f64>>,
    inverse: Arc<dyn Fft<f64>>,
    rate_hz: f64,
    /// Samples of a record.
    length: usize,
    /// Samples that are transformed: there and back, the ends once.
    period: usize,
}

/// Continuation of a record beyond its ends.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Turn {
    /// About its end points, the line through them taken off: value and slope are continuous.
    Points,
    /// Mirrored: the value is continuous. An integral of it has no line that would run away.
    Mirror,
}

impl Spectral {
    /// For records of `length` samples at `rate_hz`; at least two.
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

    /// Frequency of a line, Hz; negative in the upper half.
    fn frequency_hz(&self, line: usize) -> f64 {
        let signed = if 2 * line > self.period {
            line as f64 - self.period as f64
        } else {
            line as f64
        };
        signed * self.rate_hz / self.period as f64
    }

    /// The record through the filter H(f), f in Hz. `of_line` says what becomes of the line that [`Turn::Points`] takes
    /// off: from its value and slope per second in the middle of the record.
    fn through(
        &self,
        samples: &[f64],
        turn: Turn,
        filter: impl Fn(f64) -> Complex64,
        of_line: impl Fn(f64, f64) -> [f64; 2],
    ) -> Vec<f64> {
        let (Some(&first), Some(&last)) = (samples.first(), samples.last()) else {
            return Vec::new();
        };
        let (sign, first, slope) = match turn {
            Turn::Points => (-1.0, first, (last - first) / (self.length.max(2) - 1) as f64),
            Turn::Mirror => (1.0, 0.0, 0.0),
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

    /// The record within `band_hz`, differentiated `order` times (integrated where it is negative). A band that begins at
    /// 0 keeps level and slope of the record; another begins softly, and takes the record as mirrored at its ends.
    pub fn derivative(&self, samples: &[f64], order: i32, band_hz: [f64; 2]) -> Vec<f64> {
        let nyquist = 0.5 * self.rate_hz;
        let filter = |frequency: f64| {
            let within = if frequency.abs() <= band_hz[1] {
                above(frequency.abs(), band_hz[0])
            } else {
                0.0
            };
            // At half the sample rate an odd derivative has no value.
            let edge = order % 2 != 0 && frequency.abs() >= nyquist * (1.0 - 1e-12);
            if within == 0.0 || edge || (frequency == 0.0 && order < 0) {
                Complex64::ZERO
            } else {
                Complex64::new(0.0, TAU * frequency).powi(order) * within
            }
        };
        let turn = if band_hz[0] > 0.0 {
            Turn::Mirror
        } else {
            Turn::Points
        };
        self.through(samples, turn, filter, |level, slope| match (turn, order) {
            (Turn::Points, 0) => [level, slope],
            (Turn::Points, 1) => [slope, 0.0],
            _ => [0.0, 0.0],
        })
    }

    /// The record with every frequency (Hz) times a real weight: no phase, so nothing moves in time.
    pub fn weighted(&self, samples: &[f64], weight: impl Fn(f64) -> f64) -> Vec<f64> {
        let still = weight(0.0);
        self.through(
            samples,
            Turn::Points,
            |frequency| Complex64::new(weight(frequency.abs()), 0.0),
            |level, slope| [still * level, still * slope],
        )
    }
}

/// 1 from `low` on, 0 below half of it, half a cosine between: a sharp edge would ring on through the whole record.
fn above(frequency: f64, low: f64) -> f64 {
    if frequency >= low {
        1.0
    } else {
        let share = (2.0 * frequency / low - 1.0).max(0.0);
        0.5 - 0.5 * (std::f64::consts::PI * share).cos()
    }
}

/// Power spectrum averaged over 1/400 of the record's lines, and the width of these intervals in Hz.
fn smooth_power(samples: &[f64], rate_hz: f64) -> (Vec<f64>, f64) {
    let length = samples.len();
    // A Hann window: the ends of a record would else leak over the whole spectrum.
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

fn loudest(smooth: &[f64]) -> usize {
    let mut loudest = 0;
    for (index, power) in smooth.iter().enumerate() {
        if *power > smooth[loudest] {
            loudest = index;
        }
    }
    loudest
}

/// The dominant frequency of a record, Hz, to about 1/400 of half its sample rate.
pub fn dominant_frequency_hz(samples: &[f64], rate_hz: f64) -> f64 {
    let (smooth, width_hz) = smooth_power(samples, rate_hz);
    (loudest(&smooth) as f64 + 0.5) * width_hz
}

/// Where a record stands out of its noise, Hz: from the lowest line that does to the highest of that contiguous stretch.
///
/// The noise is the level that the quietest tenth of the smoothed spectrum below half the sample rate has; what stands
/// `margin` times (in power) above it counts.
pub fn band_of(samples: &[f64], rate_hz: f64, margin: f64) -> [f64; 2] {
    let (smooth, width_hz) = smooth_power(samples, rate_hz);
    let mut sorted = smooth.clone();
    sorted.sort_by(f64::total_cmp);
    let floor = sorted.get(sorted.len() / 20).copied().unwrap_or(0.0);
    let loudest = loudest(&smooth);
    let stands = |index: &usize| smooth[*index] > margin * floor;
    let last = (loudest..smooth.len())
        .take_while(stands)
        .last()
        .unwrap_or(loudest);
    let first = (0..=loudest).rev().take_while(stands).last().unwrap_or(loudest);
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
        // On a slope, and no whole number of periods.
        let at = |i: usize| (omega * i as f64 / rate).sin();
        let x: Vec<f64> = (0..length).map(|i| at(i) + 0.2 * i as f64 / rate).collect();
        let spectral = Spectral::new(length, rate);
        let twice = spectral.derivative(&x, 2, [0.0, 60.0]);
        let once = spectral.derivative(&x, 1, [0.0, 60.0]);
        let plain: Vec<f64> = (0..length).map(at).collect();
        let back = spectral.derivative(&spectral.derivative(&plain, 2, [0.0, 60.0]), -2, [1.0, 60.0]);
        for i in 500..length - 500 {
            let slope = omega * (omega * i as f64 / rate).cos() + 0.2;
            // Two and a half seconds from the ends; what corners at the ends leave falls with the distance, and a mirrored
            // record has its corners in the slope, which integration makes more of.
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
        // To one smoothed stretch: a four-hundredth of the sample rate.
        assert!(
            (low - 20.0).abs() < 2.6 && (high - 60.0).abs() < 2.6,
            "{low} {high}"
        );
    }
}
