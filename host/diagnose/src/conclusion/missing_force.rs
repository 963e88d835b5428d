//! The restoring force along the axis of a channel that the residual of this channel implies.
//!
//! The residual of a response y = H (F − f_r) is y − H F = −H f_r. At frequencies where the residual exceeds its noise,
//! dividing it by −H gives the missing force f_r. For records compared in force the residual is f_r itself.

use num_complex::Complex64;

use crate::baseline::Baseline;
use crate::criteria::{LEAST_AMPLITUDE, MISSING_FORCE_OVER_NOISE};
use crate::records::channel::Observed;
use crate::records::domain::Domain;
use crate::records::record::Record;
use quietcut_recording::Quantity;

/// Number of frequency bins over which the power of a channel's residual is averaged before it is compared with the
/// noise power.
const SMOOTHED: usize = 9;

/// Duration of the segments over which stiffness and damping of the missing force are fitted, in periods of the lowest
/// natural frequency. Each segment gives one amplitude.
const PERIODS: f64 = 2.0;

/// Restoring force along one axis that the baseline lacks, with the displacement and velocity of the tool along this
/// axis, at the samples of the record.
#[derive(Clone, Debug)]
pub struct MissingForce {
    /// Displacement of the tool along the axis at each sample, m.
    pub x: Vec<f64>,
    /// Velocity of the tool along the axis at each sample, m/s.
    pub v: Vec<f64>,
    /// Missing restoring force at each sample, N.
    pub force_n: Vec<f64>,
    /// Static stiffness of the baseline along the axis, N/m: one over the static compliance; 0 if that is not positive.
    pub stiffness: f64,
    /// Number of samples in each segment over which stiffness and damping of the missing force are fitted, at least 16.
    segment: usize,
}

/// Stiffness and damping of the missing force in one segment of a record, and the displacement amplitude of the
/// segment.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AtAmplitude {
    /// Displacement amplitude of the segment: largest distance of the displacement from its mean over the segment, m.
    pub amplitude_m: f64,
    /// Stiffness that the missing force adds: the least-squares slope of the force over the displacement in the
    /// segment, N/m.
    pub stiffness: f64,
    /// Damping that the missing force adds: the least-squares slope of the force over the velocity in the segment, N
    /// s/m.
    pub damping: f64,
}

impl MissingForce {
    /// The missing force that the residual of a channel implies; `None` for a channel of force in the response domain,
    /// for a channel that reads no axis, or for an axis without motion.
    pub(crate) fn of(
        baseline: &Baseline<'_>,
        record: &Record,
        channel: &Observed,
        residual: &[f64],
    ) -> Option<Self> {
        let axis = (0..3).find(|axis| channel.pickup.weights[*axis] != 0.0)?;
        let every = record.grid.finer();
        let thinned = |signal: &[f64]| signal.iter().copied().step_by(every).collect::<Vec<f64>>();
        let (x, v) = (thinned(&record.motion.x[axis]), thinned(&record.motion.v[axis]));
        if x.len() != residual.len() || v.len() != residual.len() {
            return None;
        }
        let force_n = match record.domain {
            Domain::Force => residual.to_vec(),
            Domain::Response if channel.pickup.quantity == Quantity::Force => return None,
            Domain::Response => response_over(record, channel, axis, residual),
        };
        let at_rest = baseline.receptance.at(0.0)[(axis, axis)].re;
        // For a structure without oscillating modes, a segment is a twentieth of the record.
        let duration_s = residual.len() as f64 / record.grid.rate_hz();
        let segment_s = baseline.lowest_hz().map_or(0.05 * duration_s, |hz| PERIODS / hz);
        Some(Self {
            x,
            v,
            force_n,
            stiffness: if at_rest > 0.0 { at_rest.recip() } else { 0.0 },
            segment: ((segment_s * record.grid.rate_hz()) as usize).max(16),
        })
    }

    /// Stiffness and damping of the missing force in each whole segment of the record, in order of time, without
    /// segments whose amplitude is at most `LEAST_AMPLITUDE` of the largest.
    pub fn at_amplitudes(&self) -> Vec<AtAmplitude> {
        let all: Vec<AtAmplitude> = self
            .x
            .chunks_exact(self.segment)
            .zip(self.v.chunks_exact(self.segment))
            .zip(self.force_n.chunks_exact(self.segment))
            .map(|((x, v), force)| {
                let middle = |a: &[f64]| a.iter().sum::<f64>() / a.len() as f64;
                let (x0, f0) = (middle(x), middle(force));
                let share = |by: &dyn Fn(usize) -> f64| {
                    let whole: f64 = (0..x.len()).map(|n| by(n) * by(n)).sum();
                    let part: f64 = (0..x.len()).map(|n| by(n) * (force[n] - f0)).sum();
                    if whole > 0.0 { part / whole } else { 0.0 }
                };
                AtAmplitude {
                    amplitude_m: x.iter().map(|x| (x - x0).abs()).fold(0.0, f64::max),
                    stiffness: share(&|n| x[n] - x0),
                    damping: share(&|n| v[n]),
                }
            })
            .collect();
        let largest = all.iter().map(|at| at.amplitude_m).fold(0.0, f64::max);
        all.into_iter()
            .filter(|at| at.amplitude_m > LEAST_AMPLITUDE * largest)
            .collect()
    }
}

/// Missing force along the channel's axis, N, at the samples of the record: −residual/response per newton, from the
/// bins in the band of the record where the residual power, averaged over neighbouring bins, exceeds
/// `MISSING_FORCE_OVER_NOISE` times the noise power. The weight of a bin is 1 minus the ratio of the latter product to
/// the averaged power.
fn response_over(record: &Record, channel: &Observed, axis: usize, residual: &[f64]) -> Vec<f64> {
    let grid = &record.grid;
    let spectrum = grid.spectrum(residual);
    let power: Vec<f64> = spectrum.iter().map(|bin| bin.norm_sqr()).collect();
    let noise = channel.deviation.powi(2) * residual.len() as f64;
    let transfer = record.seen_by(channel);
    let force: Vec<Complex64> = (0..spectrum.len())
        .map(|bin| {
            let omega = grid.omega(bin);
            let near = &power[bin.saturating_sub(SMOOTHED / 2)..(bin + SMOOTHED / 2 + 1).min(power.len())];
            let mean = near.iter().sum::<f64>() / near.len() as f64;
            let weight = 1.0 - MISSING_FORCE_OVER_NOISE * noise / mean.max(f64::MIN_POSITIVE);
            let response = transfer[bin][(axis, axis)] * channel.factor(omega) * channel.pickup.weights[axis];
            let within = bin > 0 && omega <= std::f64::consts::TAU * record.band_hz;
            if within && weight > 0.0 && response.norm() > 0.0 {
                -spectrum[bin] / response * weight
            } else {
                Complex64::ZERO
            }
        })
        .collect();
    grid.samples(&force)
}
