//! Samples of one channel, taken from the simulated motion by an ideal sensor with a constant delay.

use super::Model;
use super::dense_step::{DenseStep, Motion, Workspace};
use super::effect::Pickup;
use quietcut_recording::Quantity;

/// Samples of one channel, collected while the motion is integrated.
///
/// If a step of the force makes the velocity jump ([`super::Dynamics::velocity_jumps`]), an acceleration sample is the mean over one
/// sampling interval h, (v(t + h/2) − v(t − h/2))/h.
pub struct Reading {
    pickup: Pickup,
    workspace: Workspace,
    rate_hz: f64,
    count: usize,
    is_mean: bool,
    /// Samples of the channel. If `is_mean`: velocities half a sampling interval before each sample, and half an interval after the last.
    values: Vec<f64>,
}

impl Reading {
    /// A channel of `count` samples that `pickup` reads from the motion of `model` at `rate_hz`, in Hz.
    pub fn new(model: &Model, pickup: Pickup, rate_hz: f64, count: usize) -> Self {
        let is_mean = pickup.quantity == Quantity::Acceleration && model.dynamics.velocity_jumps();
        Self {
            workspace: Workspace::at_sensor(model, &pickup.modes),
            values: Vec::with_capacity(count + 1),
            pickup,
            rate_hz,
            count,
            is_mean,
        }
    }

    /// Takes the samples of the channel that lie in the newest integration step. A delay of the sensor places the first samples before t =
    /// 0, where the tool is at rest at its initial displacement.
    pub fn observe(&mut self, step: &DenseStep<'_>) {
        let (early, count) = if self.is_mean {
            (0.5, self.count + 1)
        } else {
            (0.0, self.count)
        };
        while self.values.len() < count {
            let t = (self.values.len() as f64 - early) / self.rate_hz - self.pickup.delay_s;
            if t > step.to_s() {
                break;
            }
            let motion = step.motion(t.max(0.0), &mut self.workspace);
            let value = if t < 0.0 {
                self.read_before(&motion)
            } else {
                self.read(&motion)
            };
            self.values.push(value);
        }
    }

    fn read(&self, motion: &Motion) -> f64 {
        self.pickup.read(match self.pickup.quantity {
            Quantity::Force => motion.force_n,
            Quantity::Velocity => motion.velocity_m_per_s,
            Quantity::Acceleration if self.is_mean => motion.velocity_m_per_s,
            Quantity::Acceleration => motion.acceleration_m_per_s2.unwrap_or([0.0; 3]),
            _ => motion.displacement_m,
        })
    }

    fn read_before(&self, start: &Motion) -> f64 {
        match self.pickup.quantity {
            Quantity::Force | Quantity::Velocity | Quantity::Acceleration => 0.0,
            _ => self.pickup.read(start.displacement_m),
        }
    }

    /// The pickup and its samples in SI units; fewer than requested if the simulation ended earlier.
    pub fn samples(self) -> (Pickup, Vec<f64>) {
        let samples = if self.is_mean {
            let pairs = self.values.windows(2);
            pairs.map(|pair| (pair[1] - pair[0]) * self.rate_hz).collect()
        } else {
            self.values
        };
        (self.pickup, samples)
    }
}
