//! Samples of one channel, taken from the simulated motion by a noise-free sensor with its delay and its dynamics.

use num_complex::Complex64;

use super::Model;
use super::dense_step::{DenseStep, Motion, Workspace};
use super::effect::Pickup;
use super::section_filter::SectionFilter;
use quietcut_recording::Quantity;

/// Least number of intervals per sample in which the dynamics of a sensor are integrated. A choice: the parabola
/// through a tone of a fifth of the sampling rate then has an error of 2·10⁻⁴, most of which cancels in the integral.
const INTERVALS_PER_SAMPLE: f64 = 4.0;

/// Samples of one channel, collected while the motion is integrated.
///
/// If a step of the force makes the velocity jump ([`super::Dynamics::velocity_jumps`]), an acceleration sample is the
/// mean over one sampling interval h, (v(t + h/2) − v(t − h/2))/h.
pub struct Reading {
    pickup: Pickup,
    workspace: Workspace,
    rate_hz: f64,
    count: usize,
    is_mean: bool,
    /// Dynamics of the sensor along the motion; `None` for a sensor without dynamics, and before the first step.
    filter: Option<SectionFilter<1>>,
    /// Samples taken so far, in the order of time. If `is_mean`: velocities half a sampling interval before each
    /// sample, and half an interval after the last.
    values: Vec<f64>,
}

impl Reading {
    /// A channel of `count` samples that `pickup` reads from the motion of `model` at `rate_hz`, in Hz.
    pub fn new(model: &Model, pickup: Pickup, rate_hz: f64, count: usize) -> Self {
        let workspace = Workspace::at_sensor(model, &pickup.modes);
        let is_mean = pickup.quantity == Quantity::Acceleration && workspace.dynamics(model).velocity_jumps();
        Self {
            workspace,
            values: Vec::with_capacity(count + 1),
            pickup,
            rate_hz,
            count,
            is_mean,
            filter: None,
        }
    }

    /// Takes the samples of the channel that lie in the newest integration step. A delay of the sensor, or a mean over
    /// the sampling interval, places the first values before t = 0, where the tool is at rest at its initial
    /// displacement.
    pub fn observe(&mut self, step: &DenseStep<'_>) {
        if self.filter.is_none() && !self.pickup.sections.is_empty() {
            let start = step.motion(step.from_s(), &mut self.workspace);
            let rest = self.read_before(&start);
            self.filter = Some(SectionFilter::at_rest(&self.pickup.sections, [rest]));
        }
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
                self.read_before(&motion) * self.pickup.dynamics(Complex64::ZERO).re
            } else {
                match self.filtered(t, step) {
                    Some(value) => value,
                    None => self.read(&motion),
                }
            };
            self.values.push(value);
        }
        self.filtered(step.to_s(), step);
    }

    /// Integrates the dynamics of the sensor to the time `t`, s, within the step, and returns the reading; `None` for a
    /// sensor without dynamics.
    fn filtered(&mut self, t: f64, step: &DenseStep<'_>) -> Option<f64> {
        let mut filter = self.filter.take()?;
        let from_s = filter.until_s;
        let count = ((t - from_s) * self.rate_hz * INTERVALS_PER_SAMPLE)
            .ceil()
            .max(1.0);
        let interval_s = (t - from_s).max(0.0) / count;
        let mut reading = 0.0;
        for k in 0..count as usize {
            let inputs = [0.0, 0.5, 1.0].map(|share| {
                let at_s = from_s + (k as f64 + share) * interval_s;
                let motion = step.motion(at_s.min(step.to_s()), &mut self.workspace);
                [self.read(&motion)]
            });
            [reading] = filter.pass(interval_s, inputs);
        }
        // The sum of the intervals differs from `t` by rounding.
        filter.until_s = filter.until_s.max(t);
        self.filter = Some(filter);
        Some(reading)
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
