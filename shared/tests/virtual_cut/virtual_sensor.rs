//! A virtual accelerometer and tachometer on a virtual cut: blocks of counts with time stamps, and edges.

use quietcut_core::acceleration::{Block, MAX_BLOCK_SAMPLES, Sensor, is_clipped};
use quietcut_core::tachometer::{Edge, Wheel};
use quietcut_core::units::Nanoseconds;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::milling::{Milling, Step};

/// Errors of the virtual sensors.
#[derive(Clone, Copy, Debug)]
pub struct VirtualSensor {
    pub sensor: Sensor,
    /// Ratio of the motion of the sensor to the motion of the tool tip.
    pub transmission: f64,
    /// Ratio of the true sample rate to the nominal one.
    pub clock: f64,
    /// Largest delay of the time stamp of a block, in s.
    pub stamp_jitter_s: f64,
    /// Standard deviation of the time of a tachometer edge, in s.
    pub edge_jitter_s: f64,
    pub wheel: Wheel,
    /// Root spectral density of a white force on the structure in each direction, in N/√Hz.
    pub force_noise: f64,
    pub seed: u64,
}

impl VirtualSensor {
    /// An IIS3DWB at ±16 g with a one-pulse tachometer.
    pub fn usual(seed: u64) -> Self {
        Self {
            sensor: Sensor::IIS3DWB_16G,
            transmission: 1.0,
            clock: 1.0,
            stamp_jitter_s: 20e-6,
            edge_jitter_s: 5e-6,
            wheel: Wheel {
                positions: 1,
                missing: 0,
            },
            force_noise: 0.0,
            seed,
        }
    }
}

/// The signals that the device gets, and the true motion.
pub struct Capture {
    /// Each block with the tachometer edges up to its end.
    pub blocks: Vec<(Block, Vec<Edge>)>,
    /// For each tooth period, the largest distance of the tool from `centre`, in m.
    pub excursion_m: Vec<f64>,
    pub tooth_period_s: f64,
    /// True rate of the sensor, in Hz.
    pub rate: f64,
}

/// Time in ns of the device's clock at the start of the cut.
const START_NS: f64 = 3e9;

/// A standard normal variate (Box–Muller).
fn normal(random: &mut ChaCha8Rng) -> f64 {
    let u: f64 = 1.0 - random.random::<f64>();
    let v: f64 = random.random();
    (-2.0 * u.ln()).sqrt() * (std::f64::consts::TAU * v).cos()
}

/// Position at a fraction of a step, from its cubic.
fn position(step: &Step, part: f64, dt: f64) -> [f64; 3] {
    let (a, b) = (part, 1.0 - part);
    [0, 1, 2].map(|d| {
        let ([p, q], [v, w]) = (step.position, step.velocity);
        b * b * (1.0 + 2.0 * a) * p[d]
            + a * a * (3.0 - 2.0 * a) * q[d]
            + dt * (a * b * b * v[d] - a * a * b * w[d])
    })
}

/// Simulates a cut and measures it with the sensors. Excursions are distances from `centre`.
pub fn capture(mut milling: Milling, seconds: f64, with: &VirtualSensor, centre: [f64; 3]) -> Capture {
    let mut random = ChaCha8Rng::seed_from_u64(with.seed);
    let rate = f64::from(with.sensor.nominal_rate.0) * with.clock;
    let (dt, period, turn) = (milling.dt(), milling.tooth_period_s(), milling.turn_s());
    let scale = f64::from(with.sensor.meters_per_second2_per_count);
    let noise = f64::from(with.sensor.noise_meters_per_second2_per_root_hertz) * (0.5 * rate).sqrt();
    let per_tooth = (period / dt).round() as usize;
    let mut excursion_m = Vec::new();
    let (mut largest, mut steps) = (0.0_f64, 0_usize);
    let mut current = milling.advance();
    let mut at = |time: f64, random: &mut ChaCha8Rng| {
        while time >= (steps + 1) as f64 * dt {
            let tip = current.position[1];
            largest = largest.max((0..3).map(|d| (tip[d] - centre[d]).powi(2)).sum::<f64>().sqrt());
            steps += 1;
            if steps % per_tooth == 0 {
                excursion_m.push(largest);
                largest = 0.0;
            }
            let force = with.force_noise * (0.5 / dt).sqrt();
            if force > 0.0 {
                milling.disturbance_n = [0; 3].map(|_| force * normal(random));
            }
            current = milling.advance();
        }
        position(&current, time / dt - steps as f64, dt)
    };
    let (mut before, mut here) = (at(0.0, &mut random), at(1.0 / rate, &mut random));
    let gravity = [0.3, -0.2, 9.8];
    let samples = (seconds * rate) as usize;
    let mut blocks = Vec::new();
    let mut block = Block::default();
    let positions = u64::from(with.wheel.positions);
    let edge_time = |edge: u64| edge as f64 / positions as f64 * turn;
    let mut next_edge = 0_u64;
    for n in 1..samples {
        let after = at((n + 1) as f64 / rate, &mut random);
        let counts = [0, 1, 2].map(|d| {
            let acceleration = (after[d] - 2.0 * here[d] + before[d]) * rate * rate;
            let felt = with.transmission * acceleration + gravity[d] + noise * normal(&mut random);
            (felt / scale).round().clamp(-32768.0, 32767.0) as i16
        });
        (before, here) = (here, after);
        if block.counts.is_empty() {
            let late = if with.stamp_jitter_s > 0.0 {
                random.random_range(0.0..with.stamp_jitter_s)
            } else {
                0.0
            };
            block.time = Nanoseconds((START_NS + (n as f64 / rate + late) * 1e9).round() as u64);
        }
        block.clipped += u16::from(is_clipped(counts));
        let _ = block.counts.push(counts);
        if block.counts.len() == MAX_BLOCK_SAMPLES {
            let end = n as f64 / rate;
            let mut edges = Vec::new();
            while edge_time(next_edge) <= end {
                if next_edge % positions < u64::from(with.wheel.positions - with.wheel.missing) {
                    let time = edge_time(next_edge) + with.edge_jitter_s * normal(&mut random);
                    edges.push(Edge {
                        time: Nanoseconds((START_NS + time * 1e9).round() as u64),
                    });
                }
                next_edge += 1;
            }
            let sequence = block.sequence + 1;
            blocks.push((std::mem::take(&mut block), edges));
            block.sequence = sequence;
        }
    }
    Capture {
        blocks,
        excursion_m,
        tooth_period_s: period,
        rate,
    }
}
