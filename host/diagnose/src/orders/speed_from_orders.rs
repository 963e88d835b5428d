//! Spindle frequency of a record without tachometer, from its orders. The speed is taken as constant.
//!
//! A grid of frequencies within ± 3 % of the speed in the sidecar is searched in the first revolutions for the largest
//! likelihood of orders in white noise of unknown variance per channel, −Σ_c ln(1 − share of the energy of channel c in
//! the orders). Then the record is lengthened by factors of two, and the frequency refined each time. With the residual
//! r of the orders at the frequency ω, weights w and the time t from the middle,
//!
//! d_k = Σ w t r e^{−ikθ}/Σ w t² = ik δω Y_k + error, error covariance S_k Σw²t²/(Σ w t²)²,
//! δω = Σ_k Re[(ikY_k)ᴴ S_k⁻¹ d_k] / Σ_k k² Y_kᴴ S_k⁻¹ Y_k, variance Σw²t²/(Σ w t²)² / (2 Σ_k k² Y_kᴴ S_k⁻¹ Y_k),
//!
//! with S_k the cross-spectral matrix between the lines. Without weights this is the Cramér–Rao bound.

use std::f64::consts::TAU;
use std::ops::Range;

use nalgebra::{Cholesky, DMatrix, DVector};
use num_complex::Complex64;
use rayon::prelude::*;
use realfft::RealFftPlanner;

use crate::error::DiagnoseError;
use crate::orders::alias_kernel::AliasKernel;
use crate::orders::channel_reduction::OrderFit;
use crate::orders::circle::Circle;
use crate::orders::reduction::{Orders, ReductionSettings, channels, highest_orders};
use crate::orders::spindle_angle::{SpindleAngle, check_revolutions};
use crate::orders::taper::Taper;
use crate::signal::grid::smooth_even;
use quietcut_recording::Recording;

/// Half width of the search about the speed in the sidecar, as a share of it: the slip of an induction motor at rated
/// load without speed control is up to 5 %, of most motors below 3 % (NEMA MG 1, designs A and B).
const SEARCH: f64 = 0.03;

/// Number of revolutions of the first search. An error of a grid step must not turn the phase of the highest order.
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
    let mut count = ((FIRST_REVOLUTIONS / recorded).min(1.0) * range.len() as f64) as usize;
    let mut per_sample = searched(&samples, count, start_hz / rate_hz, highest);
    loop {
        for _ in 0..REFINEMENTS {
            let refinement = Refinement::new(&samples, 0..count, per_sample, [highest, aliases]);
            per_sample += refinement.step_in_white_noise();
        }
        if count == range.len() {
            break;
        }
        count = (2 * count).min(range.len());
    }
    let ends_s = [first, recording.len()].map(|sample| sample as f64 / rate_hz);
    let angle = SpindleAngle::steady(per_sample * rate_hz, 0.0, ends_s);
    let orders = Orders::with_angle(recording, names, angle, settings)?;
    check_orders(recording, &orders)?;
    let refinement = Refinement::new(&samples, 0..range.len(), per_sample, [highest, aliases]);
    let (step, deviation) = refinement.step(&orders);
    Ok(SpindleAngle::steady(
        (per_sample + step) * rate_hz,
        deviation * rate_hz,
        ends_s,
    ))
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

/// Sums from which a step of the frequency follows.
struct Refinement {
    /// Amplitudes Y_k by order and channel.
    amplitudes: DMatrix<Complex64>,
    /// d_k by order and channel, t in samples.
    slopes: DMatrix<Complex64>,
    /// Variance of a sample of the residual, by channel.
    variances: Vec<f64>,
    /// Σw²t²/(Σ w t²)².
    spread: f64,
}

impl Refinement {
    fn new(
        channels: &[&[f64]],
        range: Range<usize>,
        per_sample: f64,
        [highest, aliases]: [usize; 2],
    ) -> Self {
        let count = range.len();
        let revolutions: Vec<f64> = (0..count).map(|sample| sample as f64 * per_sample).collect();
        let taper = Taper::new(count);
        let kernel = AliasKernel::new(highest, aliases, &revolutions, &taper);
        let circle = Circle::new(highest);
        let from_middle = |sample: usize| sample as f64 - 0.5 * (count - 1) as f64;
        let (mut moment, mut square) = (0.0, 0.0);
        for sample in 0..count {
            let lever = taper.weight(sample) * from_middle(sample);
            moment += lever * from_middle(sample);
            square += lever * lever;
        }
        let of_channels: Vec<(Vec<Complex64>, Vec<Complex64>, f64)> = channels
            .par_iter()
            .map(|samples| {
                let fit = OrderFit::new(&samples[range.clone()], &revolutions, &taper, &kernel);
                let levers = fit.residual.iter().enumerate().map(|(sample, value)| {
                    let lever = taper.weight(sample) * from_middle(sample);
                    (revolutions[sample], lever * value)
                });
                let slopes = circle.sums(levers).iter().map(|sum| sum / moment).collect();
                let energy: f64 = fit.residual.iter().map(|value| value * value).sum();
                (fit.amplitudes, slopes, energy / count as f64)
            })
            .collect();
        let matrix = |of: fn(&(Vec<Complex64>, Vec<Complex64>, f64)) -> &[Complex64]| {
            let columns: Vec<DVector<Complex64>> = of_channels
                .iter()
                .map(|channel| DVector::from_column_slice(of(channel)))
                .collect();
            DMatrix::from_columns(&columns)
        };
        Self {
            amplitudes: matrix(|channel| &channel.0),
            slopes: matrix(|channel| &channel.1),
            variances: of_channels.iter().map(|channel| channel.2).collect(),
            spread: square / (moment * moment),
        }
    }

    /// Change of the frequency, in revolutions per sample, for white noise independent between channels.
    fn step_in_white_noise(&self) -> f64 {
        let inverse = DVector::from_iterator(
            self.variances.len(),
            self.variances
                .iter()
                .map(|variance| Complex64::from(1.0 / variance.max(f64::MIN_POSITIVE))),
        );
        self.step_with(|_, vector| Some(vector.component_mul(&inverse))).0
    }

    /// Change of the frequency and standard deviation of its error, in revolutions per sample, for the noise between
    /// the lines.
    fn step(&self, orders: &Orders) -> (f64, f64) {
        let variance = orders.variance_of_mean();
        self.step_with(|order, vector| {
            let factor = Cholesky::new(orders.covariances[order].matrix.clone())?;
            Some(factor.solve(vector) * Complex64::from(variance))
        })
    }

    /// The step and its standard deviation; `solve` applies S_k⁻¹.
    fn step_with(
        &self,
        solve: impl Fn(usize, &DVector<Complex64>) -> Option<DVector<Complex64>>,
    ) -> (f64, f64) {
        let (mut above, mut below) = (0.0, 0.0);
        for order in 1..self.amplitudes.nrows() {
            let turned = self.amplitudes.row(order).transpose() * Complex64::new(0.0, order as f64);
            let Some(solved) = solve(order, &turned) else {
                continue;
            };
            above += solved.dotc(&self.slopes.row(order).transpose()).re;
            below += solved.dotc(&turned).re;
        }
        if below <= 0.0 {
            return (0.0, f64::INFINITY);
        }
        (above / below / TAU, (0.5 * self.spread / below).sqrt() / TAU)
    }
}
