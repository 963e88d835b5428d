//! Cross-spectral matrix of all channels between the spectral lines of the orders.
//!
//! X is the Fourier transform of the weighted residual of a channel, which is free of all orders and of their aliases up
//! to P. In a band of whole cells of width 1/T about an order,
//!
//! S = mean of X Xᴴ/Σw² over the band, divided by the share of the band that the removed lines left,
//!
//! is the variance of a sample of white noise with the spectral density of that band (two-sided density times sample
//! rate). Residual and amplitudes have the same weights, so that strong vibration leaks into both alike. Independent
//! values: ν = free cells / cells per value.

use std::ops::Range;

use nalgebra::DMatrix;
use num_complex::Complex64;

use crate::orders::taper::Taper;
use crate::signal::grid::smooth_even;

/// Independent values of a band per channel, from which on the band is not widened. The expected squared distance of C
/// channels is larger by ν/(ν − C) because the covariance is estimated: 5 % at 20. A wider band hides a spectrum that
/// changes within it.
const VALUES_PER_CHANNEL: f64 = 20.0;

/// Distance, in cells of width 1/T, below which two lines count as one: the difference of their columns, (π `COINCIDENT`)²
/// of a column in energy, is then below 1e-3.
const COINCIDENT: f64 = 0.01;

/// Largest half width of a band in spindle frequencies, unless it has too few values.
const HALF_WIDTH: f64 = 0.5;

/// Fewest independent values of a band of C channels: 2C + 2. The variance of the squared distance is infinite up to C
/// + 1; at 2C + 2 its mean is larger by a factor of at most two, and its relative deviation by less than two.
fn fewest_values(channels: usize) -> f64 {
    2.0 * channels as f64 + 2.0
}

/// Fourier transform of the weighted residual: its length and the place of the removed lines.
pub(crate) struct LineSpectrum {
    /// Number of samples of the zero-padded transform.
    pub length: usize,
    /// Cells of width 1/T of the removed lines, ascending.
    lines: Vec<usize>,
    /// Duration of the record over the mean revolution.
    revolutions: f64,
    taper: Taper,
}

/// Bins of a transform about an order.
pub(crate) struct Band {
    pub bins: Range<usize>,
    /// Share of the energy of white noise that the removed lines left.
    free_share: f64,
    /// Number ν of independent values.
    pub freedoms: f64,
}

impl LineSpectrum {
    /// For orders up to `aliases` of the spindle frequency `per_sample`, in revolutions per sample.
    pub(crate) fn new(per_sample: f64, aliases: usize, taper: Taper) -> Self {
        let count = taper.count() as f64;
        let mut places: Vec<f64> = (0..=aliases)
            .map(|order| order as f64 * per_sample)
            .map(|cycles| (cycles - cycles.round()).abs() * count)
            .collect();
        places.sort_unstable_by(f64::total_cmp);
        // Two lines closer than a cell still take two values from the noise.
        places.dedup_by(|next, place| *next - *place < COINCIDENT);
        let mut counted: Vec<f64> = Vec::new();
        for place in places {
            // The third of a cluster takes values at the ends of the record, where the weights vanish.
            if counted.len() < 2 || place - counted[counted.len() - 2] > 1.0 {
                counted.push(place);
            }
        }
        let lines = counted.iter().map(|place| place.round() as usize).collect();
        Self {
            length: smooth_even(taper.count()),
            lines,
            revolutions: per_sample * count,
            taper,
        }
    }

    /// True if a removed line occupies the cell of bin number `bin`.
    pub(crate) fn is_line(&self, bin: usize) -> bool {
        let cell = (bin as f64 * self.taper.count() as f64 / self.length as f64).round() as usize;
        self.lines.binary_search(&cell).is_ok()
    }

    /// Number of lines in the cells.
    fn lines_in(&self, cells: &Range<usize>) -> usize {
        let below = |cell: usize| self.lines.partition_point(|line| *line < cell);
        below(cells.end) - below(cells.start)
    }

    /// The band about `order` for `channels` channels: within half a spindle frequency, narrower as soon as it has
    /// [`VALUES_PER_CHANNEL`], wider until it has the [`fewest_values`].
    pub(crate) fn band(&self, order: usize, channels: usize) -> Band {
        let wanted = VALUES_PER_CHANNEL * channels as f64;
        let widest = (HALF_WIDTH * self.revolutions) as usize;
        let last = self.taper.count() / 2;
        let centre = (order as f64 * self.revolutions).round() as usize;
        let mut half = 1;
        loop {
            let band = self.band_of(order, centre, half);
            let is_whole = half >= last;
            let is_enough = band.freedoms >= wanted;
            let is_wide = half >= widest && band.freedoms >= fewest_values(channels);
            if is_whole || is_enough || is_wide {
                return band;
            }
            half += 1;
        }
    }

    fn band_of(&self, order: usize, centre: usize, half: usize) -> Band {
        let last = self.taper.count() / 2;
        let cells = centre.saturating_sub(half)..(centre + half).min(last) + 1;
        let (mut width, mut lines) = (cells.len() as f64, self.lines_in(&cells) as f64);
        if order == 0 {
            // The band reaches to the negative frequencies, whose values are conjugate.
            (width, lines) = (2.0 * width - 1.0, 2.0 * lines - 1.0);
        }
        let free = (width - lines * self.taper.cells_per_line()).max(0.0);
        let bins_per_cell = self.length as f64 / self.taper.count() as f64;
        let bin = |cell: f64| (cell * bins_per_cell).max(0.0).ceil() as usize;
        let end = bin(cells.end as f64 - 0.5).min(self.length / 2 + 1);
        Band {
            bins: bin(cells.start as f64 - 0.5)..end,
            free_share: free / width,
            freedoms: free / self.taper.cells_per_value(),
        }
    }

    /// Cross-spectral matrix S of the channels in a band, from the bins of each channel.
    pub(crate) fn matrix(&self, band: &Band, order: usize, channels: &[&[Complex64]]) -> DMatrix<Complex64> {
        let count = channels.first().map_or(0, |bins| bins.len());
        let scale = 1.0 / (self.taper.sum_of_squares() * band.free_share.max(f64::MIN_POSITIVE));
        if order == 0 {
            let weight = |bin: usize| if bin + band.bins.start == 0 { 1.0 } else { 2.0 };
            let whole: f64 = (0..count).map(weight).sum();
            return DMatrix::from_fn(channels.len(), channels.len(), |i, j| {
                let products = channels[i].iter().zip(channels[j]).enumerate();
                let sum: f64 = products
                    .map(|(bin, (a, b))| weight(bin) * (a * b.conj()).re)
                    .sum();
                Complex64::from(sum * scale / whole)
            });
        }
        DMatrix::from_fn(channels.len(), channels.len(), |i, j| {
            let products = channels[i].iter().zip(channels[j]);
            products.map(|(a, b)| a * b.conj()).sum::<Complex64>() * (scale / count as f64)
        })
    }
}
