//! The accelerometer and the tachometer as they are: band, range, noise, 16 bits, a clock of its own, jitter.

use std::f64::consts::PI;

use quietcut_core::acceleration::{Block, Counts, MAX_BLOCK_SAMPLES, Sensor, is_clipped};
use quietcut_core::tachometer::{Edge, Wheel};
use quietcut_core::units::{Hertz, Nanoseconds};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

use super::{Model, Segment, Spindle, Workspace};

/// Standard gravity, m/s².
pub const STANDARD_GRAVITY: f64 = 9.806_65;
/// The motion is taken this many times as often as the sensor samples, and then filtered.
const OVERSAMPLING: usize = 4;
/// Half the length of the filter, in oversampled steps.
const HALF: usize = 32;

/// A digital accelerometer at the tool, its axes the machine's.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Accelerometer {
    /// Full scale, g: counts end at ±32 768.
    pub range_g: f64,
    /// White noise of each axis, g per √Hz.
    pub noise_g_per_root_hertz: f64,
    /// The rate it is meant to have, Hz.
    pub nominal_rate_hz: f64,
    /// How much faster its clock runs, as a fraction: up to 0.03 either way.
    pub clock_error: f64,
    /// Standard deviation of the time stamp of a block, s: how late the interrupt is served.
    pub stamp_jitter_s: f64,
}

/// A tachometer on the spindle. Its first edge after the gap, or its only one, is at spindle angle 0.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TachometerModel {
    /// The wheel.
    pub wheel: Wheel,
    /// Standard deviation of the time of an edge, s.
    pub jitter_s: f64,
}

impl Accelerometer {
    /// The IIS3DWB at ±16 g on its nominal clock; microcontrollers stamp to about a microsecond.
    pub const IIS3DWB_16G: Self = Self {
        range_g: 16.0,
        noise_g_per_root_hertz: 75e-6,
        nominal_rate_hz: 26_667.0,
        clock_error: 0.0,
        stamp_jitter_s: 1e-6,
    };

    /// The rate it really has, Hz.
    pub fn rate_hz(&self) -> f64 {
        self.nominal_rate_hz * (1.0 + self.clock_error)
    }

    /// What the signal chain is told of it: the nominal rate, not the true one.
    pub fn sensor(&self) -> Sensor {
        Sensor {
            nominal_rate: Hertz(self.nominal_rate_hz as f32),
            meters_per_second2_per_count: self.count() as f32,
            noise_meters_per_second2_per_root_hertz: (self.noise_g_per_root_hertz * STANDARD_GRAVITY) as f32,
        }
    }

    /// m/s² per count.
    fn count(&self) -> f64 {
        // The data sheet's 0.488 mg at 16 g, in proportion.
        0.488e-3 / 16.0 * self.range_g * STANDARD_GRAVITY
    }
}

/// Takes samples off the motion while it is computed.
///
/// Each sample is the acceleration through a filter of linear phase, flat to 0.23 and closed from 0.5 of the sample
/// rate (6.1 and 13.3 kHz for the IIS3DWB), without delay: a real one is late by a constant that its maker states. The
/// filter works on differences of the velocity over a quarter of a sample, so that a jump of the velocity is the
/// impulse that it is.
#[derive(Clone, Debug)]
pub struct Sampler {
    accelerometer: Accelerometer,
    step_s: f64,
    delay_s: f64,
    filter: [f64; 2 * HALF + 1],
    workspace: Workspace,
    /// Velocities taken so far; number k is that at (k − ½) steps.
    taken: usize,
    velocity: [f64; 3],
    /// The newest accelerations, a ring.
    ring: Vec<[f64; 3]>,
    samples: Vec<[f64; 3]>,
}

impl Sampler {
    /// A sampler of `model`'s motion from t = 0, where the tool is at rest.
    pub fn new(model: &Model, accelerometer: Accelerometer) -> Self {
        Self {
            accelerometer,
            delay_s: 0.0,
            step_s: 1.0 / (accelerometer.rate_hz() * OVERSAMPLING as f64),
            filter: low_pass(),
            workspace: Workspace::new(model),
            taken: 0,
            velocity: [0.0; 3],
            ring: vec![[0.0; 3]; 2 * HALF + 1],
            samples: Vec::new(),
        }
    }

    /// The same from where the modes have so many times their shapes at the tool: see [`Workspace::seeing`].
    #[must_use]
    pub fn seeing(self, model: &Model, modes: &[f64]) -> Self {
        Self {
            workspace: Workspace::seeing(model, modes),
            ..self
        }
    }

    /// The same with samples that are late by so much, s.
    #[must_use]
    pub fn late_by(self, delay_s: f64) -> Self {
        Self { delay_s, ..self }
    }

    /// How much longer than the last sample the motion must go on, s, but for the delay.
    pub fn tail_s(&self) -> f64 {
        (HALF + 1) as f64 * self.step_s
    }

    /// Takes what `segment` has.
    pub fn observe(&mut self, segment: &Segment<'_>) {
        loop {
            let t = (self.taken as f64 - 0.5) * self.step_s - self.delay_s;
            if t > segment.to_s() {
                return;
            }
            let velocity = if t < 0.0 {
                [0.0; 3]
            } else {
                segment.motion(t, &mut self.workspace).velocity_m_per_s
            };
            self.take(velocity);
        }
    }

    fn take(&mut self, velocity: [f64; 3]) {
        let length = self.ring.len();
        if self.taken > 0 {
            // This acceleration stands at step `taken − 1`.
            let index = self.taken - 1;
            self.ring[index % length] =
                std::array::from_fn(|axis| (velocity[axis] - self.velocity[axis]) / self.step_s);
            if index >= HALF && (index - HALF).is_multiple_of(OVERSAMPLING) {
                let mut sum = [0.0; 3];
                for (offset, weight) in self.filter.iter().enumerate() {
                    // Before the start the ring is still zero, as was the motion.
                    let acceleration = self.ring[(index + 1 + offset) % length];
                    for (sum, acceleration) in sum.iter_mut().zip(acceleration) {
                        *sum += weight * acceleration;
                    }
                }
                self.samples.push(sum);
            }
        }
        self.velocity = velocity;
        self.taken += 1;
    }

    /// The samples so far without noise, m/s²; number k is that at k over the sensor's rate.
    pub fn samples(&self) -> &[[f64; 3]] {
        &self.samples
    }

    /// The samples as counts in blocks, with noise, clips and time stamps; `seed` makes them repeat.
    pub fn blocks(&self, seed: u64) -> Vec<Block> {
        let Accelerometer {
            noise_g_per_root_hertz,
            stamp_jitter_s,
            ..
        } = self.accelerometer;
        let rate_hz = self.accelerometer.rate_hz();
        let count = self.accelerometer.count();
        // White to half the sample rate.
        let noise = noise_g_per_root_hertz * STANDARD_GRAVITY * (0.5 * rate_hz).sqrt();
        let mut noise_source = stream(seed, Stream::Noise);
        let mut stamp_source = stream(seed, Stream::Stamps);
        let mut blocks = Vec::with_capacity(self.samples.len() / MAX_BLOCK_SAMPLES + 1);
        for (number, samples) in self.samples.chunks(MAX_BLOCK_SAMPLES).enumerate() {
            let first_s = (number * MAX_BLOCK_SAMPLES) as f64 / rate_hz;
            let mut block = Block {
                sequence: number as u32,
                time: nanoseconds(first_s + stamp_jitter_s * normal(&mut stamp_source)),
                ..Block::default()
            };
            for sample in samples {
                let counts: Counts = sample.map(|acceleration| {
                    let felt = acceleration + noise * normal(&mut noise_source);
                    // The conversion saturates, as the sensor does.
                    (felt / count).round() as i16
                });
                block.clipped += u16::from(is_clipped(counts));
                // A chunk has at most as many samples as a block has room for.
                let _ = block.counts.push(counts);
            }
            blocks.push(block);
        }
        blocks
    }
}

impl TachometerModel {
    /// One mark per turn, stamped to two microseconds.
    pub const ONE_MARK: Self = Self {
        wheel: Wheel {
            positions: 1,
            missing: 0,
        },
        jitter_s: 2e-6,
    };

    /// The edges of a spindle from t = 0 to `end_s`, in their order; `seed` makes them repeat.
    pub fn edges(&self, spindle: &Spindle, end_s: f64, seed: u64) -> Vec<Edge> {
        let mut source = stream(seed, Stream::Edges);
        let mut edges: Vec<Edge> = self
            .true_edges_s(spindle, end_s)
            .map(|t| Edge {
                time: nanoseconds(t + self.jitter_s * normal(&mut source)),
            })
            .collect();
        edges.sort_by_key(|edge| edge.time);
        edges
    }

    /// When the edges really come, s.
    pub fn true_edges_s(&self, spindle: &Spindle, end_s: f64) -> impl Iterator<Item = f64> {
        let positions = u64::from(self.wheel.positions);
        let there = positions - u64::from(self.wheel.missing);
        let spindle = *spindle;
        (0_u64..)
            .map(move |number| {
                (
                    number,
                    spindle.time_s(std::f64::consts::TAU * number as f64 / positions as f64),
                )
            })
            .take_while(move |(_, t)| *t <= end_s)
            .filter(move |(number, _)| number % positions < there)
            .map(|(_, t)| t)
    }
}

/// What random numbers are for: each purpose has its own, so that one does not change another.
enum Stream {
    Noise = 1,
    Stamps = 2,
    Edges = 3,
}

fn stream(seed: u64, purpose: Stream) -> ChaCha8Rng {
    let mut source = ChaCha8Rng::seed_from_u64(seed);
    source.set_stream(purpose as u64);
    source
}

fn normal(source: &mut ChaCha8Rng) -> f64 {
    StandardNormal.sample(source)
}

fn nanoseconds(t: f64) -> Nanoseconds {
    // Jitter before the start of the clock is cut off by the conversion.
    Nanoseconds((t * 1e9).round() as u64)
}

/// A windowed sinc for the oversampled steps: half at 0.365 of the sample rate, Kaiser window with β = 7 (−70 dB).
fn low_pass() -> [f64; 2 * HALF + 1] {
    let cutoff = 0.365 / OVERSAMPLING as f64;
    let weights: [f64; 2 * HALF + 1] = std::array::from_fn(|index| {
        let n = index as f64 - HALF as f64;
        let sinc = if n == 0.0 {
            2.0 * cutoff
        } else {
            (2.0 * PI * cutoff * n).sin() / (PI * n)
        };
        let r = n / (HALF as f64 + 1.0);
        sinc * bessel_i0(7.0 * (1.0 - r * r).sqrt())
    });
    let sum: f64 = weights.iter().sum();
    weights.map(|weight| weight / sum)
}

/// The modified Bessel function of order 0, by its series.
fn bessel_i0(x: f64) -> f64 {
    let mut term = 1.0;
    let mut sum = 1.0;
    for k in 1..60 {
        term *= (0.5 * x / f64::from(k)).powi(2);
        sum += term;
    }
    sum
}
