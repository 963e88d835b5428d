//! Virtual test rigs: a structure excited by a shaker, by hammer impacts or by a released static pull, and the sensors
//! that record it.

mod multisine;
mod noise;
mod signal;

#[cfg(test)]
mod joint_tests;
#[cfg(test)]
mod tests;

use std::path::Path;

pub use multisine::MultisineLines;
pub use noise::Noise;
pub use signal::{Impact, Signal, Step};

use super::effect::{Effects, Pickup};
use super::{Drive, Model, Reading, Settings, SimulateError, Statistics};
use quietcut_model::structure::{Direction, Structure};
use quietcut_recording::{Channel, Quantity, Recording, Sidecar, TestKind};

/// A modal test of a structure: excitation force in one direction and measured responses.
#[derive(Clone, Debug)]
pub struct Rig {
    /// Direction of the excitation force.
    pub direction: Direction,
    /// Commanded force over time.
    pub signal: Signal,
    /// Force drop of a shaker without force control, N s/m: the true force is the commanded force minus this times the
    /// velocity of the tool, so that it drops at resonance. The recording contains the true force.
    pub drop_ns_per_m: f64,
    /// Sampling rate, Hz.
    pub sample_rate_hz: f64,
    /// Quantities measured besides the force, each along those of x, y and z that the structure has.
    pub measured: Vec<Quantity>,
    /// Effects of structure and sensors in this test.
    pub effects: Effects,
}

/// The excitation force of a rig along one machine axis.
struct Driven {
    axis: usize,
    signal: Signal,
    drop_ns_per_m: f64,
}

impl Drive for Driven {
    fn force_n(&self, t: f64) -> [f64; 3] {
        let mut force = [0.0; 3];
        force[self.axis] = self.signal.force_n(t);
        force
    }

    fn drop_ns_per_m(&self) -> [f64; 3] {
        let mut drop = [0.0; 3];
        drop[self.axis] = self.drop_ns_per_m;
        drop
    }

    fn next_knot_s(&self, t: f64) -> f64 {
        self.signal.next_knot_s(t)
    }

    fn longest_step_s(&self) -> f64 {
        self.signal.longest_step_s()
    }
}

impl Rig {
    /// A rig with an ideal force source that measures displacement and acceleration.
    pub fn new(direction: Direction, signal: Signal, sample_rate_hz: f64) -> Self {
        Self {
            direction,
            signal,
            drop_ns_per_m: 0.0,
            sample_rate_hz,
            measured: vec![Quantity::Displacement, Quantity::Acceleration],
            effects: Effects::default(),
        }
    }

    /// Simulates the test from rest at t = 0 and returns the recording without noise; `path` is the path of the
    /// recording's file.
    ///
    /// # Errors
    /// The structure is refused, lacks the direction, or the direction is a rotation; an effect does not apply to the
    /// structure; or an error of [`Model::run`].
    pub fn record(
        &self,
        structure: &Structure,
        path: &Path,
    ) -> Result<(Recording, Statistics), SimulateError> {
        let axis = self
            .direction
            .axis()
            .filter(|_| structure.directions.contains(&self.direction))
            .ok_or(SimulateError::NoDirection {
                direction: self.direction,
            })?;
        let (dynamics, restoring_forces) = self.effects.dynamics(structure)?;
        let model = Model {
            dynamics,
            cutting: None,
            drive: Some(Box::new(Driven {
                axis,
                signal: self.signal.clone(),
                drop_ns_per_m: self.drop_ns_per_m,
            })),
            restoring_forces,
        };
        let seconds = self.signal.duration_s();
        let count = (seconds * self.sample_rate_hz).floor() as usize;
        let mut readings: Vec<Reading> = self
            .pickups(structure, axis)
            .into_iter()
            .map(|pickup| Reading::new(&model, pickup, self.sample_rate_hz, count))
            .collect();
        let statistics = model.run(seconds, Settings::default(), |step| {
            readings.iter_mut().for_each(|reading| reading.observe(step));
        })?;
        let recording = Recording {
            path: path.into(),
            sample_rate_hz: self.sample_rate_hz,
            start_s: 0.0,
            since_s: 0.0,
            channels: channels(readings),
            sidecar: Sidecar {
                kind: Some(self.signal.kind()),
                input: Some(vec![format!("f{}", self.direction)]),
                ..Sidecar::default()
            },
        };
        Ok((recording, statistics))
    }

    /// Sensors of the rig in the order of the channels: the force, then for each quantity in the order of `measured`
    /// the directions in the order of the structure.
    fn pickups(&self, structure: &Structure, driven: usize) -> Vec<Pickup> {
        let mut pickups = vec![Pickup::of_axis(Quantity::Force, driven)];
        for quantity in &self.measured {
            for axis in structure
                .directions
                .iter()
                .filter_map(|direction| direction.axis())
            {
                pickups.push(Pickup::of_axis(*quantity, axis));
            }
        }
        pickups
            .into_iter()
            .map(|pickup| self.effects.pickup(pickup))
            .collect()
    }
}

fn channels(readings: Vec<Reading>) -> Vec<Channel> {
    let mut channels: Vec<Channel> = readings
        .into_iter()
        .map(Reading::samples)
        .map(|(pickup, samples)| Channel {
            name: pickup.name,
            quantity: pickup.quantity,
            samples,
        })
        .collect();
    let lengths = channels.iter().map(|channel| channel.samples.len());
    let shortest = lengths.min().unwrap_or(0);
    for channel in &mut channels {
        channel.samples.truncate(shortest);
    }
    channels
}

impl Signal {
    /// The kind of recording that this excitation produces.
    pub fn kind(&self) -> TestKind {
        match self {
            Self::Tones { .. } => TestKind::Shaker,
            Self::StepSine { .. } => TestKind::StepSine,
            Self::Sweep { .. } => TestKind::Sweep,
            Self::Impacts { .. } => TestKind::Hammer,
            Self::Release { .. } => TestKind::FreeDecay,
        }
    }
}
