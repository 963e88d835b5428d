//! Two detectors of the literature on the same blocks, to compare with: the variance of samples once per revolution, and a threshold on the
//! spectrum.
//!
//! | detector | statistic |
//! |---|---|
//! | once per revolution | standard deviation of the last [`REVOLUTIONS`] samples at the tachometer's pulse (Schmitz, Davies, Medicus and Snyder, CIRP Annals 50, 2001, 263) |
//! | spectrum | amplitude of the strongest line of a Hann spectrum that is no harmonic of the spindle (Altintas, Manufacturing Automation, 2012, 3.3) |
//!
//! Both are summed over the axes. Both need a threshold. Here it is a factor over the largest statistic of the second half of the stable cut of
//! the same session: a calibration that no device has before the cut, in favour of these detectors.

use std::sync::Arc;

use quietcut_core::acceleration::Sensor;
use rustfft::num_complex::Complex;
use rustfft::{Fft, FftPlanner};

use super::sensors::Sensed;
use super::session::Phase;

/// Revolutions of the variance.
const REVOLUTIONS: usize = 10;
/// Points of the spectrum: 6.5 Hz at 26 667 samples per second; a new one comes every quarter of its length.
const POINTS: usize = 4096;
const HOP: usize = POINTS / 4;
/// Distance in bins from a harmonic of the spindle within which a line belongs to it: the main lobe of the Hann window.
const HARMONIC_BINS: f64 = 2.0;
/// A pulse sooner than this part of the interval before is a doubled one.
const DOUBLED: f64 = 0.5;

/// The detectors.
pub const NAMES: [&str; 2] = ["once per revolution", "line of the spectrum"];

/// The statistics of both detectors after a block; `None` before there is one.
#[derive(Clone, Copy, Debug)]
pub struct Statistics {
    pub phase: Phase,
    pub time_s: f64,
    pub values: [Option<f64>; 2],
}

/// Follows both statistics.
pub struct Literature {
    /// The newest samples in counts, oldest first, and the time of the last one, s.
    samples: Vec<[f64; 3]>,
    last_s: f64,
    since_spectrum: usize,
    /// Samples at the last pulses; time of the last pulse, and the interval before it, s.
    pulses: Vec<[f64; 3]>,
    pulse_s: f64,
    interval_s: f64,
    plan: Arc<dyn Fft<f64>>,
    line: Option<f64>,
    pub statistics: Vec<Statistics>,
}

impl Literature {
    pub fn new() -> Self {
        Self {
            samples: Vec::new(),
            last_s: 0.0,
            since_spectrum: 0,
            pulses: Vec::new(),
            pulse_s: 0.0,
            interval_s: 0.0,
            plan: FftPlanner::new().plan_fft_forward(POINTS),
            line: None,
            statistics: Vec::new(),
        }
    }

    /// Takes the next block with its pulses.
    pub fn take(&mut self, sensed: &Sensed) {
        let counts = &sensed.block.counts;
        self.samples.extend(counts.iter().map(|c| c.map(f64::from)));
        self.samples
            .drain(..self.samples.len().saturating_sub(POINTS + HOP));
        self.last_s = sensed.time_s;
        self.since_spectrum += counts.len();
        for &edge_s in &sensed.edges_s {
            self.take_pulse(edge_s);
        }
        if self.since_spectrum >= HOP && self.samples.len() >= POINTS {
            self.since_spectrum = 0;
            self.line = self.strongest_line();
        }
        self.statistics.push(Statistics {
            phase: sensed.truth.phase,
            time_s: sensed.time_s,
            values: [self.deviation(), self.line],
        });
    }

    fn take_pulse(&mut self, edge_s: f64) {
        let interval_s = edge_s - self.pulse_s;
        if interval_s < DOUBLED * self.interval_s {
            return;
        }
        (self.pulse_s, self.interval_s) = (edge_s, interval_s);
        let rate = f64::from(Sensor::IIS3DWB_16G.nominal_rate.0);
        let place = (self.samples.len() as f64 - 1.0 + (edge_s - self.last_s) * rate).max(0.0);
        let (before, part) = (place as usize, place.fract());
        let (Some(a), Some(b)) = (self.samples.get(before), self.samples.get(before + 1)) else {
            return;
        };
        self.pulses
            .push(std::array::from_fn(|axis| a[axis] + part * (b[axis] - a[axis])));
        self.pulses.drain(..self.pulses.len().saturating_sub(REVOLUTIONS));
    }

    fn deviation(&self) -> Option<f64> {
        if self.pulses.len() < REVOLUTIONS {
            return None;
        }
        let count = self.pulses.len() as f64;
        let variance = |axis: usize| {
            let mean = self.pulses.iter().map(|p| p[axis]).sum::<f64>() / count;
            self.pulses.iter().map(|p| (p[axis] - mean).powi(2)).sum::<f64>() / (count - 1.0)
        };
        Some((0..3).map(variance).sum::<f64>().sqrt())
    }

    /// `None` where the lines of the spindle leave no room between them.
    fn strongest_line(&self) -> Option<f64> {
        let record = &self.samples[self.samples.len() - POINTS..];
        let mut power = vec![0.0; POINTS / 2];
        for axis in 0..3 {
            let mean = record.iter().map(|s| s[axis]).sum::<f64>() / POINTS as f64;
            let window = |n: usize| 0.5 - 0.5 * (std::f64::consts::TAU * n as f64 / POINTS as f64).cos();
            let mut line: Vec<Complex<f64>> = record
                .iter()
                .enumerate()
                .map(|(n, s)| Complex::new(window(n) * (s[axis] - mean), 0.0))
                .collect();
            self.plan.process(&mut line);
            for (sum, value) in power.iter_mut().zip(&line) {
                *sum += value.norm_sqr();
            }
        }
        let bin_hz = f64::from(Sensor::IIS3DWB_16G.nominal_rate.0) / POINTS as f64;
        let order_bins = 1.0 / self.interval_s / bin_hz;
        let is_harmonic = |bin: usize| {
            let order = (bin as f64 / order_bins).round();
            (bin as f64 - order * order_bins).abs() <= HARMONIC_BINS
        };
        let asynchronous = (4..POINTS / 2).filter(|&bin| !is_harmonic(bin));
        let strongest = asynchronous.map(|bin| power[bin]).fold(0.0, f64::max);
        (strongest > 0.0).then(|| strongest.sqrt())
    }
}

/// The largest statistic of a detector in the second half of the stable cut.
pub fn calibration(statistics: &[Statistics], detector: usize) -> Option<f64> {
    let stable: Vec<&Statistics> = statistics.iter().filter(|s| s.phase == Phase::Stable).collect();
    let values = stable[stable.len() / 2..]
        .iter()
        .filter_map(|s| s.values[detector]);
    values.max_by(f64::total_cmp)
}

/// Alarms of a detector with its threshold at `factor` over the calibration: its onsets outside growth, and the first alarm after growth began, s.
pub fn alarms(statistics: &[Statistics], detector: usize, factor: f64) -> (usize, Option<f64>) {
    let Some(reference) = calibration(statistics, detector) else {
        return (0, None);
    };
    let (mut false_onsets, mut first, mut was_alarm) = (0, None, false);
    for s in statistics {
        let is_alarm = s.values[detector].is_some_and(|value| value > factor * reference);
        let is_onset = is_alarm && !was_alarm;
        match s.phase {
            Phase::Growing if is_alarm => first = first.or(Some(s.time_s)),
            // What chattered may be told when the tool has left.
            Phase::Growing | Phase::Stop => {}
            _ => false_onsets += usize::from(is_onset),
        }
        was_alarm = is_alarm;
    }
    (false_onsets, first)
}
