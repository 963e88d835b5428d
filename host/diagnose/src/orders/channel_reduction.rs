//! Reduction of one channel: amplitudes of its orders, and the parts of its residual.

use num_complex::Complex64;
use realfft::RealFftPlanner;

use crate::orders::alias_kernel::AliasKernel;
use crate::orders::asynchronous::{self, SpectralLine};
use crate::orders::between_lines::{Band, LineSpectrum};
use crate::orders::circle::Circle;
use crate::orders::taper::Taper;
use crate::signal::noise::rms;

/// A block of whole revolutions: its first sample after the first reduced one, and its weights.
#[derive(Clone, Copy)]
pub(crate) struct BlockWeights {
    pub first: usize,
    pub taper: Taper,
}

/// All that is computed once for all channels.
pub(crate) struct Plan<'a> {
    pub revolutions: &'a [f64],
    pub taper: Taper,
    pub kernel: &'a AliasKernel,
    pub spectrum: &'a LineSpectrum,
    pub bands: &'a [Band],
    pub blocks: &'a [BlockWeights],
    /// True if blocks are longer than the slowest decay, so that their errors are independent.
    pub blocks_forget: bool,
    pub rate_hz: f64,
    /// Spindle frequency, revolutions per sample.
    pub per_sample: f64,
    /// Relative root mean square of the wander of the speed.
    pub speed_wander: f64,
}

/// One channel, reduced.
pub(crate) struct ChannelReduction {
    /// Amplitudes Y_k, k = 0 … K.
    pub amplitudes: Vec<Complex64>,
    /// Bins of the transform of the residual in the band about each order.
    pub bands: Vec<Vec<Complex64>>,
    /// Difference of the amplitudes in each block from those of the record.
    pub blocks: Vec<Vec<Complex64>>,
    pub density: (f64, f64, Vec<f64>),
    pub lines: Vec<SpectralLine>,
    /// Root mean square of the samples.
    pub rms: f64,
}

impl ChannelReduction {
    pub(crate) fn new(samples: &[f64], plan: &Plan) -> Self {
        let taper = &plan.taper;
        let fit = OrderFit::new(samples, plan.revolutions, taper, plan.kernel, &[]);
        let residual = fit.residual;
        let transform = transform(&residual, taper, plan.spectrum.length);
        Self {
            amplitudes: fit.amplitudes,
            bands: plan
                .bands
                .iter()
                .map(|band| transform[band.bins.clone()].to_vec())
                .collect(),
            blocks: blocks(&residual, plan),
            density: asynchronous::density(&transform, taper, plan.spectrum.length, plan.rate_hz),
            lines: asynchronous::lines(&transform, plan.spectrum, taper, plan.rate_hz),
            rms: rms(samples),
        }
    }
}

/// Weighted least-squares fit of one channel.
pub(crate) struct OrderFit {
    /// Amplitudes Y_k, k = 0 … K.
    pub amplitudes: Vec<Complex64>,
    /// Samples without the orders up to P, whose part above half the sample rate is folded below: the aliases of a
    /// force that jumps would be noise between the lines.
    pub residual: Vec<f64>,
    /// Coefficients of the orders up to P in the residual's fit. Those of aliases that nearly coincide are uncertain.
    pub with_aliases: Vec<Complex64>,
}

impl OrderFit {
    /// `penalties` of the orders as in [`AliasKernel::solve_with_prior`].
    pub(crate) fn new(
        samples: &[f64],
        revolutions: &[f64],
        taper: &Taper,
        kernel: &AliasKernel,
        penalties: &[f64],
    ) -> Self {
        let circle = Circle::new(kernel.aliases());
        let weighted = samples
            .iter()
            .enumerate()
            .map(|(sample, value)| (revolutions[sample], taper.weight(sample) * value));
        let mut right = circle.sums(weighted);
        for entry in &mut right {
            *entry /= taper.sum();
        }
        let amplitudes = kernel.solve(&right[..=kernel.orders()]);
        let with_aliases = kernel.solve_with_prior(&right, penalties);
        let series = circle.series(&with_aliases);
        let residual = samples
            .iter()
            .zip(revolutions)
            .map(|(value, revolutions)| value - series.at(*revolutions))
            .collect();
        Self {
            amplitudes,
            residual,
            with_aliases,
        }
    }

    /// Penalties of the aliases in another fit of the same channel: their prior is that of a force that jumps, E |c_k|²
    /// = A²/k², with A² from the upper half of the orders up to K; the noise is the residual of this fit.
    pub(crate) fn penalties(&self, taper: &Taper, kernel: &AliasKernel) -> Vec<f64> {
        let energy: f64 = self.residual.iter().map(|value| value * value).sum();
        let noise = energy / self.residual.len() as f64 * taper.variance_of_mean();
        let highest = kernel.orders();
        let upper = highest / 2 + 1..=highest;
        let squares = upper
            .clone()
            .map(|order| (order * order) as f64 * (self.amplitudes[order].norm_sqr() - noise));
        let square = (squares.sum::<f64>() / upper.count().max(1) as f64).max(f64::MIN_POSITIVE);
        (0..=kernel.aliases())
            .map(|order| {
                let penalty = noise * (order * order) as f64 / square;
                if order <= highest {
                    0.0
                } else {
                    penalty.min(LARGEST_PENALTY)
                }
            })
            .collect()
    }
}

/// Largest penalty: it leaves 1e-6 of an amplitude.
const LARGEST_PENALTY: f64 = 1e6;

/// Fourier transform of the weighted residual, padded with zeros.
fn transform(residual: &[f64], taper: &Taper, length: usize) -> Vec<Complex64> {
    let plan = RealFftPlanner::new().plan_fft_forward(length);
    let mut padded = vec![0.0; length];
    for (sample, (to, value)) in padded.iter_mut().zip(residual).enumerate() {
        *to = taper.weight(sample) * value;
    }
    let mut bins = plan.make_output_vec();
    // It fails only if lengths differ, and here they are equal.
    let _ = plan.process(&mut padded, &mut bins);
    bins
}

/// Weighted mean of r e^{−ikθ} in each block. The coupling of orders within a block is left out: it is of second order
/// in the residual.
fn blocks(residual: &[f64], plan: &Plan) -> Vec<Vec<Complex64>> {
    let circle = Circle::new(plan.kernel.orders());
    plan.blocks
        .iter()
        .map(|block| {
            let weighted = (0..block.taper.count()).map(|sample| {
                let at = block.first + sample;
                (plan.revolutions[at], block.taper.weight(sample) * residual[at])
            });
            let mut sums = circle.sums(weighted);
            for sum in &mut sums {
                *sum /= block.taper.sum();
            }
            sums
        })
        .collect()
}
