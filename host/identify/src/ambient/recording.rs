//! Preparation of response-only records: removal of the spindle harmonics, band limit and decimation.

use std::f64::consts::{PI, TAU};

use nalgebra::{DMatrix, DVector};
use quietcut_numerics::least_squares::{Idle, NormalEquations};

use quietcut_recording::{Quantity, Recording, SpindleAngle};

/// Vibration of a structure under an unmeasured excitation.
#[derive(Clone, Debug, PartialEq)]
pub struct Ambient {
    /// Samples of each motion channel after the decimation, in its SI unit.
    pub channels: Vec<Vec<f64>>,
    /// Names of the motion channels, in the order of `channels`.
    pub names: Vec<String>,
    /// Sample rate after the decimation, Hz.
    pub rate_hz: f64,
    /// Mean spindle frequency, whose harmonics were removed unless `harmonics_remain`, Hz; `None` if no speed is known.
    pub turn_hz: Option<f64>,
    /// Reason why a recorded tachometer does not give the spindle angle; the stated speed is used instead, if there is
    /// one. `None` if no tachometer was recorded, or if it gives the angle.
    pub tachometer_fault: Option<String>,
    /// True if the spindle harmonics are still in the samples, because the record is too short to separate them from
    /// each other.
    pub harmonics_remain: bool,
}

/// Result of the removal of the spindle harmonics from a record of ambient vibration.
struct Removal {
    /// Spindle frequency, Hz; `None` if no speed is known.
    turn_hz: Option<f64>,
    /// Reason why a recorded tachometer does not give the spindle angle; `None` as in [`Ambient`].
    tachometer_fault: Option<String>,
    /// True if the record is too short to separate the spindle harmonics, so that they are still in the samples.
    harmonics_remain: bool,
}

/// Smallest number of samples per period of the highest frequency of the band that the decimation of an ambient record
/// leaves.
const PER_PERIOD: f64 = 3.0;

impl Ambient {
    /// Motion channels of a recording, decimated for the band up to `high_hz`: all accelerations if there are any, else
    /// all velocities, else all displacements.
    ///
    /// `None` if the recording has no motion channel.
    pub fn new(recording: &Recording, high_hz: f64) -> Option<Self> {
        let of = |quantity: Quantity| -> Vec<_> {
            let motions = recording.channels.iter();
            motions.filter(|channel| channel.quantity == quantity).collect()
        };
        let chosen = [Quantity::Acceleration, Quantity::Velocity, Quantity::Displacement]
            .into_iter()
            .map(of)
            .find(|channels| !channels.is_empty())?;
        let mut samples: Vec<Vec<f64>> = chosen.iter().map(|channel| channel.samples.clone()).collect();
        let Removal {
            turn_hz,
            tachometer_fault,
            harmonics_remain,
        } = without_harmonics(recording, &mut samples, high_hz);
        let every = (recording.sample_rate_hz / (PER_PERIOD * high_hz))
            .floor()
            .max(1.0) as usize;
        Some(Self {
            channels: samples.iter().map(|channel| thinned(channel, every)).collect(),
            names: chosen.iter().map(|channel| channel.name.clone()).collect(),
            rate_hz: recording.sample_rate_hz / every as f64,
            turn_hz,
            tachometer_fault,
            harmonics_remain,
        })
    }

    /// Duration of the record after the decimation, s.
    pub fn seconds(&self) -> f64 {
        self.channels.first().map_or(0, Vec::len) as f64 / self.rate_hz
    }
}

/// Removes the mean and all spindle harmonics up to 1.2 `high_hz` from `samples` by least squares over the record,
/// after trimming the samples to the range in which the spindle angle is known. Nothing is removed, not even the mean,
/// if the record is too short to separate the harmonics.
fn without_harmonics(recording: &Recording, samples: &mut [Vec<f64>], high_hz: f64) -> Removal {
    let cut = recording.sidecar.cut.unwrap_or_default();
    let rate_hz = recording.sample_rate_hz;
    let mut fault = None;
    let (first, angle) = match SpindleAngle::new(recording, cut.teeth.unwrap_or(1)) {
        Ok(angle) => (angle.first, angle.rad),
        Err(error) => {
            fault = recording.channel("tacho").map(|_| error.to_string());
            let rad_per_sample = cut.spindle_rpm.map_or(0.0, |rpm| TAU * rpm / 60.0 / rate_hz);
            let count = recording.len();
            (
                0,
                (0..count).map(|sample| rad_per_sample * sample as f64).collect(),
            )
        }
    };
    let turned = angle.last().unwrap_or(&0.0) - angle.first().unwrap_or(&0.0);
    let turn_hz = turned / TAU * rate_hz / angle.len().max(2) as f64;
    for channel in samples.iter_mut() {
        channel.drain(..first.min(channel.len()));
        channel.truncate(angle.len());
    }
    let harmonics = if turn_hz > 0.0 {
        (1.2 * high_hz / turn_hz) as usize
    } else {
        0
    };
    let width = 1 + 2 * harmonics;
    let mut row = DVector::from_element(width, 1.0);
    let fill = |row: &mut DVector<f64>, angle: f64| {
        for harmonic in 1..=harmonics {
            let (sin, cos) = (harmonic as f64 * angle).sin_cos();
            (row[2 * harmonic - 1], row[2 * harmonic]) = (cos, sin);
        }
    };
    let mut normal = DMatrix::zeros(width, width);
    let mut right = DMatrix::zeros(width, samples.len());
    for (sample, angle) in angle.iter().enumerate() {
        fill(&mut row, *angle);
        normal.ger(1.0, &row, &row, 1.0);
        for (channel, samples) in samples.iter().enumerate() {
            right.column_mut(channel).axpy(samples[sample], &row, 1.0);
        }
    }
    let equations = NormalEquations::new(&normal, 0.0, Idle::Refuse);
    let harmonics_remain = equations.is_none() && harmonics > 0;
    if let Some(equations) = equations {
        let found = equations.solve_columns(&right);
        for (samples, found) in samples.iter_mut().zip(found.column_iter()) {
            for (sample, angle) in samples.iter_mut().zip(&angle) {
                fill(&mut row, *angle);
                *sample -= found.dot(&row);
            }
        }
    }
    Removal {
        turn_hz: (turn_hz > 0.0).then_some(turn_hz),
        tachometer_fault: fault,
        harmonics_remain,
    }
}

/// Decimates samples by the factor `every`, after a low-pass filter (windowed sinc, Hann) that passes frequencies up to
/// a third of the new sample rate and blocks those from two thirds on. Aliases fall above a third of the new rate. The
/// first and last 10·`every` samples are lost. With `every` 1 the samples stay as they are.
fn thinned(samples: &[f64], every: usize) -> Vec<f64> {
    if every == 1 {
        return samples.to_vec();
    }
    let half = 10 * every;
    let weight = |offset: usize| {
        let x = offset as f64 / every as f64;
        let sinc = if offset == 0 {
            1.0
        } else {
            (PI * x).sin() / (PI * x)
        };
        sinc * (0.5 + 0.5 * (PI * offset as f64 / half as f64).cos())
    };
    let weights: Vec<f64> = (0..=half).map(weight).collect();
    let sum = weights[0] + 2.0 * weights[1..].iter().sum::<f64>();
    (half..samples.len().saturating_sub(half))
        .step_by(every)
        .map(|center| {
            let mut value = weights[0] * samples[center];
            for (offset, weight) in weights.iter().enumerate().skip(1) {
                value += weight * (samples[center - offset] + samples[center + offset]);
            }
            value / sum
        })
        .collect()
}
