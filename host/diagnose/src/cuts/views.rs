//! Residuals of cuts for pictures and words.

use nalgebra::DMatrix;
use num_complex::Complex64;

use super::record::ReducedCut;
use super::selection::Explanation;
use crate::baseline::pickup_of;
use crate::conclusion::places::{Excess, FALSE_PLACE, Place, PlaceKind, merged};
use crate::conclusion::residual_views::{ResidualView, SpindleMotionView};
use crate::orders::circle::Circle;
use crate::signal::noise::rms;
use quietcut_recording::Recording;

/// Views of every channel of every record.
pub(super) fn views(
    baseline: &Explanation<'_>,
    best: Option<&Explanation<'_>>,
    records: &[ReducedCut],
    recordings: &[Recording],
) -> Vec<ResidualView> {
    let teeth = baseline.space.baseline.case.tool().map_or(1, |tool| tool.teeth);
    let mut all = Vec::new();
    for (number, (record, recording)) in records.iter().zip(recordings).enumerate() {
        let series = Samples::new(record, recording);
        for (index, name) in record.orders.channels.iter().enumerate() {
            let Some(channel) = recording.channel(name) else {
                continue;
            };
            let measured = series.within(&channel.samples);
            let of = |explanation: &Explanation<'_>| {
                series.residual(&measured, explanation.fit.coefficients(number), index)
            };
            let own: Vec<Complex64> = record.orders.amplitudes.column(index).iter().copied().collect();
            let asynchronous = series.without(&measured, &own);
            let residual = of(baseline);
            all.push(ResidualView {
                number: number + 1,
                record: record.path.display().to_string(),
                channel: name.clone(),
                unit: pickup_of(name).map_or("", |pickup| pickup.quantity.unit()),
                rate_hz: record.rate_hz,
                highest_hz: 0.5 * record.rate_hz,
                deviation: rms(&asynchronous),
                spindle_motion: Some(SpindleMotionView {
                    rpm: 60.0 * record.conditions.spindle_hz,
                    teeth,
                    measured: series.strobe(&measured, teeth),
                    residual: series.strobe(&residual, teeth),
                }),
                left: best.map_or_else(Vec::new, of),
                missing: None,
                measured,
                residual,
            });
        }
    }
    all
}

/// The whole revolutions of a record.
struct Samples {
    first: usize,
    /// Spindle angle of each sample, revolutions.
    revolutions: Vec<f64>,
    highest: usize,
}

impl Samples {
    fn new(record: &ReducedCut, recording: &Recording) -> Self {
        let angle = &record.orders.angle;
        let edges_s = angle.edges_s();
        let sample = |time_s: f64| ((time_s * record.rate_hz).ceil().max(0.0) as usize).min(recording.len());
        let (first, last) = (sample(edges_s[0]), sample(edges_s[angle.count()]));
        Self {
            first,
            revolutions: angle.revolutions_at((first..last).map(|sample| sample as f64 / record.rate_hz)),
            highest: record.highest,
        }
    }

    fn within(&self, samples: &[f64]) -> Vec<f64> {
        samples[self.first..self.first + self.revolutions.len()].to_vec()
    }

    /// `measured` minus the periodic signal of one column of Fourier coefficients and a constant.
    fn residual(&self, measured: &[f64], coefficients: &DMatrix<Complex64>, column: usize) -> Vec<f64> {
        let coefficients: Vec<Complex64> = coefficients.column(column).iter().copied().collect();
        self.without(measured, &coefficients)
    }

    fn without(&self, measured: &[f64], coefficients: &[Complex64]) -> Vec<f64> {
        let circle = Circle::new(self.highest.max(coefficients.len()));
        let series = circle.series(coefficients);
        let mut residual: Vec<f64> = measured
            .iter()
            .zip(&self.revolutions)
            .map(|(sample, revolution)| sample - series.at(*revolution))
            .collect();
        let mean = residual.iter().sum::<f64>() / residual.len().max(1) as f64;
        residual.iter_mut().for_each(|sample| *sample -= mean);
        residual
    }

    /// Values at the passings of a tooth through immersion angle 0, the teeth taken as equally pitched, with the number
    /// of the passing.
    fn strobe(&self, samples: &[f64], teeth: usize) -> Vec<(u32, f64)> {
        let mut found = Vec::new();
        for (index, pair) in self.revolutions.windows(2).enumerate() {
            let [from, to] = [pair[0], pair[1]].map(|revolution| revolution * teeth as f64);
            if from.floor() < to.floor() {
                let share = (to.floor() - from) / (to - from);
                found.push((
                    found.len() as u32,
                    samples[index] + share * (samples[index + 1] - samples[index]),
                ));
            }
        }
        found
    }
}

/// The order and channel of the largest deviation of an explanation, in words.
pub(super) fn place(explanation: &Explanation<'_>, records: &[ReducedCut]) -> String {
    let all = deviations(explanation, records);
    let worst = all.iter().max_by(|a, b| a.energy.total_cmp(&b.energy));
    worst.map_or_else(String::new, |worst| {
        let record = &records[worst.record - 1];
        format!(
            "{} of {}: order {} of the spindle ({:.2} Hz), {:.1} standard deviations of its error",
            worst.channel,
            record.path.display(),
            worst.from,
            worst.from * record.conditions.spindle_hz,
            worst.energy.sqrt()
        )
    })
}

/// The orders that deviate more than their errors do.
pub(super) fn places(explanation: &Explanation<'_>, records: &[ReducedCut]) -> Vec<Place> {
    let mut all = deviations(explanation, records);
    // The square of a complex deviation is exponential.
    let most = (all.len() as f64 / FALSE_PLACE).ln();
    all.retain(|cell| cell.energy > most);
    all.iter_mut().for_each(|cell| cell.energy -= 1.0);
    merged(PlaceKind::Order, all, 1.0)
}

/// The squared deviations of all orders but 0 of an explanation, in variances of their errors.
fn deviations(explanation: &Explanation<'_>, records: &[ReducedCut]) -> Vec<Excess> {
    let mut all = Vec::new();
    for (number, (record, error)) in records.iter().zip(explanation.fit.errors()).enumerate() {
        let squares = record.errors.squared_deviations(error);
        for (channel, name) in record.orders.channels.iter().enumerate() {
            all.extend((1..error.nrows()).map(|order| Excess {
                record: number + 1,
                channel: name.clone(),
                from: order as f64,
                to: order as f64,
                energy: squares[(order, channel)],
            }));
        }
    }
    all
}
