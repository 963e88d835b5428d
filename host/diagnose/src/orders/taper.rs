//! Weights of the samples of a record: one in the middle, falling to zero at both ends as a cosine (Tukey's window).
//!
//! Without them, a strong vibration between two orders, or a drift of a sensor, leaks into the order at a distance Δf
//! with the factor 1/(πTΔf), T the duration of the record. With them this falls with Δf³ from Δf = 2/(`SHARE`·T) on. The
//! variance of an amplitude grows by a factor of n Σw²/(Σw)² = 1.10.

use std::f64::consts::PI;
use std::ops::Range;

/// Share of the samples of which the weight is below one, half of it at each end. It trades variance (1.10 at 0.25, 1.5
/// at 1) for leakage: at 0.25 and twenty revolutions, orders are apart from each other by 2.5 times 2/(`SHARE`·T).
const SHARE: f64 = 0.25;

/// Weights of `count` samples and the sums of their powers.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Taper {
    count: usize,
    /// Share of the samples of which the weight is below one.
    share: f64,
    /// Σw, Σw², Σw³ and Σw⁴.
    sums: [f64; 4],
}

impl Taper {
    /// Weights of a record.
    pub(crate) fn new(count: usize) -> Self {
        Self::with_share(count, SHARE)
    }

    /// Weights of one.
    pub(crate) fn even(count: usize) -> Self {
        Self::with_share(count, 0.0)
    }

    /// Hann's weights: sin² over all samples. Frequencies three or more cells of width 1/T apart are independent in
    /// white noise, and the correlation of two segments that overlap by half is 1/6.
    pub(crate) fn hann(count: usize) -> Self {
        Self::with_share(count, 1.0)
    }

    fn with_share(count: usize, share: f64) -> Self {
        let mut taper = Self {
            count,
            share,
            sums: [0.0; 4],
        };
        let mut sums = [0.0; 4];
        for sample in 0..count {
            let weight = taper.weight(sample);
            let mut power = weight;
            for sum in &mut sums {
                *sum += power;
                power *= weight;
            }
        }
        taper.sums = sums;
        taper
    }

    pub(crate) fn count(&self) -> usize {
        self.count
    }

    /// Weight of sample number `sample`.
    pub(crate) fn weight(&self, sample: usize) -> f64 {
        let from_end = (sample as f64 + 0.5).min(self.count as f64 - sample as f64 - 0.5) / self.count as f64;
        if 2.0 * from_end >= self.share {
            1.0
        } else {
            (PI * from_end / self.share).sin().powi(2)
        }
    }

    /// Samples of weight one.
    pub(crate) fn flat(&self) -> Range<usize> {
        let end = (0.5 * self.share * self.count as f64).ceil() as usize;
        end..self.count.saturating_sub(end).max(end)
    }

    /// Σw.
    pub(crate) fn sum(&self) -> f64 {
        self.sums[0]
    }

    /// Σw².
    pub(crate) fn sum_of_squares(&self) -> f64 {
        self.sums[1]
    }

    /// Variance of a weighted mean over the variance of a sample of white noise: Σw²/(Σw)².
    pub(crate) fn variance_of_mean(&self) -> f64 {
        self.sums[1] / (self.sums[0] * self.sums[0])
    }

    /// Number of cells of width 1/T in a spectrum of the weighted samples that count as one independent value: n
    /// Σw⁴/(Σw²)², 1.15 for long records.
    pub(crate) fn cells_per_value(&self) -> f64 {
        self.count as f64 * self.sums[3] / (self.sums[1] * self.sums[1])
    }

    /// Energy that the least-squares fit of one spectral line removes from white noise, in cells of width 1/T of its
    /// spectrum: n (2 Σw³/(Σw Σw²) − Σw²/(Σw)²), one without weights.
    pub(crate) fn cells_per_line(&self) -> f64 {
        let [one, two, three, _] = self.sums;
        self.count as f64 * (2.0 * three / (one * two) - two / (one * one))
    }
}

/// Largest power of a spectral line at a distance of `cells` of width 1/T from it, as a share of its peak; 1 within a
/// cell. The transform of the weights at the distance x falls as 1/(πx (1 − (`SHARE` x)²)). A factor of four in power
/// covers a peak between two bins.
pub(crate) fn side_lobe(cells: f64) -> f64 {
    let corner = (SHARE * cells).powi(2);
    let fall = PI * cells * (corner - 1.0).max(1.0) * (1.0 - 0.5 * SHARE);
    (4.0 / (fall * fall)).min(1.0)
}

/// Magnitude of the transform of the weights at a distance of `cells` of width 1/T from its peak, less than one, as a
/// share of the peak.
pub(crate) fn main_lobe(cells: f64) -> f64 {
    let x = PI * cells * (1.0 - 0.5 * SHARE);
    if x.abs() < 1e-6 {
        return 1.0;
    }
    let corner = SHARE * cells;
    (x.sin() / x * (0.5 * PI * corner).cos() / (1.0 - corner * corner)).abs()
}
