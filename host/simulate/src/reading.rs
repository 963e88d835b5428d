//! What a sensor without any fault but its delay reads of a motion, sample by sample.

use super::Model;
use super::effect::Pickup;
use super::segment::{Motion, Segment, Workspace};
use quietcut_recording::Quantity;

/// The samples of one channel, as a motion is computed.
///
/// Where a structure has no acceleration at an instant ([`super::Dynamics::velocity_jumps`]) it is the mean over one sample,
/// (v(t + h/2) − v(t − h/2))/h.
pub struct Reading {
    pickup: Pickup,
    workspace: Workspace,
    rate_hz: f64,
    count: usize,
    is_mean: bool,
    /// The samples; where they are means, the velocities half a sample before each and one more.
    values: Vec<f64>,
}

impl Reading {
    /// `count` samples of what `pickup` reads of the motion of `model`.
    pub fn new(model: &Model, pickup: Pickup, rate_hz: f64, count: usize) -> Self {
        let is_mean = pickup.quantity == Quantity::Acceleration && model.dynamics.velocity_jumps();
        Self {
            workspace: Workspace::seeing(model, &pickup.modes),
            values: Vec::with_capacity(count + 1),
            pickup,
            rate_hz,
            count,
            is_mean,
        }
    }

    /// Takes what there is of it in the newest stretch of the motion. What is held at rest, or pulled, until t = 0 stands still before.
    pub fn observe(&mut self, segment: &Segment<'_>) {
        let (early, count) = if self.is_mean {
            (0.5, self.count + 1)
        } else {
            (0.0, self.count)
        };
        while self.values.len() < count {
            let t = (self.values.len() as f64 - early) / self.rate_hz - self.pickup.delay_s;
            if t > segment.to_s() {
                break;
            }
            let motion = segment.motion(t.max(0.0), &mut self.workspace);
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

    /// What it is of, and its samples: fewer than were asked for where the motion ended before.
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
