//! Virtual test rigs: a shaker, a hammer or a hand on a structure, and the sensors that record it.

mod noise;
mod signal;

#[cfg(test)]
mod tests;

use std::path::Path;

pub use noise::Noise;
pub use signal::{Impact, Signal, Step};

use super::effect::{Effects, Pickup};
use super::{Drive, Model, Reading, Settings, SimulateError, Statistics};
use quietcut_model::structure::{Direction, Structure};
use quietcut_recording::{Channel, Kind, Quantity, Recording, Sidecar};

/// A test of a structure.
#[derive(Clone, Debug)]
pub struct Rig {
    /// The direction in which the force acts.
    pub direction: Direction,
    /// The force that is asked for.
    pub signal: Signal,
    /// How much less the force is per velocity of the tool, N s/m, at a shaker whose amplitude is not controlled: its
    /// force drops where the structure resonates. The recorded force is the true one.
    pub drop_ns_per_m: f64,
    /// Samples per second.
    pub sample_rate_hz: f64,
    /// What is measured besides the force, in every direction of the structure.
    pub measured: Vec<Quantity>,
    /// What the structure or the sensors have that the case has not.
    pub effects: Effects,
}

/// The force of a rig along one axis.
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
    /// A rig that measures displacement and acceleration.
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

    /// The recording without noise, from rest at t = 0; `path` is where it will be written.
    ///
    /// # Errors
    /// The structure is indefinite or has not the direction, an effect cannot be, or the motion diverges.
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
        let (dynamics, terms) = self.effects.dynamics(structure)?;
        let model = Model {
            dynamics,
            cutting: None,
            drive: Some(Box::new(Driven {
                axis,
                signal: self.signal.clone(),
                drop_ns_per_m: self.drop_ns_per_m,
            })),
            terms,
        };
        let seconds = self.signal.duration_s();
        let count = (seconds * self.sample_rate_hz).floor() as usize;
        let mut readings: Vec<Reading> = self
            .pickups(structure, axis)
            .into_iter()
            .map(|pickup| Reading::new(&model, pickup, self.sample_rate_hz, count))
            .collect();
        let statistics = model.run(seconds, Settings::default(), |segment| {
            readings.iter_mut().for_each(|reading| reading.observe(segment));
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

    /// The force channel, then what is measured, by quantity and direction.
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
    /// What kind of recording it makes.
    pub fn kind(&self) -> Kind {
        match self {
            Self::Tones { .. } => Kind::Shaker,
            Self::StepSine { .. } => Kind::StepSine,
            Self::Sweep { .. } => Kind::Sweep,
            Self::Impacts { .. } => Kind::Hammer,
            Self::Release { .. } => Kind::FreeDecay,
        }
    }
}
