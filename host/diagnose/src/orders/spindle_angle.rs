//! Spindle angle θ(t) of the samples of a record, from one tachometer edge per revolution or at a constant speed.
//!
//! θ = 0 at the rising edge that begins a revolution: immersion angle 0 of tooth 1. The number of revolutions θ/2π is a
//! [`SmoothingSpline`] over time: edge k is at θ = 2πk with an error, the jitter of the tachometer, whose variance and
//! whose ratio to the wander of the speed follow from the edges themselves.

use std::f64::consts::TAU;

use crate::error::DiagnoseError;
use crate::motion::spindle_motion::SpindleMotion;
use crate::orders::smoothing_spline::SmoothingSpline;
use quietcut_recording::Recording;

/// Spindle angle over the whole revolutions of a record.
#[derive(Clone, Debug)]
pub(crate) struct SpindleAngle {
    /// Beginnings of the revolutions and the end of the last one, s after the first sample.
    edges_s: Vec<f64>,
    /// Number of revolutions since the first edge over the time since the first edge, in mean revolutions.
    revolutions: SmoothingSpline,
    /// Mean spindle frequency, Hz.
    pub frequency_hz: f64,
    /// Standard deviation of the error of the mean spindle frequency, Hz.
    pub frequency_deviation_hz: f64,
    /// Root mean square of the deviation of the spindle frequency from its mean, over the mean.
    pub speed_wander: f64,
    /// Standard deviation of the error of θ at one time, against the mean error over the record, rad.
    pub angle_deviation_rad: f64,
    /// Standard deviation of the mean error of θ over the record (one phase per record), rad: that of the mean of all
    /// edges, and the rounding of an edge to a sample where the edges do not scatter by as much, so that their mean
    /// does not average it. Without a tachometer that of an angle which may be any.
    pub phase_deviation_rad: f64,
}

impl SpindleAngle {
    /// Fits the spindle angle to the tachometer of a recording, from the first revolution that begins `settled_s` after
    /// the first sample or later.
    ///
    /// # Errors
    /// The recording has no tachometer channel, its edges do not match the tachometer wheel, or fewer than
    /// [`LEAST_REVOLUTIONS`] whole revolutions are left.
    pub(crate) fn new(recording: &Recording, settled_s: f64) -> Result<Self, DiagnoseError> {
        let motion = SpindleMotion::new(recording, None)?;
        let edges_s: Vec<f64> = motion
            .revolutions_s()
            .filter(|edge_s| *edge_s >= settled_s)
            .collect();
        check_revolutions(recording, edges_s.len().saturating_sub(1))?;
        let finer = if is_sampled_finely(recording) { FINER } else { 1.0 };
        Ok(Self::from_edges(edges_s, finer * recording.sample_rate_hz))
    }

    /// Fits the spindle angle to the beginnings of successive revolutions, s after the first sample, and the end of the
    /// last one: at least four. `rate_hz` is the sample rate that rounds them.
    pub(crate) fn from_edges(edges_s: Vec<f64>, rate_hz: f64) -> Self {
        let count = edges_s.len();
        let (first, duration_s) = (edges_s[0], edges_s[count - 1] - edges_s[0]);
        let mean_hz = (count - 1) as f64 / duration_s;
        let times: Vec<f64> = edges_s.iter().map(|edge_s| (edge_s - first) * mean_hz).collect();
        let numbers: Vec<f64> = (0..count).map(|edge| edge as f64).collect();
        let revolutions = SmoothingSpline::new(times.clone(), &numbers);
        let values = revolutions.values();
        let frequency_hz = mean_hz * (values[count - 1] - values[0]) / (count - 1) as f64;
        let wander: f64 = times
            .windows(2)
            .zip(values.windows(2))
            .map(|(times, values)| {
                mean_hz * (values[1] - values[0]) / (times[1] - times[0]) / frequency_hz - 1.0
            })
            .map(|deviation| deviation * deviation)
            .sum();
        let [start, end] = revolutions.end_deviations;
        let jitter_s = revolutions.deviation / mean_hz;
        let rounding = (1.0 / (12.0 * rate_hz * rate_hz) - jitter_s * jitter_s).max(0.0);
        let phase_s = (jitter_s * jitter_s / count as f64 + rounding).sqrt();
        Self {
            frequency_hz,
            frequency_deviation_hz: start.hypot(end) / duration_s,
            speed_wander: (wander / (count - 1) as f64).sqrt(),
            angle_deviation_rad: TAU
                * revolutions.deviation
                * ((revolutions.parameters - 1.0).max(0.0) / count as f64).sqrt(),
            phase_deviation_rad: TAU * frequency_hz * phase_s,
            revolutions,
            edges_s,
        }
    }

    /// The angle at the constant frequency `frequency_hz`, θ = 0 at `start_s` after the first sample, over all whole
    /// revolutions up to `end_s`.
    pub(crate) fn steady(frequency_hz: f64, frequency_deviation_hz: f64, [start_s, end_s]: [f64; 2]) -> Self {
        let count = ((end_s - start_s) * frequency_hz).max(0.0) as usize;
        Self {
            edges_s: (0..=count)
                .map(|edge| start_s + edge as f64 / frequency_hz)
                .collect(),
            revolutions: SmoothingSpline::line(count + 1),
            frequency_hz,
            frequency_deviation_hz,
            speed_wander: 0.0,
            angle_deviation_rad: 0.0,
            phase_deviation_rad: ANY_PHASE_RAD,
        }
    }

    /// This angle with its zero later by a share of a revolution, from 0 to 1; any zero was as probable before.
    pub(crate) fn turned(&self, share: f64, rate_hz: f64) -> Self {
        let edges_s = self.times_at((0..self.count()).map(|edge| edge as f64 + share));
        Self {
            phase_deviation_rad: ANY_PHASE_RAD,
            ..Self::from_edges(edges_s, rate_hz)
        }
    }

    /// Times, s after the first sample, at which the angle has these values within the whole revolutions, in revolutions.
    pub(crate) fn times_at(&self, revolutions: impl Iterator<Item = f64>) -> Vec<f64> {
        let last = self.count();
        revolutions
            .map(|wanted| {
                let edge = (wanted.max(0.0) as usize).min(last - 1);
                let between = self.edges_s[edge + 1] - self.edges_s[edge];
                let mut time_s = self.edges_s[edge] + (wanted - edge as f64) * between;
                // The speed hardly changes within a revolution: each step is exact but for that.
                for _ in 0..3 {
                    let there = self.revolutions_at(std::iter::once(time_s))[0];
                    time_s = (time_s + (wanted - there) * between).clamp(self.edges_s[0], self.edges_s[last]);
                }
                time_s
            })
            .collect()
    }

    /// Number of whole revolutions.
    pub(crate) fn count(&self) -> usize {
        self.edges_s.len().saturating_sub(1)
    }

    /// Beginnings of the revolutions and the end of the last one, s after the first sample.
    pub(crate) fn edges_s(&self) -> &[f64] {
        &self.edges_s
    }

    /// Spindle angle, in revolutions, at ascending times within the whole revolutions, s after the first sample.
    pub(crate) fn revolutions_at(&self, times_s: impl Iterator<Item = f64>) -> Vec<f64> {
        let first = self.edges_s[0];
        let count = self.count();
        let mean_hz = count as f64 / (self.edges_s[count] - first);
        self.revolutions.at(times_s.map(|t| (t - first) * mean_hz))
    }
}

/// Standard deviation of an angle that may be any, rad.
const ANY_PHASE_RAD: f64 = TAU / 3.464_101_615_137_754_6;

/// Times the sample rate that times of edges are exact, where samples lie on the edges.
const FINER: f64 = 20.0;
/// Levels between which a sample lies on an edge, as shares of the range of the tachometer.
const ON_EDGE: [f64; 2] = [0.05, 0.95];

/// True if most rising edges of the tachometer have a sample on them, so that their times are known between the samples.
fn is_sampled_finely(recording: &Recording) -> bool {
    let Some(channel) = recording.channel("tacho") else {
        return false;
    };
    let low = channel.samples.iter().copied().fold(f64::INFINITY, f64::min);
    let high = channel.samples.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    let level = |sample: f64| (sample - low) / (high - low);
    let (mut edges, mut seen) = (0, 0);
    for pair in channel.samples.windows(2) {
        let [before, after] = [level(pair[0]), level(pair[1])];
        if before < 0.5 && after >= 0.5 {
            edges += 1;
            seen += usize::from(
                [before, after]
                    .iter()
                    .any(|level| (ON_EDGE[0]..=ON_EDGE[1]).contains(level)),
            );
        }
    }
    2 * seen > edges
}

/// Fewest whole revolutions that are reduced. The covariance of seven channels requires two times eight independent
/// values between lines (see `between_lines`), which ten revolutions have within two orders.
pub(crate) const LEAST_REVOLUTIONS: usize = 10;

/// # Errors
/// There are fewer than [`LEAST_REVOLUTIONS`] revolutions.
pub(crate) fn check_revolutions(recording: &Recording, revolutions: usize) -> Result<(), DiagnoseError> {
    if revolutions >= LEAST_REVOLUTIONS {
        return Ok(());
    }
    Err(DiagnoseError::record(
        &recording.path,
        format!(
            "contains only {revolutions} whole revolutions of settled cutting; at least {LEAST_REVOLUTIONS} are required"
        ),
    ))
}
