//! The asynchronous part of a channel: power spectral density of its residual, and spectral lines that are no orders.

use std::f64::consts::LN_2;

use num_complex::Complex64;
use quietcut_numerics::statistics::median;

use crate::orders::between_lines::LineSpectrum;
use crate::orders::taper::{self, Taper};

/// Probability that noise without lines, whose spectrum is smooth over [`MEDIAN_BINS`], shows a line in one channel.
pub(crate) const FALSE_LINE: f64 = 0.01;

/// Largest number of points of a spectrum that is kept; finer spectra are averaged.
const POINTS_MAX: usize = 4096;

/// Number of bins over which the median of the periodogram gives the level of the noise. Its relative deviation is
/// 1/(ln 2 √256) = 9 %.
const MEDIAN_BINS: usize = 256;

/// Largest number of lines of a channel.
const LINES_MAX: usize = 32;

/// Power spectral densities of the residuals of all channels.
#[derive(Clone, Debug)]
pub(crate) struct Spectrum {
    /// Frequency of the first point and distance of two points, Hz.
    pub first_hz: f64,
    pub step_hz: f64,
    /// One-sided density by channel and point, square of the channel's SI unit per Hz. It is near zero where an order
    /// is removed.
    pub density: Vec<Vec<f64>>,
}

/// A spectral line that is no order: mains hum, chatter, another machine, a lightly damped mode.
#[derive(Clone, Copy, Debug)]
pub(crate) struct SpectralLine {
    /// Index of the channel.
    pub channel: usize,
    /// Frequency, Hz.
    pub frequency_hz: f64,
    /// Amplitude (zero to peak), in the channel's SI unit.
    pub amplitude: f64,
    /// Probability that noise shows a line as high anywhere in the spectrum of the channel.
    pub probability: f64,
}

/// First frequency and step, Hz, and one-sided density of a transform of the weighted residual.
pub(crate) fn density(
    transform: &[Complex64],
    taper: &Taper,
    length: usize,
    rate_hz: f64,
) -> (f64, f64, Vec<f64>) {
    let group = transform.len().div_ceil(POINTS_MAX);
    let scale = 2.0 / (taper.sum_of_squares() * rate_hz);
    let density = transform
        .chunks(group)
        .map(|bins| scale * bins.iter().map(Complex64::norm_sqr).sum::<f64>() / bins.len() as f64)
        .collect();
    let step_hz = rate_hz / length as f64;
    (
        0.5 * (group - 1) as f64 * step_hz,
        group as f64 * step_hz,
        density,
    )
}

/// Lines of a channel by a test with the error rate [`FALSE_LINE`].
///
/// In noise the power P_j over its mean is exponential. A line is a local maximum with P_j/level > t, where the largest
/// of N bins exceeds t with the probability N e^{−t}; the error of the level with the relative deviation s raises it to
/// N e^{−t + t²s²/2}. The side lobes of stronger lines are left out.
pub(crate) fn lines(
    transform: &[Complex64],
    spectrum: &LineSpectrum,
    taper: &Taper,
    rate_hz: f64,
) -> Vec<SpectralLine> {
    let power: Vec<f64> = transform.iter().map(Complex64::norm_sqr).collect();
    let levels = Levels::new(&power, spectrum, taper);
    let bins_per_cell = spectrum.length as f64 / taper.count() as f64;
    // The lowest cells hold drifts of the sensors.
    let first = (2.0 * bins_per_cell) as usize + 1;
    let mut found: Vec<(usize, f64)> = (first..power.len().saturating_sub(1))
        .filter(|&bin| power[bin] > power[bin - 1] && power[bin] >= power[bin + 1])
        .filter_map(|bin| Some((bin, levels.probability(bin, power[bin])?)))
        .filter(|(_, probability)| *probability < FALSE_LINE)
        .collect();
    found.sort_by(|a, b| power[b.0].total_cmp(&power[a.0]));
    let mut lines: Vec<(usize, SpectralLine)> = Vec::new();
    for (bin, probability) in found {
        let is_lobe = lines.iter().any(|(stronger, _)| {
            let cells = stronger.abs_diff(bin) as f64 / bins_per_cell;
            power[bin] < power[*stronger] * taper::side_lobe(cells)
        });
        if is_lobe || lines.len() >= LINES_MAX {
            continue;
        }
        let place = vertex([bin - 1, bin, bin + 1].map(|bin| power[bin].max(f64::MIN_POSITIVE).ln()));
        let line = SpectralLine {
            channel: 0,
            frequency_hz: (bin as f64 + place) * rate_hz / spectrum.length as f64,
            amplitude: 2.0 * power[bin].sqrt() / (taper.sum() * taper::main_lobe(place / bins_per_cell)),
            probability,
        };
        lines.push((bin, line));
    }
    lines.into_iter().map(|(_, line)| line).collect()
}

/// Place from −1/2 to 1/2 of the vertex of the parabola through values at −1, 0 and 1, the middle one the largest.
fn vertex([left, middle, right]: [f64; 3]) -> f64 {
    let bend = left - 2.0 * middle + right;
    if bend < 0.0 {
        0.5 * (right - left) / -bend
    } else {
        0.0
    }
}

/// Level of the noise over the bins.
struct Levels {
    /// Mean power in each block of [`MEDIAN_BINS`]/2 bins, from the median over twice as many.
    of: Vec<f64>,
    /// Number of bins that the medians have at least.
    fewest: usize,
    bins: usize,
    /// Number of bins per independent value.
    bins_per_value: f64,
}

impl Levels {
    fn new(power: &[f64], spectrum: &LineSpectrum, taper: &Taper) -> Self {
        let step = MEDIAN_BINS / 2;
        let mut fewest = usize::MAX;
        let of = (0..power.len().div_ceil(step))
            .map(|block| {
                let middle = block * step + step / 2;
                let from = middle
                    .saturating_sub(step)
                    .min(power.len().saturating_sub(MEDIAN_BINS));
                let to = (from + MEDIAN_BINS).min(power.len());
                let mut between: Vec<f64> = (from..to)
                    .filter(|bin| !spectrum.is_line(*bin))
                    .map(|bin| power[bin])
                    .collect();
                fewest = fewest.min(between.len());
                median(&mut between).unwrap_or(0.0) / LN_2
            })
            .collect();
        let bins_per_cell = spectrum.length as f64 / taper.count() as f64;
        Self {
            of,
            fewest,
            bins: power.len(),
            bins_per_value: bins_per_cell * taper.cells_per_value(),
        }
    }

    /// Probability that the noise of a whole spectrum reaches `power` at its place; `None` where there is no level.
    fn probability(&self, bin: usize, power: f64) -> Option<f64> {
        let level = self.of[bin / (MEDIAN_BINS / 2)];
        if level <= 0.0 || self.fewest == 0 {
            return None;
        }
        let variance = self.bins_per_value / (LN_2 * LN_2 * self.fewest as f64);
        // The exponent has its minimum at t = 1/s², beyond which the normal error of the level is no longer one.
        let t = (power / level).min(1.0 / variance);
        Some((self.bins as f64 * (-t + 0.5 * t * t * variance).exp()).min(1.0))
    }
}
