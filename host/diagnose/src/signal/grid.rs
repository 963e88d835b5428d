//! Time and frequency grid of one record: zero-padded transforms, upsampled signals and their spectra.

use std::f64::consts::{PI, TAU};
use std::sync::Arc;

use num_complex::Complex64;
use realfft::{ComplexToReal, RealFftPlanner, RealToComplex};

/// Fourier transforms of one record of `count` samples, padded with zeros while the response of the structure decays.
///
/// Spectra of signals that are not upsampled hold bins 0 … length/2 of the unnormalized transform X_k = Σ x_n
/// e^(−2πikn/length). Signals that are not upsampled are taken as band-limited to half the sample rate, so that the
/// spectrum defines them between samples. An upsampled signal has `finer` samples per sample of the record.
#[derive(Clone)]
pub(crate) struct Grid {
    count: usize,
    length: usize,
    finer: usize,
    rate_hz: f64,
    forward: Arc<dyn RealToComplex<f64>>,
    inverse: Arc<dyn ComplexToReal<f64>>,
    fine_forward: Arc<dyn RealToComplex<f64>>,
    fine_inverse: Arc<dyn ComplexToReal<f64>>,
}

impl Grid {
    /// Plans the transforms of `count` samples at `rate_hz`, padded with zeros for about `room_s` seconds (at least the
    /// smaller of the record and 4096 samples, at most three times the record), and of signals upsampled by the factor
    /// `finer`.
    pub(crate) fn new(count: usize, rate_hz: f64, room_s: f64, finer: usize) -> Self {
        let room = ((room_s * rate_hz) as usize).clamp(count.min(4096), 3 * count.max(1));
        let length = smooth_even(count + room);
        let mut planner = RealFftPlanner::new();
        Self {
            count,
            length,
            finer,
            rate_hz,
            forward: planner.plan_fft_forward(length),
            inverse: planner.plan_fft_inverse(length),
            fine_forward: planner.plan_fft_forward(finer * length),
            fine_inverse: planner.plan_fft_inverse(finer * length),
        }
    }

    /// Number of samples of the record.
    pub(crate) fn count(&self) -> usize {
        self.count
    }

    /// Number of samples of a transform without upsampling: those of the record and its zero padding.
    pub(crate) fn length(&self) -> usize {
        self.length
    }

    /// Oversampling factor: samples of an upsampled signal per sample of the record.
    pub(crate) fn finer(&self) -> usize {
        self.finer
    }

    /// Sample rate of the record, Hz.
    pub(crate) fn rate_hz(&self) -> f64 {
        self.rate_hz
    }

    /// Number of bins of the spectrum of a signal that is not upsampled.
    pub(crate) fn bins(&self) -> usize {
        self.length / 2 + 1
    }

    /// Angular frequency of bin number `bin` of a spectrum, rad/s.
    pub(crate) fn omega(&self, bin: usize) -> f64 {
        TAU * self.rate_hz * bin as f64 / self.length as f64
    }

    /// Spectrum of a signal that is zero outside the record.
    pub(crate) fn spectrum(&self, samples: &[f64]) -> Vec<Complex64> {
        let mut padded = vec![0.0; self.length];
        padded[..samples.len()].copy_from_slice(samples);
        transform(&*self.forward, &mut padded)
    }

    /// Spectrum of a signal that is continued smoothly beyond both ends of the record: reflected at its end points, and
    /// faded out.
    ///
    /// The continuation has no step at the ends of the record, which keeps the errors of derivatives (iω)·X small
    /// there.
    pub(crate) fn continued_spectrum(&self, samples: &[f64]) -> Vec<Complex64> {
        let mut padded = vec![0.0; self.length];
        let count = samples.len();
        padded[..count].copy_from_slice(samples);
        let room = ((self.length - count) / 2).min(count.saturating_sub(1));
        for step in 1..=room {
            let fade = 0.5 * (1.0 + (PI * step as f64 / (room + 1) as f64).cos());
            padded[count - 1 + step] = fade * (2.0 * samples[count - 1] - samples[count - 1 - step]);
            padded[self.length - step] = fade * (2.0 * samples[0] - samples[step]);
        }
        transform(&*self.forward, &mut padded)
    }

    /// Inverse transform of `spectrum` at the samples of the record.
    pub(crate) fn samples(&self, spectrum: &[Complex64]) -> Vec<f64> {
        let mut bins = spectrum.to_vec();
        let mut samples = back(&*self.inverse, &mut bins, self.length);
        samples.truncate(self.count);
        samples
    }

    /// Inverse transform of `spectrum` as a signal with `finer` samples per sample of the record.
    pub(crate) fn fine_samples(&self, spectrum: &[Complex64]) -> Vec<f64> {
        let mut bins = vec![Complex64::ZERO; self.finer * self.length / 2 + 1];
        bins[..spectrum.len()].copy_from_slice(spectrum);
        if self.finer > 1
            && spectrum.len() == self.bins()
            && let Some(last) = bins.get_mut(self.length / 2)
        {
            *last *= 0.5;
        }
        let mut samples = back(&*self.fine_inverse, &mut bins, self.length);
        samples.truncate(self.finer * self.count);
        samples
    }

    /// Number of bins of an upsampled signal's spectrum. The first [`Self::bins`] of them have the frequencies of the
    /// spectrum that is not upsampled.
    pub(crate) fn fine_bins(&self) -> usize {
        self.finer * self.length / 2 + 1
    }

    /// Spectrum of an upsampled signal `fine` that is zero outside the record, in the scale of [`Self::spectrum`].
    pub(crate) fn spectrum_of_fine(&self, fine: &[f64]) -> Vec<Complex64> {
        let mut padded = vec![0.0; self.finer * self.length];
        padded[..fine.len()].copy_from_slice(fine);
        let mut bins = transform(&*self.fine_forward, &mut padded);
        let scale = 1.0 / self.finer as f64;
        for bin in &mut bins {
            *bin *= scale;
        }
        bins
    }

    /// Samples of the record from the spectrum of an upsampled signal, delayed by `delay_s`. The delay is interpolated
    /// by cubics in time, because a phase shift of the spectrum would make steps ring.
    pub(crate) fn late_samples_of_fine(&self, spectrum: &[Complex64], delay_s: f64) -> Vec<f64> {
        let fine = self.fine_samples(spectrum);
        let late = delay_s * self.rate_hz() * self.finer() as f64;
        (0..self.count())
            .map(|sample| catmull_rom(&fine, (sample * self.finer()) as f64 - late))
            .collect()
    }

    /// Samples of the record from the spectrum of an upsampled signal, as a sensor without anti-aliasing filter reads
    /// them: the spectrum is folded about half the sample rate.
    pub(crate) fn samples_of_fine(&self, spectrum: &[Complex64]) -> Vec<f64> {
        let whole = self.finer * self.length;
        let at = |bin: usize| {
            if 2 * bin <= whole {
                spectrum[bin]
            } else {
                spectrum[whole - bin].conj()
            }
        };
        let folded: Vec<Complex64> = (0..self.bins())
            .map(|bin| (0..self.finer).map(|alias| at(bin + alias * self.length)).sum())
            .collect();
        self.samples(&folded)
    }
}

/// Forward transform of real samples. It fails only if lengths differ, and here they are equal.
fn transform(plan: &dyn RealToComplex<f64>, samples: &mut [f64]) -> Vec<Complex64> {
    let mut bins = plan.make_output_vec();
    let _ = plan.process(samples, &mut bins);
    bins
}

fn back(plan: &dyn ComplexToReal<f64>, bins: &mut [Complex64], normalize_by: usize) -> Vec<f64> {
    if let Some(first) = bins.first_mut() {
        first.im = 0.0;
    }
    if let Some(last) = bins.last_mut() {
        last.im = 0.0;
    }
    let mut samples = plan.make_output_vec();
    let _ = plan.process(bins, &mut samples);
    let scale = 1.0 / normalize_by as f64;
    for sample in &mut samples {
        *sample *= scale;
    }
    samples
}

/// The smallest even number ≥ `least` without a prime factor above 5.
pub(crate) fn smooth_even(least: usize) -> usize {
    let mut best = usize::MAX;
    let mut five = 1;
    while five < 2 * least.max(2) {
        let mut three = five;
        while three < 2 * least.max(2) {
            let mut number = 2 * three;
            while number < least {
                number *= 2;
            }
            best = best.min(number);
            three *= 3;
        }
        five *= 5;
    }
    best
}

/// Fourier transform of a segment of a signal without padding, as the real values that a regression requires.
pub(crate) struct SegmentTransform {
    plan: Arc<dyn RealToComplex<f64>>,
}

impl SegmentTransform {
    pub(crate) fn new(length: usize) -> Self {
        Self {
            plan: RealFftPlanner::new().plan_fft_forward(length),
        }
    }

    /// Appends to `into` the real and imaginary parts of the segment's spectrum at bins 0 … `bins` − 1, scaled so that
    /// white noise of unit variance has unit variance in each part. The imaginary parts at zero and at half the sample
    /// rate are always zero and left out.
    pub(crate) fn bins(&self, samples: &[f64], bins: usize, into: &mut Vec<f64>) {
        let length = samples.len();
        let mut buffer = samples.to_vec();
        let spectrum = transform(&*self.plan, &mut buffer);
        let scale = (2.0 / length as f64).sqrt();
        for (bin, value) in spectrum.iter().take(bins).enumerate() {
            if bin == 0 || 2 * bin == length {
                into.push(value.re * scale * 0.5_f64.sqrt());
            } else {
                into.push(value.re * scale);
                into.push(value.im * scale);
            }
        }
    }
}

/// Catmull–Rom (cubic) interpolation of `samples` at `place`, a fractional index.
pub(crate) fn catmull_rom(samples: &[f64], place: f64) -> f64 {
    let Some(last) = samples.len().checked_sub(1) else {
        return 0.0;
    };
    let index = (place.max(0.0) as usize).min(last);
    let u = (place - index as f64).clamp(0.0, 1.0);
    let at = |offset: isize| samples[index.saturating_add_signed(offset).min(last)];
    let (a, b, c, d) = (at(-1), at(0), at(1), at(2));
    b + 0.5 * u * (c - a + u * (2.0 * a - 5.0 * b + 4.0 * c - d + u * (3.0 * (b - c) + d - a)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lengths_are_even_and_have_small_factors() {
        for (least, found) in [(1, 2), (7, 8), (11, 12), (4097, 4320), (100_000, 100_000)] {
            assert_eq!(smooth_even(least), found);
        }
    }

    #[test]
    fn upsampled_signals_interpolate_a_tone_and_can_be_downsampled() {
        let (count, rate) = (400, 100.0);
        let tone = |t: f64| (TAU * 7.3 * t).sin() * (-(t - 2.0) * (t - 2.0) * 4.0).exp();
        let samples: Vec<f64> = (0..count).map(|n| tone(n as f64 / rate)).collect();
        let grid = Grid::new(count, rate, 4.0, 4);
        let spectrum = grid.spectrum(&samples);
        let fine = grid.fine_samples(&spectrum);
        for (n, value) in fine.iter().enumerate() {
            assert!((value - tone(n as f64 / rate / 4.0)).abs() < 1e-6, "{n}");
        }
        let again = grid.samples_of_fine(&grid.spectrum_of_fine(&fine));
        for (a, b) in again.iter().zip(&samples) {
            assert!((a - b).abs() < 1e-9);
        }
    }

    #[test]
    fn the_derivative_of_a_continued_signal_is_accurate_up_to_the_ends() {
        let (count, rate) = (512, 100.0);
        let samples: Vec<f64> = (0..count)
            .map(|n| (TAU * 1.7 * n as f64 / rate + 0.4).sin())
            .collect();
        let grid = Grid::new(count, rate, 5.0, 1);
        let mut spectrum = grid.continued_spectrum(&samples);
        for (bin, value) in spectrum.iter_mut().enumerate() {
            *value *= Complex64::new(0.0, grid.omega(bin));
        }
        let derivative = grid.samples(&spectrum);
        for (n, value) in derivative.iter().enumerate() {
            let truth = TAU * 1.7 * (TAU * 1.7 * n as f64 / rate + 0.4).cos();
            // The second derivative of the continued signal jumps at the ends of the record, which limits the accuracy
            // there.
            assert!((value - truth).abs() < 0.03 * TAU * 1.7, "{n}: {value} {truth}");
        }
    }

    #[test]
    fn the_transform_of_a_segment_keeps_its_energy() {
        let samples: Vec<f64> = (0..30).map(|n| ((n * n) as f64).sin()).collect();
        let mut parts = Vec::new();
        SegmentTransform::new(30).bins(&samples, 16, &mut parts);
        let energy = |x: &[f64]| x.iter().map(|x| x * x).sum::<f64>();
        assert_eq!(parts.len(), 30);
        assert!((energy(&parts) - energy(&samples)).abs() < 1e-12 * energy(&samples));
    }

    #[test]
    fn cubic_interpolation_is_exact_for_lines() {
        let samples = [0.0, 1.0, 2.0, 3.0, 4.0];
        for place in [0.0, 0.7, 1.5, 2.0, 2.9, 4.0] {
            if (1.0..=3.0).contains(&place) {
                assert!((catmull_rom(&samples, place) - place).abs() < 1e-12);
            }
        }
        assert_eq!(catmull_rom(&[], 1.0), 0.0);
        assert_eq!(catmull_rom(&samples, 9.0), 4.0);
    }

    #[test]
    fn a_delayed_step_does_not_ring() {
        let grid = Grid::new(64, 100.0, 0.0, 8);
        let fine: Vec<f64> = (0..64 * 8).map(|k| f64::from(u8::from(k >= 32 * 8))).collect();
        // A delay of 0.3 samples puts the step between samples 32 and 33, both outside the support of the cubic.
        let late = grid.late_samples_of_fine(&grid.spectrum_of_fine(&fine), 0.003);
        for (sample, value) in late.iter().enumerate() {
            let truth = f64::from(u8::from(sample > 32));
            assert!((value - truth).abs() < 1e-9, "{sample}: {value}");
        }
    }
}
