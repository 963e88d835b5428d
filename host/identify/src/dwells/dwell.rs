//! Steady periodic motion in a recording: segments of constant excitation frequency, and the Fourier coefficients of
//! the force and motion channels with the variance of their noise.

use std::f64::consts::TAU;

use nalgebra::{DMatrix, DVector};
use quietcut_numerics::least_squares::invert_normal_equations;

use crate::criteria::{FORCE_ABOVE_NOISE, FORCE_BELOW_LARGEST, STEP_SCATTER, STEP_SHARE};
use quietcut_model::structure::Direction;
use quietcut_recording::{Channel, Quantity, Recording};

/// A segment of a recording with one constant excitation frequency.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DwellSegment {
    /// First sample.
    pub from: usize,
    /// Index after the last sample.
    pub to: usize,
    /// First estimate of the excitation frequency, Hz.
    pub frequency_hz: f64,
}

/// A measured steady periodic motion: Fourier coefficients of the force and motion channels over one segment of
/// constant excitation frequency.
#[derive(Clone, Debug)]
pub struct Dwell {
    /// Fundamental frequency of the motion, which is the excitation frequency, rad/s.
    pub omega: f64,
    /// Variance of the estimated fundamental frequency, (rad/s)².
    pub omega_variance: f64,
    /// Number of samples of the fitted segment.
    pub samples: usize,
    /// (AᵀA)⁻¹ of the harmonic regression with design matrix A. Multiplied by the noise variance of a channel it is the
    /// covariance of the coefficients of that channel.
    pub gram_inverse: DMatrix<f64>,
    /// Fourier series of each force channel whose name gives a direction, in the order of the recording.
    pub forces: Vec<FourierSeries>,
    /// Fourier series of each motion channel whose name gives a direction and that is not zero throughout the
    /// recording, in the order of the recording.
    pub motions: Vec<FourierSeries>,
}

/// Fourier series of one channel over a dwell: coefficients of 1, cos, sin, cos 2 …, with the phase zero at the middle
/// of the segment.
#[derive(Clone, Debug)]
pub struct FourierSeries {
    /// The direction of the channel.
    pub direction: Direction,
    /// The quantity that the channel measures.
    pub quantity: Quantity,
    /// Fourier coefficients of 1, cos, sin, cos 2 …, in the unit of the channel.
    pub coefficients: DVector<f64>,
    /// Variance of the noise in one sample of the channel.
    pub variance: f64,
}

impl FourierSeries {
    /// Amplitude of harmonic h of the excitation frequency, in the unit of the channel.
    pub fn amplitude(&self, h: usize) -> f64 {
        self.coefficients[2 * h - 1].hypot(self.coefficients[2 * h])
    }

    /// Complex amplitude A_h of harmonic h of the excitation frequency: the harmonic is Re(A_h e^{ihωt}).
    pub fn phasor(&self, h: usize) -> num_complex::Complex64 {
        num_complex::Complex64::new(self.coefficients[2 * h - 1], -self.coefficients[2 * h])
    }
}

/// The direction of a force or motion channel, from its name; `None` for a channel of another quantity or name.
pub(crate) fn direction_of(channel: &Channel) -> Option<Direction> {
    let direction = match channel.quantity {
        Quantity::Displacement => channel.name.as_str(),
        Quantity::Force | Quantity::Velocity | Quantity::Acceleration => channel.name.get(1..)?,
        _ => return None,
    };
    direction.parse().ok()
}

/// Length of the blocks of a step-sine record over which the RMS of the force is computed, to find pauses of the
/// excitation, s.
const BLOCK_S: f64 = 0.1;

/// The segments of `recording` with a constant excitation frequency, found from the force channel with the largest
/// energy. Segments of few periods are left out. Empty without a force channel.
///
/// A segment ends where the force pauses or its frequency steps. A step without a pause shows as a change of the local
/// frequency, from the times of zero crossings of the force, that far exceeds the scatter of that frequency.
pub fn dwell_segments(recording: &Recording) -> Vec<DwellSegment> {
    let Some(force) = recording
        .channels
        .iter()
        .filter(|channel| channel.quantity == Quantity::Force)
        .max_by(|a, b| energy(&a.samples).total_cmp(&energy(&b.samples)))
    else {
        return Vec::new();
    };
    let rate = recording.sample_rate_hz;
    let block = ((BLOCK_S * rate) as usize).max(2);
    let sizes: Vec<f64> = force
        .samples
        .chunks(block)
        .map(|chunk| (energy(chunk) / chunk.len() as f64).sqrt())
        .collect();
    let mut sorted = sizes.clone();
    sorted.sort_by(f64::total_cmp);
    let (Some(&quietest), Some(&strongest)) = (sorted.get(sorted.len() / 50), sorted.last()) else {
        return Vec::new();
    };
    // The threshold of the RMS force of a block is chosen to lie between the noise and the lowest excitation level.
    let threshold = (FORCE_ABOVE_NOISE * quietest)
        .min(FORCE_BELOW_LARGEST[1] * strongest)
        .max(FORCE_BELOW_LARGEST[0] * strongest);
    let mut found = Vec::new();
    let mut start = None;
    for index in 0..=sizes.len() {
        let loud = sizes.get(index).is_some_and(|size| *size > threshold);
        match (loud, start) {
            (true, None) => start = Some(index),
            (false, Some(first)) => {
                // The first and last block of an excited segment may contain a part of the pause and are left out.
                let (from, to) = ((first + 1) * block, (index - 1).max(first + 1) * block);
                split(
                    &force.samples[..to.min(force.samples.len())],
                    from,
                    rate,
                    &mut found,
                );
                start = None;
            }
            _ => {}
        }
    }
    found
}

fn energy(samples: &[f64]) -> f64 {
    samples.iter().map(|x| x * x).sum()
}

/// Number of excitation periods over which the local frequency is estimated in the search for frequency steps.
const PERIODS: usize = 8;

/// Splits the force samples from `from` on into segments of constant frequency and appends those of more than
/// 2 · [`PERIODS`] periods to `found`.
fn split(samples: &[f64], from: usize, rate_hz: f64, found: &mut Vec<DwellSegment>) {
    let crossings = rising_crossings(samples, from);
    if crossings.len() <= 2 * PERIODS {
        return;
    }
    let frequency = |a: usize, b: usize| (b - a) as f64 * rate_hz / (crossings[b] - crossings[a]);
    let local: Vec<f64> = (0..crossings.len() - PERIODS)
        .map(|i| frequency(i, i + PERIODS))
        .collect();
    let mut steps: Vec<f64> = local.windows(2).map(|pair| (pair[1] - pair[0]).abs()).collect();
    steps.sort_by(f64::total_cmp);
    let scatter = steps.get(steps.len() / 2).copied().unwrap_or(0.0);
    let mut begin = 0;
    for end in 1..=local.len() {
        let held = frequency(
            begin,
            (begin + (end - begin).max(PERIODS)).min(crossings.len() - 1),
        );
        // A frequency step exceeds ten times the scatter of the local frequency, which is its median change from one
        // period to the next, and a thousandth of the frequency.
        let stepped =
            end < local.len() && (local[end] - held).abs() > (STEP_SCATTER * scatter).max(STEP_SHARE * held);
        if stepped || end == local.len() {
            let last = if stepped { end } else { crossings.len() - 1 };
            if last > begin + 2 * PERIODS {
                found.push(DwellSegment {
                    from: crossings[begin].ceil() as usize,
                    to: crossings[last].floor() as usize,
                    frequency_hz: frequency(begin, last),
                });
            }
            // After a segment, the periods in which the frequency step was found contain both frequencies and are
            // skipped.
            begin = if stepped && last > begin + 2 * PERIODS {
                end + PERIODS
            } else {
                end
            };
        }
    }
}

/// Fractional sample indices of the rising zero crossings of the force from sample `from` on. Before each crossing the
/// force must fall below minus half the RMS of these samples, so that weaker noise gives no second crossing.
fn rising_crossings(samples: &[f64], from: usize) -> Vec<f64> {
    let held = &samples[from.min(samples.len())..];
    let size = (energy(held) / held.len().max(1) as f64).sqrt();
    let mut crossings = Vec::new();
    let mut armed = false;
    for i in from.max(1)..samples.len() {
        armed |= samples[i] < -0.5 * size;
        if armed && samples[i - 1] < 0.0 && samples[i] >= 0.0 {
            crossings.push(i as f64 - samples[i] / (samples[i] - samples[i - 1]));
            armed = false;
        }
    }
    crossings
}

impl Dwell {
    /// Fits the periodic motion with `harmonics` harmonics to a segment of a recording; the frequency is refined with
    /// all fitted force and motion channels.
    ///
    /// `None` if the segment has fewer than four samples per coefficient or exceeds the recording, if the coefficients
    /// are not determined, if no channel shows the frequency, or without a force channel whose name gives a direction.
    pub fn fit(recording: &Recording, stretch: DwellSegment, harmonics: usize) -> Option<Self> {
        let count = stretch.to.checked_sub(stretch.from)?;
        if count < 4 * (2 * harmonics + 1) {
            return None;
        }
        let rate = recording.sample_rate_hz;
        let channels: Vec<_> = recording
            .channels
            .iter()
            .filter_map(|c| Some((c, direction_of(c)?)))
            .filter(|(c, _)| c.quantity == Quantity::Force || c.samples.iter().any(|x| *x != 0.0))
            .collect();
        let mut omega = TAU * stretch.frequency_hz;
        let mut omega_variance = f64::INFINITY;
        let mut lines = Vec::new();
        let mut gram_inverse = DMatrix::zeros(0, 0);
        // Gauss–Newton steps in the excitation frequency. They converge if the first estimate is within half the width
        // of a spectral line.
        for round in 0..5 {
            let design = design(count, omega / rate, harmonics);
            gram_inverse = invert_normal_equations(&design.tr_mul(&design))?;
            lines.clear();
            let (mut slope, mut weight) = (0.0, 0.0);
            for (channel, direction) in &channels {
                let samples = DVector::from_column_slice(channel.samples.get(stretch.from..stretch.to)?);
                let coefficients = &gram_inverse * design.tr_mul(&samples);
                let residual = &samples - &design * &coefficients;
                let free = count as f64 - (2 * harmonics + 1) as f64;
                // The noise variance is at least that of an error of 1e-14 of the RMS of the samples, which rounding
                // causes.
                let variance =
                    (residual.norm_squared() / free).max(1e-28 * samples.norm_squared() / count as f64);
                if variance > 0.0 {
                    let by_omega = slope_by_omega(&coefficients, &design, rate);
                    slope += by_omega.dot(&residual) / variance;
                    weight += by_omega.norm_squared() / variance;
                }
                lines.push(FourierSeries {
                    direction: *direction,
                    quantity: channel.quantity,
                    coefficients,
                    variance,
                });
            }
            if weight <= 0.0 {
                return None;
            }
            omega_variance = 1.0 / weight;
            let step = slope / weight;
            if round == 4 || step.abs() < 1e-3 * omega_variance.sqrt() {
                break;
            }
            omega += step;
        }
        let (forces, motions) = lines
            .into_iter()
            .partition(|line| line.quantity == Quantity::Force);
        let dwell = Self {
            omega,
            omega_variance,
            samples: count,
            gram_inverse,
            forces,
            motions,
        };
        (!dwell.forces.is_empty()).then_some(dwell)
    }

    /// Fourier series of the force channel with the largest fundamental; `None` without a force channel.
    pub fn force(&self) -> Option<&FourierSeries> {
        self.forces
            .iter()
            .max_by(|a, b| a.amplitude(1).total_cmp(&b.amplitude(1)))
    }
}

/// Design matrix of a harmonic regression: columns 1, cos, sin, cos 2 … of the phase, which is zero at the middle of
/// the `count` samples.
fn design(count: usize, radians_per_sample: f64, harmonics: usize) -> DMatrix<f64> {
    let middle = 0.5 * (count as f64 - 1.0);
    let mut design = DMatrix::zeros(count, 2 * harmonics + 1);
    for row in 0..count {
        let (sin, cos) = ((row as f64 - middle) * radians_per_sample).sin_cos();
        let (mut s, mut c) = (0.0, 1.0);
        design[(row, 0)] = 1.0;
        for h in 1..=harmonics {
            (c, s) = (c * cos - s * sin, s * cos + c * sin);
            design[(row, 2 * h - 1)] = c;
            design[(row, 2 * h)] = s;
        }
    }
    design
}

/// Derivative of the fitted Fourier series by the fundamental frequency ω, at every sample.
fn slope_by_omega(coefficients: &DVector<f64>, design: &DMatrix<f64>, rate_hz: f64) -> DVector<f64> {
    let middle = 0.5 * (design.nrows() as f64 - 1.0);
    DVector::from_fn(design.nrows(), |row, _| {
        let t = (row as f64 - middle) / rate_hz;
        let mut sum = 0.0;
        for h in 1..=coefficients.len() / 2 {
            let turned = coefficients[2 * h] * design[(row, 2 * h - 1)]
                - coefficients[2 * h - 1] * design[(row, 2 * h)];
            sum += h as f64 * turned;
        }
        sum * t
    })
}

/// Replaces the noise variance of each channel by its mean over the given dwells, weighted by their numbers of samples.
/// All dwells must have the same channels.
pub fn pool_variances(dwells: &mut [Dwell]) {
    type Pick = fn(&mut Dwell) -> &mut Vec<FourierSeries>;
    let picks: [Pick; 2] = [|dwell| &mut dwell.forces, |dwell| &mut dwell.motions];
    for pick in picks {
        let lines = dwells
            .iter_mut()
            .map(|dwell| pick(dwell).len())
            .min()
            .unwrap_or(0);
        for line in 0..lines {
            let (mut sum, mut count) = (0.0, 0.0);
            for dwell in dwells.iter_mut() {
                let samples = dwell.samples as f64;
                sum += samples * pick(dwell)[line].variance;
                count += samples;
            }
            for dwell in dwells.iter_mut() {
                pick(dwell)[line].variance = sum / count;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn noise_after_a_long_quiet_start_gives_no_second_crossing() {
        // 9000 samples of rest, then a sine of 40 samples per period with noise at a quarter of its amplitude.
        let (rest, period, periods) = (9000, 40, 25);
        let sine = |i: usize| (std::f64::consts::TAU * (i as f64 + 0.5) / period as f64).sin();
        let noise = |i: usize| if i.is_multiple_of(2) { 0.25 } else { -0.25 };
        let samples: Vec<f64> = (0..rest)
            .map(|_| 0.0)
            .chain((0..period * periods).map(|i| sine(i) + noise(i)))
            .collect();
        let crossings = rising_crossings(&samples, rest);
        assert_eq!(crossings.len(), periods, "{crossings:?}");
    }
}
