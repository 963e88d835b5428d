//! Auto- and cross-spectra of channels that were sampled simultaneously.

use num_complex::Complex64;
use realfft::{RealFftPlanner, RealToComplex};
use std::ops::Range;
use std::sync::Arc;

use super::window::effective_averages;

/// Largest number of record segments whose Fourier transforms are buffered before their products are added to the sums
/// of the cross-spectra. A choice that reduces memory traffic.
const BATCH: usize = 4;

/// Largest number of frequency lines that are processed together when the products of all channel pairs are added to
/// the cross-spectra. A choice: the lines of all channels then fit into a cache of a core.
const LINES: usize = 256;

/// Cross-spectra S_ab(f) ∝ E[A(f) B*(f)] of all pairs of channels, as sums over segments or neighbouring lines; X = H F
/// then gives S_xf = H S_ff.
///
/// The scale is arbitrary but equal for all pairs, since FRFs are ratios of spectra.
#[derive(Clone, Debug)]
pub(super) struct CrossSpectra {
    /// Frequencies of the lines, Hz.
    pub(super) frequency_hz: Vec<f64>,
    /// Number of channels.
    channels: usize,
    /// Cross-spectrum S_ab, by pair of channels a ≤ b in the order aa, ab, …, bb, …, then by frequency line.
    pairs: Vec<Vec<Complex64>>,
    /// Effective number of independent averages in each line of each cross-spectrum.
    pub(super) averages: f64,
}

impl CrossSpectra {
    /// Cross-spectrum S_ab of channels `a` and `b` at one frequency line.
    pub(super) fn at(&self, line: usize, a: usize, b: usize) -> Complex64 {
        if a <= b {
            self.pairs[self.index(a, b)][line]
        } else {
            self.pairs[self.index(b, a)][line].conj()
        }
    }

    fn index(&self, a: usize, b: usize) -> usize {
        a * self.channels - a * (a + 1) / 2 + b
    }
}

/// Division of a record into windowed segments, over which its cross-spectra are summed.
#[derive(Clone, Debug)]
pub(super) struct Segments {
    /// Window weight of each sample of a segment; the number of weights is the segment length.
    pub(super) weights: Vec<f64>,
    /// Index of the first sample of each segment in the signals, ascending.
    pub(super) starts: Vec<usize>,
    /// True if the mean of each segment is subtracted before its transform.
    pub(super) without_mean: bool,
    /// Effective number of independent averages that the segments of the record yield; overlapping segments are partly
    /// dependent.
    pub(super) averages: f64,
}

impl Segments {
    /// Overlapping segments of a record of `samples` samples (Welch's method): each has as many samples as `weights`
    /// and shares about the fraction `overlap` of them with the next.
    pub(super) fn overlapping(weights: Vec<f64>, overlap: f64, samples: usize) -> Self {
        let length = weights.len();
        let shift = ((length as f64 * (1.0 - overlap)).round() as usize).clamp(1, length.max(1));
        let starts: Vec<usize> = (0..samples.saturating_sub(length.saturating_sub(1)))
            .step_by(shift)
            .collect();
        Self {
            averages: effective_averages(&weights, shift, starts.len()),
            weights,
            starts,
            without_mean: true,
        }
    }

    /// Leaves out the segments for whose range of samples `is_left_out` holds, and returns their number. The averages
    /// are reduced in proportion.
    pub(super) fn leave_out(&mut self, is_left_out: impl Fn(Range<usize>) -> bool) -> usize {
        let (before, length) = (self.starts.len(), self.weights.len());
        self.starts.retain(|&start| !is_left_out(start..start + length));
        self.averages *= self.starts.len() as f64 / before.max(1) as f64;
        before - self.starts.len()
    }
}

/// Cross-spectra of `signals` (all of one length), summed over their `segments`, at the transform lines `lines` as far
/// as half the sample rate.
pub(super) fn averaged(
    signals: &[&[f64]],
    sample_rate_hz: f64,
    segments: &Segments,
    lines: Range<usize>,
) -> CrossSpectra {
    let length = segments.weights.len();
    let mut transform = Transform::new(length);
    let end = lines.end.min(length / 2 + 1);
    let lines = lines.start.min(end)..end;
    let count = lines.len();
    let channels = signals.len();
    let mut spectra = CrossSpectra {
        frequency_hz: lines
            .clone()
            .map(|line| line as f64 * sample_rate_hz / length as f64)
            .collect(),
        channels,
        pairs: vec![vec![Complex64::ZERO; count]; channels * (channels + 1) / 2],
        averages: segments.averages,
    };
    let mut batch = vec![Complex64::ZERO; BATCH * channels * count];
    for starts in segments.starts.chunks(BATCH) {
        for (segment, &start) in starts.iter().enumerate() {
            for (channel, signal) in signals.iter().enumerate() {
                let at = (segment * channels + channel) * count;
                let whole = transform.of(
                    &signal[start..start + length],
                    &segments.weights,
                    segments.without_mean,
                );
                batch[at..at + count].copy_from_slice(&whole[lines.clone()]);
            }
        }
        multiply(&mut spectra.pairs, &batch, channels, starts.len(), count);
    }
    spectra
}

/// Cross-spectra of whole `signals` (all of one length) without their means, each summed over successive groups of
/// `width` lines of the transform in `band` (without 0 Hz and half the sample rate); a last group of fewer lines is
/// left out. The frequency of a group is that of its middle. The fraction `taper` of each signal is tapered at each
/// end.
pub(super) fn smoothed(
    signals: &[&[f64]],
    sample_rate_hz: f64,
    taper: f64,
    width: usize,
    band: Range<usize>,
) -> CrossSpectra {
    let samples = signals.first().map_or(0, |signal| signal.len());
    let length = super::window::fast_length(samples);
    let mut transform = Transform::new(length);
    let weights = tukey(samples, taper);
    let channels = signals.len();
    let width = width.max(1);
    let whole: Vec<Vec<Complex64>> = signals
        .iter()
        .map(|signal| transform.of(signal, &weights, true).to_vec())
        .collect();
    let band = band.start.max(1)..band.end.min(length / 2);
    let groups = band.len() / width;
    let mut pairs = Vec::with_capacity(channels * (channels + 1) / 2);
    for a in 0..channels {
        for b in a..channels {
            let sums = (0..groups).map(|group| {
                let lines = band.start + group * width..band.start + (group + 1) * width;
                lines.map(|line| whole[a][line] * whole[b][line].conj()).sum()
            });
            pairs.push(sums.collect());
        }
    }
    CrossSpectra {
        frequency_hz: (0..groups)
            .map(|group| {
                let middle = (band.start + group * width) as f64 + 0.5 * (width - 1) as f64;
                middle * sample_rate_hz / length as f64
            })
            .collect(),
        channels,
        pairs,
        // Zero padding adds lines to the Fourier transform, but no independent information.
        averages: width as f64 * samples as f64 / length as f64,
    }
}

/// Tukey window of `length` samples: 1 in the middle, half-cosine tapers over the fraction `taper` of the length, but
/// at least one sample, at each end.
fn tukey(length: usize, taper: f64) -> Vec<f64> {
    let ramp = (taper * length as f64).max(1.0);
    (0..length)
        .map(|k| {
            let from_end = (k.min(length - 1 - k) as f64 + 0.5) / ramp;
            if from_end < 1.0 {
                0.5 - 0.5 * (std::f64::consts::PI * from_end).cos()
            } else {
                1.0
            }
        })
        .collect()
}

/// Adds the products A B* of every pair of channels, over the `segments` segments of a batch, to the sums `pairs`. The
/// batch holds `count` lines for each channel of each segment, by segment, then by channel.
fn multiply(
    pairs: &mut [Vec<Complex64>],
    batch: &[Complex64],
    channels: usize,
    segments: usize,
    count: usize,
) {
    for first in (0..count).step_by(LINES) {
        let last = (first + LINES).min(count);
        let mut pair = 0;
        for a in 0..channels {
            for b in a..channels {
                let sums = &mut pairs[pair][first..last];
                pair += 1;
                for segment in 0..segments {
                    let lines = |channel: usize| {
                        let at = (segment * channels + channel) * count;
                        &batch[at + first..at + last]
                    };
                    for ((sum, x), y) in sums.iter_mut().zip(lines(a)).zip(lines(b)) {
                        sum.re += x.re * y.re + x.im * y.im;
                        sum.im += x.im * y.re - x.re * y.im;
                    }
                }
            }
        }
    }
}

/// Fourier transform of the real samples of a segment, with its buffers.
pub(super) struct Transform {
    plan: Arc<dyn RealToComplex<f64>>,
    time: Vec<f64>,
    lines: Vec<Complex64>,
    scratch: Vec<Complex64>,
}

impl Transform {
    pub(super) fn new(length: usize) -> Self {
        let plan = RealFftPlanner::new().plan_fft_forward(length);
        Self {
            time: plan.make_input_vec(),
            lines: plan.make_output_vec(),
            scratch: plan.make_scratch_vec(),
            plan,
        }
    }

    /// Fourier transform, from 0 Hz to half the sample rate, of the samples times `weights`, padded with zeros to the
    /// transform length. If `without_mean`, the mean of the samples is subtracted before the multiplication.
    pub(super) fn of(&mut self, samples: &[f64], weights: &[f64], without_mean: bool) -> &[Complex64] {
        let mean = if without_mean {
            samples.iter().sum::<f64>() / samples.len().max(1) as f64
        } else {
            0.0
        };
        self.time.fill(0.0);
        for ((time, sample), weight) in self.time.iter_mut().zip(samples).zip(weights) {
            *time = (sample - mean) * weight;
        }
        // The Fourier transform fails only for buffers of the wrong length; these were made by the plan.
        let done = self
            .plan
            .process_with_scratch(&mut self.time, &mut self.lines, &mut self.scratch);
        debug_assert!(done.is_ok());
        &self.lines
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::window::Window;

    fn noise(seed: u64, length: usize) -> Vec<f64> {
        use rand::{RngExt, SeedableRng};
        let mut random = rand_chacha::ChaCha8Rng::seed_from_u64(seed);
        (0..length).map(|_| random.random_range(-1.0..1.0)).collect()
    }

    /// Cross-spectrum sum at one line, computed from the definition of the transform.
    fn by_hand(a: &[f64], b: &[f64], weights: &[f64], starts: &[usize], line: usize) -> Complex64 {
        let length = weights.len();
        let transform = |signal: &[f64], start: usize| -> Complex64 {
            let segment = &signal[start..start + length];
            let mean = segment.iter().sum::<f64>() / length as f64;
            segment
                .iter()
                .enumerate()
                .map(|(k, x)| {
                    let angle = -std::f64::consts::TAU * (k * line) as f64 / length as f64;
                    Complex64::from_polar((x - mean) * weights[k], angle)
                })
                .sum()
        };
        starts
            .iter()
            .map(|&start| transform(a, start) * transform(b, start).conj())
            .sum()
    }

    #[test]
    fn averaged_spectra_agree_with_the_definition() {
        let (a, b, c) = (noise(1, 500), noise(2, 500), noise(3, 500));
        let weights = Window::Hann.weights(60);
        let segments = Segments::overlapping(weights.clone(), 0.5, 500);
        // 500 samples contain 15 segments of 60 samples at a spacing of 30; the last batch is incomplete.
        assert_eq!(segments.starts.len(), 15);
        let spectra = averaged(&[&a, &b, &c], 1000.0, &segments, 1..31);
        assert_eq!(spectra.frequency_hz[0], 1000.0 / 60.0);
        for (i, j, x, y) in [(0, 0, &a, &a), (0, 2, &a, &c), (2, 1, &c, &b)] {
            let expected = by_hand(x, y, &weights, &segments.starts, 8);
            // Tolerance: a few hundred roundings of numbers near 1.
            assert!((spectra.at(7, i, j) - expected).norm() < 1e-11, "{i}{j}");
        }
    }

    #[test]
    fn spectra_of_whole_records_are_averaged_over_lines() {
        let (a, b) = (noise(4, 512), noise(5, 512));
        let spectra = smoothed(&[&a, &b], 512.0, 0.1, 4, 8..41);
        assert_eq!(spectra.frequency_hz.len(), 8);
        assert_eq!(spectra.frequency_hz[0], 9.5);
        let taper = tukey(512, 0.1);
        let expected: Complex64 = (8..12).map(|line| by_hand(&a, &b, &taper, &[0], line)).sum();
        assert!((spectra.at(0, 0, 1) - expected).norm() < 1e-9 * expected.norm());
    }
}
