//! Spindle angle of a speed that wanders, from the samples of a record without tachometer.
//!
//! With s(θ) the mean signal of a channel over the revolution, a revolution in which the spindle is ahead of the angle θ by δ has the
//! samples s(θ + δ) + noise ≈ s + δ·s′ + noise, and δ = Σ (x − s)·s′/σ² over Σ s′²/σ², over all channels with their noise σ. Each
//! revolution so has a mark in its middle, from which the angle follows as from the edges of a tachometer. Where the angle is
//! still wrong, high orders are smeared out: low ones begin.

use std::f64::consts::TAU;

use num_complex::Complex64;

use crate::error::DiagnoseError;
use crate::orders::circle::Circle;
use crate::orders::reduction::{Orders, ReductionSettings};
use crate::orders::spindle_angle::SpindleAngle;
use quietcut_recording::Recording;

/// Highest order of each round, over the order of the largest amplitude.
const ROUNDS: [f64; 5] = [1.0, 2.0, 4.0, f64::INFINITY, f64::INFINITY];

/// The angle of a recording that follows its speed, from one at the mean speed.
///
/// # Errors
/// As [`Orders::with_angle`].
pub(crate) fn followed(
    recording: &Recording,
    names: &[&str],
    mut angle: SpindleAngle,
    settings: &ReductionSettings,
) -> Result<SpindleAngle, DiagnoseError> {
    for round in ROUNDS {
        let orders = Orders::with_angle(recording, names, angle, settings)?;
        let highest = (round * strongest(&orders) as f64).min((orders.amplitudes.nrows() - 1) as f64);
        let marks_s = marks_s(recording, &orders, highest as usize);
        angle = SpindleAngle::from_edges(marks_s, recording.sample_rate_hz);
    }
    Ok(angle)
}

/// Order of the largest amplitude over the noise of its channel.
fn strongest(orders: &Orders) -> usize {
    let over_noise = |order: usize| -> f64 {
        let noise = &orders.covariances[order].matrix;
        (0..orders.amplitudes.ncols())
            .map(|channel| {
                orders.amplitudes[(order, channel)].norm_sqr()
                    / noise[(channel, channel)].re.max(f64::MIN_POSITIVE)
            })
            .sum()
    };
    (1..orders.amplitudes.nrows())
        .max_by(|a, b| over_noise(*a).total_cmp(&over_noise(*b)))
        .unwrap_or(1)
}

/// Times, s after the first sample, at which the spindle is in the middle of each revolution, from the orders up to `highest`.
fn marks_s(recording: &Recording, orders: &Orders, highest: usize) -> Vec<f64> {
    let (times_s, revolutions) = orders.sampled(recording);
    let angle = &orders.angle;
    let count = angle.count();
    let mut sums = vec![[0.0; 2]; count];
    let circle = Circle::new(orders.amplitudes.nrows());
    for (index, name) in orders.channels.iter().enumerate() {
        let Some(channel) = recording.channel(name) else {
            continue;
        };
        let amplitudes: Vec<Complex64> = orders.amplitudes.column(index).iter().copied().collect();
        let slopes: Vec<Complex64> = amplitudes
            .iter()
            .take(highest + 1)
            .enumerate()
            .map(|(order, amplitude)| amplitude * Complex64::new(0.0, order as f64))
            .collect();
        let (mean, slope) = (circle.series(&amplitudes), circle.series(&slopes));
        let first =
            (times_s.first().copied().unwrap_or_default() * recording.sample_rate_hz).round() as usize;
        let left: Vec<f64> = channel.samples[first..first + revolutions.len()]
            .iter()
            .zip(&revolutions)
            .map(|(sample, revolution)| sample - mean.at(*revolution))
            .collect();
        let variance = left.iter().map(|left| left * left).sum::<f64>() / left.len().max(1) as f64;
        for (left, revolution) in left.iter().zip(&revolutions) {
            let number = (*revolution as usize).min(count - 1);
            let slope = slope.at(*revolution);
            sums[number][0] += left * slope / variance.max(f64::MIN_POSITIVE);
            sums[number][1] += slope * slope / variance.max(f64::MIN_POSITIVE);
        }
    }
    let middles_s = angle.times_at((0..count).map(|number| number as f64 + 0.5));
    middles_s
        .into_iter()
        .zip(sums)
        .map(|(middle_s, [product, square])| {
            let ahead_rad = product / square.max(f64::MIN_POSITIVE);
            middle_s - ahead_rad / (TAU * angle.frequency_hz)
        })
        .collect()
}
