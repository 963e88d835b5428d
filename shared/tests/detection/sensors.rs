//! Accelerometer and tachometer of a session: blocks of counts with time stamps, and pulses with their faults.

use std::f64::consts::TAU;

use quietcut_core::acceleration::{Block, MAX_BLOCK_SAMPLES, Sensor, is_clipped};
use quietcut_core::tachometer::Edge;
use quietcut_core::units::Nanoseconds;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::session::{Motion, Session, Truth, normal};

/// The device's clock at the start of a session, ns.
const START_NS: f64 = 1e9;

/// A block of samples with the pulses up to its end, and the truth at its end.
pub struct Sensed {
    pub block: Block,
    pub edges: Vec<Edge>,
    /// Times of these pulses, s.
    pub edges_s: Vec<f64>,
    pub truth: Truth,
    /// End of the block, s.
    pub time_s: f64,
}

/// The sensors of a session.
pub struct Sensors<'a> {
    session: &'a Session,
    pub motion: Motion<'a>,
    pub sensor: Sensor,
    sample: usize,
    sequence: u32,
    turns: f64,
    pending: Vec<f64>,
    colour: [f64; 2],
    random: ChaCha8Rng,
}

impl<'a> Sensors<'a> {
    pub fn new(session: &'a Session) -> Self {
        Self {
            motion: Motion::new(session),
            sensor: Sensor::IIS3DWB_16G,
            sample: 0,
            sequence: 0,
            turns: 0.0,
            pending: Vec::new(),
            colour: [0.0; 2],
            random: ChaCha8Rng::seed_from_u64(session.seed ^ 0xacce1),
            session,
        }
    }

    pub fn rate_hz(&self) -> f64 {
        f64::from(self.sensor.nominal_rate.0)
    }

    /// The next block; `None` at the end of the session.
    pub fn block(&mut self) -> Option<Sensed> {
        let rate = self.rate_hz();
        let mut block = Block {
            sequence: self.sequence,
            time: at(self.sample as f64 / rate),
            ..Block::default()
        };
        let mut time_s = 0.0;
        for _ in 0..MAX_BLOCK_SAMPLES {
            time_s = self.sample as f64 / rate;
            let counts = self.counts(time_s)?;
            block.clipped += u16::from(is_clipped(counts));
            let _ = block.counts.push(counts);
            self.sample += 1;
        }
        self.sequence += 1;
        self.pending.sort_by(f64::total_cmp);
        let (due, later): (Vec<f64>, Vec<f64>) = self.pending.iter().partition(|&&edge| edge <= time_s);
        self.pending = later;
        Some(Sensed {
            block,
            edges: due.iter().map(|&time| Edge { time: at(time) }).collect(),
            edges_s: due,
            truth: self.motion.truth()?,
            time_s,
        })
    }

    fn counts(&mut self, time_s: f64) -> Option<[i16; 3]> {
        let rate = self.rate_hz();
        let faults = &self.session.faults;
        let [x, y] = self.motion.advance(time_s, 1.0 / rate)?;
        let angle = self.motion.angle;
        if angle.floor() > self.turns.floor() {
            // The pulse lies where the angle passed the whole turn.
            let late = (angle - angle.floor()) / (angle - self.turns) / rate;
            let edge = time_s - late + faults.jitter_s * normal(&mut self.random);
            if !self.random.random_bool(faults.missed) {
                self.pending.push(edge);
            }
            if self.random.random_bool(faults.doubled) {
                self.pending.push(edge + self.random.random_range(50e-6..3e-3));
            }
        }
        let speed = (angle - self.turns) * rate / self.session.machine.turns_per_second;
        self.turns = angle;
        let (rms, corner_hz) = faults.coloured;
        let keep = (-TAU * corner_hz / rate).exp();
        let innovation = rms * (1.0 - keep * keep).sqrt();
        for colour in &mut self.colour {
            *colour = keep * *colour + innovation * normal(&mut self.random);
        }
        let [(hz, amplitude), (order, with_speed)] = faults.hum;
        let hum = amplitude * (TAU * hz * time_s).sin() + with_speed * speed * (TAU * order * angle).sin();
        let turning = faults.unbalance * speed * speed;
        let felt = [
            x + hum + self.colour[0] + turning * (TAU * angle).cos() + 0.3,
            y + 0.5 * hum + self.colour[1] + turning * (TAU * angle).sin() - 0.2,
            0.3 * x + 9.8,
        ];
        let noise = f64::from(self.sensor.noise_meters_per_second2_per_root_hertz) * (0.5 * rate).sqrt();
        let scale = f64::from(self.sensor.meters_per_second2_per_count);
        Some(felt.map(|felt| {
            let value = (felt + noise * normal(&mut self.random)) / scale;
            value.round().clamp(-32768.0, 32767.0) as i16
        }))
    }
}

fn at(seconds: f64) -> Nanoseconds {
    Nanoseconds((START_NS + seconds * 1e9).round() as u64)
}
