//! Residuals of cuts for pictures and words.

use nalgebra::DMatrix;
use num_complex::Complex64;

use super::record::ReducedCut;
use super::selection::Explanation;
use crate::baseline::pickup_of;
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
    let mut worst: Option<(f64, String)> = None;
    for (record, error) in records.iter().zip(explanation.fit.errors()) {
        for order in 1..error.nrows() {
            let covariance = &record.orders.covariances[order].matrix;
            for (index, name) in record.orders.channels.iter().enumerate() {
                let deviations = error[(order, index)].norm() / covariance[(index, index)].re.sqrt();
                if worst.as_ref().is_none_or(|(most, _)| deviations > *most) {
                    let hertz = order as f64 * record.conditions.spindle_hz;
                    let text = format!(
                        "{name} of {}: order {order} of the spindle ({hertz:.2} Hz), {deviations:.1} standard deviations of its error",
                        record.path.display()
                    );
                    worst = Some((deviations, text));
                }
            }
        }
    }
    worst.map_or_else(String::new, |(_, text)| text)
}
