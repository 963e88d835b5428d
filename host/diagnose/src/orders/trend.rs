//! Orders of blocks of a record, and their linear change over it.

use nalgebra::DMatrix;
use num_complex::Complex64;

use crate::orders::alias_kernel::AliasKernel;
use crate::orders::channel_reduction::BlockWeights;
use crate::orders::circle::Circle;
use crate::orders::common::Common;
use crate::orders::taper::Taper;

/// Amplitudes of all channels in a block of whole revolutions, weighted by Hann's window.
#[derive(Clone, Debug)]
pub(crate) struct AmplitudeBlock {
    /// Middle of the block, s after the first sample.
    pub centre_s: f64,
    /// Amplitudes by order (rows, from 0) and channel (columns).
    pub amplitudes: DMatrix<Complex64>,
}

/// Linear change of the amplitudes over a record.
#[derive(Clone, Debug)]
pub(crate) struct Trend {
    /// Slope of the amplitudes over time, times `scale_s`.
    pub amplitudes: DMatrix<Complex64>,
    /// Standard deviation of the time over the reduced revolutions, s.
    pub scale_s: f64,
    /// Variance of `amplitudes` over that of the amplitudes of the record.
    pub variance: f64,
    /// By m = 0 … K + P: what a signal e^{ipθ} of unit amplitude leaves in the trend of the order k, m = |k − p|. At a
    /// speed that wanders the orders above K do not keep their phase against those onto which they fold.
    pub folding: Vec<f64>,
    /// Errors common to all orders but 0, from the deviations of the blocks from the trend, for the amplitudes of the
    /// record.
    pub common: Common,
}

/// Slope of the amplitudes of one channel over the blocks, times the standard deviation of the time over the record.
///
/// Aliases are not removed first, as they are for the noise between the lines: near a whole number of samples in a
/// revolution they lie so near the lines that they would take up a slow change.
pub(super) fn slope_of(
    samples: &[f64],
    revolutions: &[f64],
    kernel: &AliasKernel,
    blocks: &[BlockWeights],
) -> Vec<Complex64> {
    let circle = Circle::new(kernel.orders());
    let taper = Taper::new(samples.len());
    let weighted = samples
        .iter()
        .enumerate()
        .map(|(sample, value)| (revolutions[sample], taper.weight(sample) * value));
    let mut right = circle.sums(weighted);
    for entry in &mut right {
        *entry /= taper.sum();
    }
    let amplitudes = kernel.solve(&right);
    let series = circle.series(&amplitudes);
    let residual: Vec<f64> = samples
        .iter()
        .zip(revolutions)
        .map(|(value, revolution)| value - series.at(*revolution))
        .collect();
    over_blocks(&circle, revolutions, blocks, |sample| residual[sample])
}

/// [`Trend::folding`] for differences of orders up to `highest`.
pub(super) fn folding_of(revolutions: &[f64], blocks: &[BlockWeights], highest: usize) -> Vec<f64> {
    let sums = over_blocks(&Circle::new(highest), revolutions, blocks, |_| 1.0);
    sums.into_iter().map(Complex64::norm).collect()
}

/// Slope, over every second block, of the means of v e^{−ikθ} for the orders of a circle, times the standard deviation of
/// the time over the record.
fn over_blocks(
    circle: &Circle,
    revolutions: &[f64],
    blocks: &[BlockWeights],
    value: impl Fn(usize) -> f64,
) -> Vec<Complex64> {
    let apart: Vec<&BlockWeights> = blocks.iter().step_by(2).collect();
    let centre = |block: &BlockWeights| block.first as f64 + 0.5 * (block.taper.count() - 1) as f64;
    let mean = apart.iter().map(|block| centre(block)).sum::<f64>() / apart.len().max(1) as f64;
    let squares: f64 = apart.iter().map(|block| (centre(block) - mean).powi(2)).sum();
    let scale = revolutions.len() as f64 / 12.0_f64.sqrt();
    let mut slope = Vec::new();
    for block in apart {
        let weighted = (0..block.taper.count()).map(|sample| {
            let at = block.first + sample;
            (revolutions[at], block.taper.weight(sample) * value(at))
        });
        let sums = circle.sums(weighted);
        slope.resize(sums.len(), Complex64::ZERO);
        let factor = (centre(block) - mean) * scale / squares / block.taper.sum();
        for (slope, sum) in slope.iter_mut().zip(sums) {
            *slope += sum * factor;
        }
    }
    slope
}

/// Slope of the amplitudes over time.
pub(super) struct Slope {
    pub(super) amplitudes: DMatrix<Complex64>,
    /// Variance over that of a block.
    pub(super) variance: f64,
    pub(super) centre_s: f64,
}

/// Slope of the amplitudes of every second block, which do not overlap, by `scale_s`.
pub(super) fn slope(blocks: &[AmplitudeBlock], scale_s: f64) -> Slope {
    let apart: Vec<&AmplitudeBlock> = blocks.iter().step_by(2).collect();
    let centre_s = apart.iter().map(|block| block.centre_s).sum::<f64>() / apart.len() as f64;
    let squares: f64 = apart
        .iter()
        .map(|block| (block.centre_s - centre_s).powi(2))
        .sum();
    let mut amplitudes = &apart[0].amplitudes * Complex64::ZERO;
    for block in &apart {
        amplitudes += &block.amplitudes * Complex64::from((block.centre_s - centre_s) * scale_s / squares);
    }
    Slope {
        amplitudes,
        variance: scale_s * scale_s / squares,
        centre_s,
    }
}
