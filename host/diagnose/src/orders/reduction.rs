//! Reduction of the channels of a recorded cut to the complex amplitudes of the orders of the spindle frequency.

use nalgebra::{Cholesky, DMatrix, DVector};
use num_complex::Complex64;
use rayon::prelude::*;

use crate::criteria::LEAST_RELATIVE_NOISE;
use crate::error::DiagnoseError;
use crate::orders::alias_kernel::AliasKernel;
use crate::orders::asynchronous::{SpectralLine, Spectrum};
use crate::orders::between_lines::{Band, LineSpectrum};
use crate::orders::block_noise::independent_combinations;
use crate::orders::channel_reduction::{BlockWeights, ChannelReduction, Plan};
use crate::orders::circle::Circle;
use crate::orders::common::{BLOCKS_MAX, BLOCKS_MIN, Common};
use crate::orders::distance::{self, Hotelling, OrderCovariance, SquaredDistance};
use crate::orders::spindle_angle::{SpindleAngle, check_revolutions};
use crate::orders::taper::Taper;
use crate::orders::trend::{AmplitudeBlock, Trend, folding_of, slope, slope_of};
use quietcut_recording::Recording;

/// Highest frequency of an order over the sample rate. From half the sample rate an order and its conjugate coincide;
/// the tenth that is left keeps them apart at a speed that wanders by up to 5 %.
const HIGHEST_OF_RATE: f64 = 0.45;

/// Fewest revolutions of a block: adjacent orders are then three cells of its spectrum apart, where Hann's weights make
/// them independent.
const LEAST_BLOCK_REVOLUTIONS: f64 = 3.0;

/// Limits of a reduction.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ReductionSettings {
    /// Highest frequency of an order, Hz.
    pub highest_hz: f64,
    /// Highest order P whose aliases are removed from the residual and accepted by [`Orders::seen`], over the order at
    /// half the sample rate; at least 1. Each unit costs one cell of the spectrum between two lines, of as many cells as
    /// there are revolutions.
    pub alias_factor: f64,
    /// Slowest decay of the machine in the cut, s: blocks are longer.
    pub slowest_decay_s: f64,
    /// Time after the first sample from which on the cut has settled, s.
    pub settled_s: f64,
}

/// Orders of a recorded cut.
///
/// y(t) = Y_0 + 2 Re Σ_{k=1}^{K} Y_k e^{ikθ(t)} + asynchronous part, so that |Y_k| is half the amplitude (zero to peak),
/// in the SI unit of the channel. θ = 0 at immersion angle 0 of tooth 1.
#[derive(Clone)]
pub(crate) struct Orders {
    /// Names of the channels.
    pub channels: Vec<String>,
    pub angle: SpindleAngle,
    /// Amplitudes Y_k by order (rows, k = 0 … K) and channel (columns).
    pub amplitudes: DMatrix<Complex64>,
    /// Covariance of the error of each order, from the spectrum between the lines.
    pub covariances: Vec<OrderCovariance>,
    /// Errors common to all orders but 0, beyond `covariances`.
    pub common: Common,
    /// Amplitudes over time; empty if the record is shorter than three blocks of three revolutions.
    pub blocks: Vec<AmplitudeBlock>,
    /// `None` if the record is shorter than three blocks of three revolutions.
    pub trend: Option<Trend>,
    pub spectrum: Spectrum,
    /// Spectral lines that are no orders, by channel and descending power.
    pub lines: Vec<SpectralLine>,
    kernel: AliasKernel,
    block_weights: Vec<BlockWeights>,
    variance_of_mean: f64,
}

impl Orders {
    /// Reduces the channels `names` of a recording with a tachometer, from the first whole revolution after
    /// `settings.settled_s` to the last.
    ///
    /// # Errors
    /// A channel is missing or has a value that is not finite; the tachometer is missing or does not match its wheel; or
    /// fewer than ten whole revolutions of settled cutting are left.
    pub(crate) fn new(
        recording: &Recording,
        names: &[&str],
        settings: &ReductionSettings,
    ) -> Result<Self, DiagnoseError> {
        let angle = SpindleAngle::new(recording, settings.settled_s)?;
        Self::with_angle(recording, names, angle, settings)
    }

    /// [`Self::new`] with a given spindle angle; `settings.settled_s` is not used.
    ///
    /// # Errors
    /// As [`Self::new`].
    pub(crate) fn with_angle(
        recording: &Recording,
        names: &[&str],
        angle: SpindleAngle,
        settings: &ReductionSettings,
    ) -> Result<Self, DiagnoseError> {
        check_revolutions(recording, angle.count())?;
        let rate_hz = recording.sample_rate_hz;
        let range = reduced_range(recording, &angle);
        let samples = channels(recording, names, &range)?;
        let revolutions = angle.revolutions_at(range.clone().map(|sample| sample as f64 / rate_hz));
        let per_sample = angle.frequency_hz / rate_hz;
        let (highest, aliases) = highest_orders(recording, per_sample, settings)?;
        let taper = Taper::new(range.len());
        let kernel = AliasKernel::new(highest, aliases, &revolutions, &taper);
        let spectrum = LineSpectrum::new(per_sample, aliases, taper);
        let bands: Vec<Band> = (0..=highest)
            .map(|order| spectrum.band(order, names.len()))
            .collect();
        let mut blocks_of_plan = block_weights(per_sample, settings.slowest_decay_s * rate_hz, &taper);
        let forget = !blocks_of_plan.is_empty();
        if !forget {
            blocks_of_plan = block_weights(per_sample, 0.0, &taper);
        }
        let plan = Plan {
            revolutions: &revolutions,
            taper,
            kernel: &kernel,
            spectrum: &spectrum,
            bands: &bands,
            blocks: &blocks_of_plan,
            blocks_forget: forget,
            rate_hz,
            per_sample,
            speed_wander: angle.speed_wander,
        };
        let reduced: Vec<ChannelReduction> = samples
            .par_iter()
            .map(|samples| ChannelReduction::new(samples, &plan))
            .collect();
        let spectral = spectral_matrices(&reduced, &plan);
        let OverTime {
            common,
            blocks,
            trend,
        } = over_time(&reduced, &spectral, &plan, range.start);
        let trend = trend.map(|trend| {
            let columns: Vec<DVector<Complex64>> = samples
                .iter()
                .map(|samples| {
                    let of_channel = slope_of(samples, &revolutions, &kernel, &blocks_of_plan);
                    DVector::from_vec(of_channel)
                })
                .collect();
            Trend {
                amplitudes: DMatrix::from_columns(&columns),
                folding: folding_of(&revolutions, &blocks_of_plan, highest + aliases),
                ..trend
            }
        });
        let variance = taper.variance_of_mean();
        Ok(Self {
            channels: names.iter().map(ToString::to_string).collect(),
            amplitudes: by_order(reduced.iter().map(|channel| channel.amplitudes.as_slice())),
            covariances: spectral
                .into_iter()
                .zip(&bands)
                .map(|(matrix, band)| OrderCovariance {
                    matrix: matrix * Complex64::from(variance),
                    freedoms: band.freedoms,
                    bins: band.bins.clone(),
                })
                .collect(),
            common,
            blocks,
            trend,
            spectrum: Spectrum {
                first_hz: reduced.first().map_or(0.0, |channel| channel.density.0),
                step_hz: reduced.first().map_or(0.0, |channel| channel.density.1),
                density: reduced.iter().map(|channel| channel.density.2.clone()).collect(),
            },
            lines: reduced
                .iter()
                .enumerate()
                .flat_map(|(channel, reduced)| {
                    reduced
                        .lines
                        .iter()
                        .map(move |line| SpectralLine { channel, ..*line })
                })
                .collect(),
            angle,
            kernel,
            block_weights: blocks_of_plan,
            variance_of_mean: variance,
        })
    }

    /// Orders 0 … K that the reduction finds in the real periodic signal c_0 + 2 Re Σ_{k=1}^{P} c_k e^{ikθ} of one
    /// channel, including aliasing; see [`AliasKernel::seen`].
    pub(crate) fn seen(&self, c: &[Complex64]) -> Vec<Complex64> {
        self.kernel.seen(c)
    }

    /// [`Self::seen`] of all channels: Fourier coefficients by order (rows, from 0) and channel (columns).
    pub(crate) fn of_channels(&self, coefficients: &DMatrix<Complex64>) -> DMatrix<Complex64> {
        let columns: Vec<DVector<Complex64>> = coefficients
            .column_iter()
            .map(|column| DVector::from_vec(self.seen(column.as_slice())))
            .collect();
        DMatrix::from_columns(&columns)
    }

    /// Amplitudes of the orders 0 … K that the reduction finds in samples at these spindle angles, those of the record,
    /// in revolutions.
    pub(crate) fn of_samples(
        &self,
        samples: impl Iterator<Item = f64>,
        revolutions: &[f64],
    ) -> Vec<Complex64> {
        let taper = Taper::new(revolutions.len());
        let weighted = samples
            .zip(revolutions)
            .enumerate()
            .map(|(sample, (value, revolution))| (*revolution, taper.weight(sample) * value));
        let mut right = Circle::new(self.kernel.orders()).sums(weighted);
        for entry in &mut right {
            *entry /= taper.sum();
        }
        self.kernel.solve(&right)
    }

    /// Trend of the amplitudes in samples at these spindle angles, as [`Trend::amplitudes`].
    pub(crate) fn trend_of(&self, samples: &[f64], revolutions: &[f64]) -> Vec<Complex64> {
        slope_of(samples, revolutions, &self.kernel, &self.block_weights)
    }

    /// Times of the reduced samples of a record, s after the first sample, and their spindle angles, in revolutions.
    pub(crate) fn sampled(&self, recording: &Recording) -> (Vec<f64>, Vec<f64>) {
        let times_s: Vec<f64> = reduced_range(recording, &self.angle)
            .map(|sample| sample as f64 / recording.sample_rate_hz)
            .collect();
        let revolutions = self.angle.revolutions_at(times_s.iter().copied());
        (times_s, revolutions)
    }

    /// Variance of an amplitude over that of a sample of white noise, Σw²/(Σw)².
    pub(crate) fn variance_of_mean(&self) -> f64 {
        self.variance_of_mean
    }

    /// The kernel a(p) of the samples.
    pub(crate) fn kernel(&self) -> &AliasKernel {
        &self.kernel
    }

    /// Squared distance of the amplitudes, over the orders 1 … K, from a prediction (rows: orders from 0, columns:
    /// channels).
    pub(crate) fn distance(&self, prediction: &DMatrix<Complex64>) -> SquaredDistance {
        let orders: Vec<usize> = (1..self.amplitudes.nrows()).collect();
        let difference = &self.amplitudes - prediction;
        distance::of_orders(&orders, &self.covariances, &self.common, &difference)
    }

    /// Hotelling's T² of one order from the same prediction, without the common part, and its distribution.
    pub(crate) fn distance_of_order(
        &self,
        order: usize,
        prediction: &DMatrix<Complex64>,
    ) -> (f64, Hotelling) {
        let difference: DVector<Complex64> = (self.amplitudes.row(order) - prediction.row(order)).transpose();
        let covariance = &self.covariances[order];
        (
            distance::of_order(order, covariance, &difference),
            Hotelling::new(order, self.channels.len(), covariance.freedoms),
        )
    }
}

/// Samples within the whole revolutions.
fn reduced_range(recording: &Recording, angle: &SpindleAngle) -> std::ops::Range<usize> {
    let edges_s = angle.edges_s();
    let sample =
        |time_s: f64| ((time_s * recording.sample_rate_hz).ceil().max(0.0) as usize).min(recording.len());
    sample(edges_s[0])..sample(edges_s[angle.count()])
}

/// Samples of the named channels within the range.
pub(crate) fn channels<'a>(
    recording: &'a Recording,
    names: &[&str],
    range: &std::ops::Range<usize>,
) -> Result<Vec<&'a [f64]>, DiagnoseError> {
    names
        .iter()
        .map(|name| {
            let channel = recording
                .channel(name)
                .ok_or_else(|| recording.lacks(format!("channel {name}")))?;
            let samples = &channel.samples[range.clone()];
            match samples.iter().position(|value| !value.is_finite()) {
                None => Ok(samples),
                Some(at) => Err(DiagnoseError::record(
                    &recording.path,
                    format!(
                        "channel {name} has a value that is not a number at {:.4} s",
                        recording.time_s(range.start + at)
                    ),
                )),
            }
        })
        .collect()
}

/// Highest order K of the reduction and P of its aliases, for the spindle frequency in revolutions per sample.
pub(crate) fn highest_orders(
    recording: &Recording,
    per_sample: f64,
    settings: &ReductionSettings,
) -> Result<(usize, usize), DiagnoseError> {
    let highest_of_rate = HIGHEST_OF_RATE.min(settings.highest_hz / recording.sample_rate_hz);
    let highest = (highest_of_rate / per_sample) as usize;
    if highest == 0 {
        return Err(DiagnoseError::record(
            &recording.path,
            format!(
                "no order of the spindle frequency {:.1} Hz lies below {:.1} Hz",
                per_sample * recording.sample_rate_hz,
                highest_of_rate * recording.sample_rate_hz
            ),
        ));
    }
    let aliases = (settings.alias_factor.max(1.0) * 0.5 / per_sample) as usize;
    Ok((highest, aliases.max(highest)))
}

/// Equal blocks that overlap by half, each of whole revolutions and longer than the slowest decay, `decay` samples; none
/// if fewer than two blocks follow each other. They lie where the weights of the record are one: beyond, two aliases
/// that nearly coincide may leave residuals larger than the noise.
fn block_weights(per_sample: f64, decay: f64, taper: &Taper) -> Vec<BlockWeights> {
    let flat = taper.flat();
    let revolutions = flat.len() as f64 * per_sample;
    let least = (decay * per_sample).ceil().max(LEAST_BLOCK_REVOLUTIONS);
    let count = (revolutions / least).floor().min(BLOCKS_MAX);
    if count < BLOCKS_MIN {
        return Vec::new();
    }
    let length = ((revolutions / count).floor() / per_sample) as usize;
    let weights = Taper::hann(length);
    (0..2 * count as usize - 1)
        .map(|block| BlockWeights {
            first: flat.start + block * length / 2,
            taper: weights,
        })
        .collect()
}

/// Cross-spectral matrix of each order, with the least noise that a channel is assumed to have.
fn spectral_matrices(reduced: &[ChannelReduction], plan: &Plan) -> Vec<DMatrix<Complex64>> {
    let floor = |channel: &ChannelReduction| (LEAST_RELATIVE_NOISE * channel.rms).powi(2).max(1e-200);
    plan.bands
        .iter()
        .enumerate()
        .map(|(order, band)| {
            let bins: Vec<&[Complex64]> = reduced
                .iter()
                .map(|channel| channel.bands[order].as_slice())
                .collect();
            let mut matrix = plan.spectrum.matrix(band, order, &bins);
            for (index, channel) in reduced.iter().enumerate() {
                matrix[(index, index)] += floor(channel);
            }
            matrix
        })
        .collect()
}

/// What blocks show of changes over time.
#[derive(Default)]
struct OverTime {
    common: Common,
    blocks: Vec<AmplitudeBlock>,
    trend: Option<Trend>,
}

/// The common part, the amplitudes by block and their trend.
fn over_time(
    reduced: &[ChannelReduction],
    spectral: &[DMatrix<Complex64>],
    plan: &Plan,
    first: usize,
) -> OverTime {
    let amplitudes = by_order(reduced.iter().map(|channel| channel.amplitudes.as_slice()));
    let mut deviations: Vec<DMatrix<Complex64>> = (0..plan.blocks.len())
        .map(|block| by_order(reduced.iter().map(|channel| channel.blocks[block].as_slice())))
        .collect();
    let blocks: Vec<AmplitudeBlock> = plan
        .blocks
        .iter()
        .zip(&deviations)
        .map(|(block, deviation)| AmplitudeBlock {
            centre_s: ((first + block.first) as f64 + 0.5 * (block.taper.count() - 1) as f64) / plan.rate_hz,
            amplitudes: &amplitudes + deviation,
        })
        .collect();
    let Some(of_block) = plan.blocks.first().map(|block| block.taper.variance_of_mean()) else {
        return OverTime::default();
    };
    let factors: Option<Vec<DMatrix<Complex64>>> = spectral
        .iter()
        .map(|matrix| Some(Cholesky::new(matrix * Complex64::from(of_block))?.l()))
        .collect();
    let of_record = plan.taper.variance_of_mean() / of_block;
    let independent = independent_combinations(plan);
    let common = |deviations: &[DMatrix<Complex64>]| {
        let factors = factors.as_ref().filter(|_| plan.blocks_forget);
        factors.map_or_else(Common::default, |factors| {
            Common::new(deviations, factors, &independent, of_record)
        })
    };
    let found = common(&deviations);
    let scale_s = plan.revolutions.len() as f64 / plan.rate_hz / 12.0_f64.sqrt();
    let slope = slope(&blocks, scale_s);
    for (deviation, block) in deviations.iter_mut().zip(&blocks) {
        *deviation -= &slope.amplitudes * Complex64::from((block.centre_s - slope.centre_s) / scale_s);
    }
    OverTime {
        common: found,
        trend: Some(Trend {
            amplitudes: slope.amplitudes,
            scale_s,
            variance: slope.variance / of_record,
            folding: Vec::new(),
            common: common(&deviations),
        }),
        blocks,
    }
}

/// Amplitudes by order (rows) and channel (columns).
fn by_order<'a>(channels: impl Iterator<Item = &'a [Complex64]>) -> DMatrix<Complex64> {
    let columns: Vec<DVector<Complex64>> = channels.map(DVector::from_column_slice).collect();
    DMatrix::from_columns(&columns)
}
