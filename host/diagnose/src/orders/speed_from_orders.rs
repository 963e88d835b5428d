//! Spindle frequency of a record without tachometer, from its orders. The speed is taken as constant.
//!
//! A grid of frequencies within ± 3 % of the speed in the sidecar is searched in the first revolutions for the largest
//! likelihood of orders in white noise of unknown variance per channel, −Σ_c ln(1 − share of the energy of channel c in
//! the orders). Then the record is lengthened by factors of two, and the frequency refined each time by Gauss–Newton
//! steps. With the residual r of the fit of all orders up to P, and g the derivative of the fitted signal with respect to
//! the frequency, less its own fit (so that it is the derivative of the residual), R and G their Fourier transforms and
//! S_k the cross-spectral matrix between the lines,
//!
//! δω = Re Σ Gᴴ S_k⁻¹ R / Σ Gᴴ S_k⁻¹ G, variance n/(2 Σ Gᴴ S_k⁻¹ G) for n samples,
//!
//! summed over the bins about each order k. This is the Cramér–Rao bound. Aliases have a prior, E |c_k|² ∝ 1/k². Where
//! they lie beside orders, they leave less of g, and the variance is larger.

use std::f64::consts::TAU;
use std::ops::Range;

use nalgebra::{Cholesky, DMatrix, DVector};
use num_complex::Complex64;
use quietcut_numerics::roots::minimum;
use rayon::prelude::*;
use realfft::RealFftPlanner;

use crate::error::DiagnoseError;
use crate::orders::alias_kernel::AliasKernel;
use crate::orders::channel_reduction::OrderFit;
use crate::orders::circle::Circle;
use crate::orders::reduction::{Orders, ReductionSettings, channels, highest_orders};
use crate::orders::spindle_angle::{SpindleAngle, check_revolutions};
use crate::orders::taper::Taper;
use crate::signal::dot::dot;
use crate::signal::grid::smooth_even;
use quietcut_recording::Recording;

/// Half width of the search about the speed in the sidecar, as a share of it. A wider search finds more false combs, at
/// ratios of small whole numbers to the true one, and takes longer. Unfounded.
const SEARCH: f64 = 0.03;

/// Number of revolutions of the first search. Its grid has a number of points proportional to it; fewer revolutions
/// separate the orders from the noise less well. Unfounded.
const FIRST_REVOLUTIONS: f64 = 32.0;

/// Steps of the first grid per period of the highest order over the record: the loss at half a step is (π/8)²/6 = 3 %.
const STEPS_PER_PERIOD: f64 = 8.0;

/// Steps of the refinement at each length. The error after a step is of second order in that before.
const REFINEMENTS: usize = 3;

/// Probability that noise without orders is accepted.
const FALSE_SPEED: f64 = 1e-6;

/// The spindle angle at constant speed, with θ = 0 at an unknown phase, from the orders of the channels `names`.
///
/// # Errors
/// The sidecar states no spindle speed, a channel is missing, fewer than ten revolutions are recorded after
/// `settings.settled_s`, or the channels show no orders within ± 3 % of the speed in the sidecar.
pub(crate) fn angle_from_orders(
    recording: &Recording,
    names: &[&str],
    settings: &ReductionSettings,
) -> Result<SpindleAngle, DiagnoseError> {
    let Some(rpm) = recording.sidecar.cut.and_then(|cut| cut.spindle_rpm) else {
        return Err(recording
            .lacks("channel tacho and spindle_rpm in [cut] of the sidecar, of which one is required")
            .into());
    };
    let rate_hz = recording.sample_rate_hz;
    let first = ((settings.settled_s * rate_hz).ceil() as usize).min(recording.len());
    let range = first..recording.len();
    let start_hz = rpm / 60.0;
    let recorded = range.len() as f64 / rate_hz * start_hz;
    check_revolutions(recording, recorded as usize)?;
    let samples = channels(recording, names, &range)?;
    let (highest, aliases) = highest_orders(recording, start_hz / rate_hz, settings)?;
    let beginning = ((FIRST_REVOLUTIONS / recorded).min(1.0) * range.len() as f64) as usize;
    let near = searched(&samples, beginning, start_hz / rate_hz, highest);
    let per_sample = lengthened(&samples, beginning, near, [highest, aliases]);
    let ends_s = [first, recording.len()].map(|sample| sample as f64 / rate_hz);
    let angle = SpindleAngle::steady(per_sample * rate_hz, 0.0, ends_s);
    let orders = Orders::with_angle(recording, names, angle, settings)?;
    check_orders(recording, &orders)?;
    let derivatives = Derivatives::new(&samples, per_sample, [highest, aliases]);
    let (step, mut deviation) = derivatives.step(&orders, per_sample);
    if aliases_coincide(per_sample, range.len(), aliases) {
        deviation = deviation.hypot(AMBIGUITY / (highest as f64 * range.len() as f64));
    }
    Ok(SpindleAngle::steady(
        (per_sample + step) * rate_hz,
        deviation * rate_hz,
        ends_s,
    ))
}

/// Spindle frequency in revolutions per sample, refined from `per_sample` in the first `count` samples, then in twice as
/// many, up to all. Where aliases coincide with orders, it is searched, since Gauss–Newton steps may fail.
fn lengthened(channels: &[&[f64]], mut count: usize, mut per_sample: f64, orders: [usize; 2]) -> f64 {
    let whole = channels.first().map_or(0, |samples| samples.len());
    let mut is_first = true;
    loop {
        let beginning: Vec<&[f64]> = channels.iter().map(|samples| &samples[..count]).collect();
        let is_ambiguous = aliases_coincide(per_sample, count, orders[1]);
        if is_first || is_ambiguous {
            per_sample = searched_with_aliases(&beginning, per_sample, orders);
        }
        if !is_ambiguous {
            for _ in 0..REFINEMENTS {
                per_sample += Derivatives::new(&beginning, per_sample, orders).step_in_white_noise();
            }
        }
        if count == whole {
            return per_sample;
        }
        is_first = false;
        count = (2 * count).min(whole);
    }
}

/// # Errors
/// The amplitudes are those of noise.
fn check_orders(recording: &Recording, orders: &Orders) -> Result<(), DiagnoseError> {
    let nothing = DMatrix::zeros(orders.amplitudes.nrows(), orders.amplitudes.ncols());
    let distance = orders.distance(&nothing);
    if distance.value > distance.quantile(1.0 - FALSE_SPEED) {
        return Ok(());
    }
    Err(DiagnoseError::record(
        &recording.path,
        format!(
            "has no tachometer, and its channels show no orders of a spindle within {:.0} % of the speed in the sidecar",
            100.0 * SEARCH
        ),
    ))
}

/// Spindle frequency of largest likelihood within the search range, in revolutions per sample, from the first `count`
/// samples.
fn searched(channels: &[&[f64]], count: usize, start: f64, highest: usize) -> f64 {
    let taper = Taper::new(count);
    let length = smooth_even(4 * count);
    let plan = RealFftPlanner::new().plan_fft_forward(length);
    let spectra: Vec<Vec<f64>> = channels
        .iter()
        .map(|samples| {
            let mean = samples[..count].iter().sum::<f64>() / count as f64;
            let mut padded = vec![0.0; length];
            for (sample, to) in padded.iter_mut().enumerate().take(count) {
                *to = taper.weight(sample) * (samples[sample] - mean);
            }
            let energy: f64 = padded.iter().map(|value| value * value).sum();
            let mut bins = plan.make_output_vec();
            // It fails only if lengths differ, and here they are equal.
            let _ = plan.process(&mut padded, &mut bins);
            // Share of the energy of a channel in a line whose peak is this bin.
            let scale = 2.0 * taper.variance_of_mean() / energy.max(f64::MIN_POSITIVE);
            bins.iter().map(|bin| scale * bin.norm_sqr()).collect()
        })
        .collect();
    let likelihood = |per_sample: f64| {
        let shares = spectra.iter().map(|spectrum| {
            let comb = (1..=highest).map(|order| {
                let place = order as f64 * per_sample * length as f64;
                let bin = (place as usize).min(spectrum.len() - 2);
                let u = (place - bin as f64).min(1.0);
                (1.0 - u) * spectrum[bin] + u * spectrum[bin + 1]
            });
            // A share of 1 is that of a signal without noise.
            (1.0 - comb.sum::<f64>()).max(1e-12)
        });
        -shares.map(f64::ln).sum::<f64>()
    };
    let step = 1.0 / (STEPS_PER_PERIOD * highest as f64 * count as f64);
    let half = (SEARCH * start / step).ceil() as i64;
    (-half..=half)
        .map(|index| start + step * index as f64)
        .map(|per_sample| (likelihood(per_sample), per_sample))
        .max_by(|a, b| a.0.total_cmp(&b.0))
        .map_or(start, |(_, per_sample)| per_sample)
}

/// Standard deviation of the frequency where aliases coincide with orders, in periods of the highest order over the
/// record: the phase of such an order may drift by that of its alias. In the test of records without tachometer such
/// records err by up to 0.33; that this is about two standard deviations is unfounded.
const AMBIGUITY: f64 = 0.15;

/// Half width of the search with aliases, in periods of the highest order over the record, and its number of steps to
/// each side.
const ALIAS_SEARCH: (f64, i32) = (0.75, 24);

/// Frequency near `start`, in revolutions per sample, of largest likelihood of orders and aliases in white noise: the
/// least Σ_c yᵀ r/σ_c², r the residual with the prior of the aliases. Aliases that nearly coincide with orders bend this
/// function, so that Gauss–Newton steps from afar may fail.
fn searched_with_aliases(channels: &[&[f64]], start: f64, [highest, aliases]: [usize; 2]) -> f64 {
    let count = channels.first().map_or(0, |samples| samples.len());
    let taper = Taper::even(count);
    let angles = |per_sample: f64| {
        (0..count)
            .map(|sample| sample as f64 * per_sample)
            .collect::<Vec<f64>>()
    };
    let revolutions = angles(start);
    let kernel = AliasKernel::new(highest, aliases, &revolutions, &taper);
    let models: Vec<(Vec<f64>, f64)> = channels
        .par_iter()
        .map(|samples| {
            let (fit, penalties) = fitted_with_prior(samples, &revolutions, &taper, &kernel);
            (
                penalties,
                dot(&fit.residual, &fit.residual).max(f64::MIN_POSITIVE),
            )
        })
        .collect();
    let misfit = |per_sample: f64| {
        let revolutions = angles(per_sample);
        let kernel = AliasKernel::new(highest, aliases, &revolutions, &taper);
        let of_channels: Vec<f64> = channels
            .par_iter()
            .zip(&models)
            .map(|(samples, (penalties, energy))| {
                let fit = OrderFit::new(samples, &revolutions, &taper, &kernel, penalties);
                dot(samples, &fit.residual) / energy
            })
            .collect();
        of_channels.iter().sum::<f64>()
    };
    let step = ALIAS_SEARCH.0 / (f64::from(ALIAS_SEARCH.1) * highest as f64 * count as f64);
    let best = (-ALIAS_SEARCH.1..=ALIAS_SEARCH.1)
        .map(|index| start + step * f64::from(index))
        .map(|per_sample| (misfit(per_sample), per_sample))
        .min_by(|a, b| a.0.total_cmp(&b.0))
        .map_or(start, |(_, per_sample)| per_sample);
    minimum([best - step, best + step], 0.01 * step, misfit)
}

/// True if an alias lies within a cell of width 1/T of an order, or two aliases of each other.
fn aliases_coincide(per_sample: f64, count: usize, aliases: usize) -> bool {
    (1..=2 * aliases)
        .map(|apart| apart as f64 * per_sample)
        .filter(|cycles| cycles.round() > 0.0)
        .any(|cycles| (cycles - cycles.round()).abs() * (count as f64) < 1.0)
}

/// Fit of a channel with the prior of its aliases, and their penalties.
fn fitted_with_prior(
    samples: &[f64],
    revolutions: &[f64],
    taper: &Taper,
    kernel: &AliasKernel,
) -> (OrderFit, Vec<f64>) {
    let mut penalties = vec![0.0; kernel.orders() + 1];
    penalties.resize(kernel.aliases() + 1, 1.0);
    let mut fit = OrderFit::new(samples, revolutions, taper, kernel, &penalties);
    for _ in 0..PRIORS {
        penalties = fit.penalties(taper, kernel);
        fit = OrderFit::new(samples, revolutions, taper, kernel, &penalties);
    }
    (fit, penalties)
}

/// Largest distance from an order, in cells of width 1/T, of the bins that a step uses. The transform of g falls with
/// the distance x as 1/x; 97 % of its energy lie within 32 cells.
const CELLS: f64 = 32.0;

/// Updates of the noise from which the prior of the aliases follows; the first removes half of each alias.
const PRIORS: usize = 2;

/// Residuals r of all channels and their derivatives g with respect to the frequency in revolutions per sample.
struct Derivatives {
    of: Vec<[Vec<f64>; 2]>,
}

impl Derivatives {
    fn new(channels: &[&[f64]], per_sample: f64, [highest, aliases]: [usize; 2]) -> Self {
        let count = channels.first().map_or(0, |samples| samples.len());
        let revolutions: Vec<f64> = (0..count).map(|sample| sample as f64 * per_sample).collect();
        let taper = Taper::even(count);
        let kernel = AliasKernel::new(highest, aliases, &revolutions, &taper);
        let circle = Circle::new(aliases);
        let of_channel = |samples: &&[f64]| {
            // Aliases that nearly coincide with orders would take the derivative of these too; the prior keeps them small.
            let (fit, penalties) = fitted_with_prior(samples, &revolutions, &taper, &kernel);
            let turned: Vec<Complex64> = fit
                .with_aliases
                .iter()
                .enumerate()
                .map(|(order, c)| c * Complex64::new(0.0, TAU * order as f64))
                .collect();
            let series = circle.series(&turned);
            let derivative: Vec<f64> = revolutions
                .iter()
                .enumerate()
                .map(|(sample, at)| (sample as f64 - 0.5 * (count - 1) as f64) * series.at(*at))
                .collect();
            let derivative = OrderFit::new(&derivative, &revolutions, &taper, &kernel, &penalties).residual;
            [fit.residual, derivative]
        };
        Self {
            of: channels.par_iter().map(of_channel).collect(),
        }
    }

    /// Gauss–Newton step of the frequency, in revolutions per sample, for white noise independent between channels.
    fn step_in_white_noise(&self) -> f64 {
        let (mut above, mut below) = (0.0, 0.0);
        for [residual, derivative] in &self.of {
            let variance = dot(residual, residual).max(f64::MIN_POSITIVE);
            above += dot(derivative, residual) / variance;
            below += dot(derivative, derivative) / variance;
        }
        if below > 0.0 { above / below } else { 0.0 }
    }

    /// Gauss–Newton step of the frequency and standard deviation of its error, in revolutions per sample, for the noise
    /// between the lines.
    fn step(&self, orders: &Orders, per_sample: f64) -> (f64, f64) {
        let count = self.of.first().map_or(0, |of| of[0].len());
        let length = smooth_even(count);
        let plan = RealFftPlanner::new().plan_fft_forward(length);
        let half = CELLS.min(0.5 * count as f64 * per_sample) * length as f64 / count as f64;
        let ranges: Vec<Range<usize>> = (1..orders.covariances.len())
            .map(|order| order as f64 * per_sample * length as f64)
            .map(|centre| (centre - half).ceil() as usize..((centre + half) as usize).min(length / 2))
            .collect();
        let bins_of = |samples: &Vec<f64>| {
            let mut padded = samples.clone();
            padded.resize(length, 0.0);
            let mut bins = plan.make_output_vec();
            // It fails only if lengths differ, and here they are equal.
            let _ = plan.process(&mut padded, &mut bins);
            let about = ranges.iter().map(|range| bins[range.clone()].to_vec());
            about.collect::<Vec<Vec<Complex64>>>()
        };
        let bins: Vec<[Vec<Vec<Complex64>>; 2]> = self
            .of
            .par_iter()
            .map(|[residual, derivative]| [bins_of(residual), bins_of(derivative)])
            .collect();
        let (mut above, mut below, mut spread) = (0.0, 0.0, 0.0);
        for (index, range) in ranges.iter().enumerate() {
            let covariance = &orders.covariances[index + 1];
            let Some(factor) = Cholesky::new(covariance.matrix.clone()) else {
                continue;
            };
            // With S estimated from ν values (complex Wishart, q = ν − C), the variance is larger by ν²/(q² − 1).
            let rest = covariance.freedoms - bins.len() as f64;
            let estimated = covariance.freedoms.powi(2) / (rest * rest - 1.0);
            for bin in 0..range.len() {
                let column = |part: usize| {
                    let values = bins.iter().map(|channel| channel[part][index][bin]);
                    DVector::from_iterator(bins.len(), values)
                };
                let derivative = column(1);
                let solved = factor.solve(&derivative) * Complex64::from(orders.variance_of_mean());
                above += solved.dotc(&column(0)).re;
                let information = solved.dotc(&derivative).re;
                below += information;
                spread += estimated * information;
            }
        }
        if below <= 0.0 {
            return (0.0, f64::INFINITY);
        }
        // Zero padding divides the bins; each counts for fewer independent values.
        let variance = 0.5 * length as f64 * spread / (below * below);
        (above / below, variance.sqrt())
    }
}
