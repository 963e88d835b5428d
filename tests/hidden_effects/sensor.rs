//! Sensors and their readings of a motion.

use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

use super::cause::{Cause, EffectKind, Scale};
use super::machine::Machine;
use super::signal::interpolated;

/// One sensor of displacement or acceleration.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Sensor {
    pub(crate) axis: usize,
    pub(crate) acceleration: bool,
    /// True if the sensor sits at the spindle housing and not at the tool.
    pub(crate) at_housing: bool,
}

impl Sensor {
    /// Name of the sensor's channel.
    pub(crate) fn name(&self) -> String {
        format!(
            "{}{}",
            if self.acceleration { "a" } else { "" },
            letter(self.axis)
        )
    }
}

/// Value of `series` at the fractional index `place`. Before the start the machine was at rest at its initial displacement.
fn late(series: &[[f64; 3]], place: f64, acceleration: bool) -> [f64; 3] {
    match place {
        place if place >= 0.0 => interpolated(series, place),
        _ if acceleration => [0.0; 3],
        _ => series[0],
    }
}

pub(crate) fn letter(axis: usize) -> char {
    ['x', 'y', 'z'][axis]
}

/// Readings of a sensor in a motion `series` with `steps` grid points per sample, under the sensor errors `causes`.
pub(crate) fn read_by(
    machine: &Machine,
    scale: &Scale,
    sensor: Sensor,
    causes: &[&Cause],
    series: &[[f64; 3]],
    steps: usize,
    samples: usize,
) -> Vec<f64> {
    let mut weights = [0.0; 3];
    weights[sensor.axis] = 1.0;
    let (mut delay, mut second, mut third) = (0.0, 0.0, 0.0);
    for cause in causes {
        let value = cause.values(machine, scale)[0].1;
        match cause.kind {
            EffectKind::SensorGain | EffectKind::SensorOffset => {
                weights = weights.map(|weight| weight * value)
            }
            // The series already contains this error.
            EffectKind::SensorOffsetByMode => {}
            EffectKind::SensorDelay => delay = value,
            EffectKind::CrossAxis => weights[usize::from(sensor.axis == 0)] += value,
            EffectKind::SensorSquare => second = value,
            _ => third = value,
        }
    }
    let full = scale.peak_m
        * if sensor.acceleration {
            machine.omega[0].powi(2)
        } else {
            1.0
        };
    (0..samples)
        .map(|k| {
            let value = if delay == 0.0 {
                series[k * steps]
            } else {
                let place = steps as f64 * (k as f64 - delay / scale.sample_s);
                late(series, place, sensor.acceleration)
            };
            let read: f64 = weights
                .iter()
                .zip(value)
                .map(|(weight, value)| weight * value)
                .sum();
            read + second * read * read / full - third * read.powi(3) / full.powi(2)
        })
        .collect()
}

/// The samples with added white noise of standard deviation `sigma`.
pub(crate) fn noisy(samples: &[f64], sigma: f64, random: &mut ChaCha8Rng) -> Vec<f64> {
    let with_noise = |value: &f64| {
        let noise: f64 = StandardNormal.sample(random);
        value + sigma * noise
    };
    samples.iter().map(with_noise).collect()
}

/// Draws the sensors: displacement, acceleration or both, in every direction.
pub(crate) fn sensors(random: &mut ChaCha8Rng, machine: &Machine) -> Vec<Sensor> {
    let kind = random.random::<f64>();
    let housing = random.random::<f64>() < 0.3;
    let mut sensors = Vec::new();
    for &axis in &machine.axes {
        if kind < 0.75 {
            sensors.push(Sensor {
                axis,
                acceleration: false,
                at_housing: false,
            });
        }
        if kind > 0.5 {
            sensors.push(Sensor {
                axis,
                acceleration: true,
                at_housing: housing && kind < 0.75,
            });
        }
    }
    sensors
}
