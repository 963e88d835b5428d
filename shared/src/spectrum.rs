//! One-sided power spectra of the two bands, with a Hann window.
//!
//! | band | points | transform |
//! |---|---|---|
//! | tool | 1024 | fixed point, [`fft`] |
//! | structure | 2048 | microfft, single precision |
//!
//! **Units.** `power[k]` is in (m/s²)². A tone of amplitude A in the middle of bin k gives A²/2 there, its mean
//! square. White noise of density S in (m/s²)²/Hz gives S·[`HANN_NOISE_BINS`]·bin width.
//!
//! **Window.** Hann, w\[n\] = ½ − ½·cos(2πn/N): equivalent noise bandwidth 1.5 bins, scalloping 1.42 dB, main lobe ±2
//! bins, first side lobe −31 dB, falling by 18 dB per octave. It is applied to the spectrum, as X\[k\]/2 −
//! (X\[k−1\] + X\[k+1\])/4: the same values without a table.
//!
//! The mean of each block is subtracted first, so that gravity does not reduce the resolution.

use crate::decimation::Sample;
use crate::fft;
use crate::math;
use crate::units::Hertz;

/// Points of a tool-band spectrum.
pub const TOOL_POINTS: usize = 1024;
/// Bins of a tool-band spectrum, 0 Hz and half the sample rate included.
pub const TOOL_BINS: usize = TOOL_POINTS / 2 + 1;
/// Points of a structure-band spectrum.
pub const STRUCTURE_POINTS: usize = 2048;
/// Bins of a structure-band spectrum, 0 Hz and half the sample rate included.
pub const STRUCTURE_BINS: usize = STRUCTURE_POINTS / 2 + 1;

/// Equivalent noise bandwidth of the Hann window, in bins.
pub const HANN_NOISE_BINS: f32 = 1.5;

/// The last N samples of a band, from which blocks for overlapping spectra are taken.
#[derive(Clone, Debug)]
pub struct Overlap<const N: usize> {
    ring: [Sample; N],
    next: usize,
    /// Number of samples until the next block for a spectrum is due.
    missing: usize,
}

impl<const N: usize> Overlap<N> {
    /// An empty buffer of samples: the first block is due after N samples.
    pub const fn new() -> Self {
        Self {
            ring: [[0; 3]; N],
            next: 0,
            missing: N,
        }
    }

    /// Discards all samples of the band, after a gap in the samples.
    pub fn reset(&mut self) {
        (self.next, self.missing) = (0, N);
    }

    /// Takes a sample of the band. Returns true if N samples are stored and at least `hop` of them came after the
    /// preceding block.
    pub fn push(&mut self, sample: Sample, hop: usize) -> bool {
        if let Some(slot) = self.ring.get_mut(self.next) {
            *slot = sample;
        }
        self.next = if self.next + 1 >= N { 0 } else { self.next + 1 };
        self.missing = self.missing.saturating_sub(1);
        if self.missing > 0 {
            return false;
        }
        self.missing = hop.max(1);
        true
    }

    /// The stored samples of one axis (0, 1, 2 for x, y, z), oldest first.
    fn axis(&self, axis: usize) -> impl Iterator<Item = i32> {
        let (newer, older) = self.ring.split_at(self.next.min(N));
        older
            .iter()
            .chain(newer)
            .map(move |sample| sample.get(axis).copied().unwrap_or(0))
    }

    /// Mean of the stored samples of one axis, rounded towards zero to an integer.
    fn mean(&self, axis: usize) -> i32 {
        (self.axis(axis).map(i64::from).sum::<i64>() / N as i64) as i32
    }
}

impl<const N: usize> Default for Overlap<N> {
    fn default() -> Self {
        Self::new()
    }
}

/// A power spectrum of a band, as a view into the memory of its bins.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PowerSpectrum<'a> {
    /// Power in each bin of the spectrum from 0 Hz to half the sample rate, in (m/s²)².
    pub power: &'a [f32],
    /// Width of a bin of the spectrum: the sample rate divided by the number of points.
    pub bin: Hertz,
}

/// Power spectrum of the tool band: the sum over the axes whose numbers (0, 1, 2 for x, y, z) `axes` gives.
///
/// `sample_rate` is the fitted rate of the tool band, `unit` the acceleration in m/s² of one unit of a [`Sample`], and
/// `work` scratch memory.
#[inline(never)]
pub fn tool_spectrum<'a>(
    block: &Overlap<TOOL_POINTS>,
    axes: &[usize],
    sample_rate: Hertz,
    unit: f32,
    work: &mut [i32; TOOL_POINTS],
    power: &'a mut [f32; TOOL_BINS],
) -> PowerSpectrum<'a> {
    power.fill(0.0);
    for &axis in axes {
        let mean = block.mean(axis);
        for (slot, value) in work.iter_mut().zip(block.axis(axis)) {
            *slot = value.saturating_sub(mean);
        }
        let transform = fft::rfft_1024(work);
        let bins = transform.bins.iter().map(|z| [z[0] as f32, z[1] as f32]);
        add_power(bins, unit * math::exp2i(transform.exponent), power);
    }
    PowerSpectrum {
        power,
        bin: Hertz(sample_rate.0 / TOOL_POINTS as f32),
    }
}

/// Power spectrum of the structure band; the arguments are those of [`tool_spectrum`].
#[inline(never)]
pub fn structure_spectrum<'a>(
    block: &Overlap<STRUCTURE_POINTS>,
    axes: &[usize],
    sample_rate: Hertz,
    unit: f32,
    work: &mut [f32; STRUCTURE_POINTS],
    power: &'a mut [f32; STRUCTURE_BINS],
) -> PowerSpectrum<'a> {
    power.fill(0.0);
    for &axis in axes {
        let mean = block.mean(axis);
        for (slot, value) in work.iter_mut().zip(block.axis(axis)) {
            *slot = value.saturating_sub(mean) as f32;
        }
        let bins = microfft::real::rfft_2048(work).iter().map(|z| [z.re, z.im]);
        add_power(bins, unit, power);
    }
    PowerSpectrum {
        power,
        bin: Hertz(sample_rate.0 / STRUCTURE_POINTS as f32),
    }
}

/// Applies the Hann window to the packed spectrum of one axis and adds its power, (m/s²)², to `power`; `unit` is the
/// acceleration in m/s² of one unit of `bins`.
///
/// `bins` are the N/2 entries of a packed spectrum, of which the first holds the real values at 0 Hz and half the
/// sample rate.
fn add_power(bins: impl Iterator<Item = [f32; 2]>, unit: f32, power: &mut [f32]) {
    let points = (2 * power.len() - 2) as f32;
    // With the Hann window, a tone of amplitude A has the value A·N/4 in its bin. The factor (4/N)²/2 turns its square
    // into the mean square A²/2.
    let amplitude_scale = unit * 4.0 / points;
    let scale = 0.5 * amplitude_scale * amplitude_scale;
    let conjugate = |z: [f32; 2]| [z[0], -z[1]];
    let mut bins = bins;
    let Some([dc, nyquist]) = bins.next() else { return };
    let mut following = bins.chain([[nyquist, 0.0]]);
    let (mut before, mut here) = ([0.0; 2], [dc, 0.0]);
    let last = power.len() - 1;
    for (k, slot) in power.iter_mut().enumerate() {
        // The spectrum of a real signal continues beyond both ends of its bins as its mirrored conjugate.
        let after = following.next().unwrap_or(conjugate(before));
        if k == 0 {
            before = conjugate(after);
        }
        let re = 0.5 * here[0] - 0.25 * (before[0] + after[0]);
        let im = 0.5 * here[1] - 0.25 * (before[1] + after[1]);
        // The bins at 0 Hz and at half the sample rate occur once in the two-sided spectrum, all others twice.
        let fold = if k == 0 || k == last { 0.5 } else { 1.0 };
        *slot += fold * scale * (re * re + im * im);
        (before, here) = (here, after);
    }
}
