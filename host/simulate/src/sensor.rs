//! Models of a digital accelerometer (bandwidth, range, noise, 16-bit resolution, clock error) and of a tachometer
//! (jitter).

use std::f64::consts::PI;

use quietcut_core::acceleration::{Block, Counts, MAX_BLOCK_SAMPLES, Sensor, is_clipped};
use quietcut_core::tachometer::{Edge, Wheel};
use quietcut_core::units::{Hertz, Nanoseconds};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

use super::effect::FirstOrderSection;
use super::section_filter::SectionFilter;
use super::{DenseStep, Model, Spindle, Workspace};

/// Standard gravity, m/s².
pub const STANDARD_GRAVITY: f64 = 9.806_65;
/// Ratio of the rate at which the motion is evaluated to the sampling rate of the sensor. The number is a choice: the
/// difference of the velocity over a quarter of the sampling interval lowers the gain by 0.5 % at the upper end of the
/// pass band (sinc of 0.23/4).
const OVERSAMPLING: usize = 4;
/// Number of taps of the anti-aliasing filter on each side of its centre tap, at the oversampled rate. From Kaiser's
/// formula N = (A − 7.95)/(2.285 Δω) with a stop band of A = 70 dB and a transition band Δω = 2π·0.27/[`OVERSAMPLING`]:
/// N = 64 = 2·32.
const TAPS_PER_SIDE: usize = 32;

/// A simulated triaxial digital accelerometer, aligned with the machine axes. It reads the motion of the tool tip, or
/// of another point of the structure with [`Sampler::at_sensor`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Accelerometer {
    /// Full scale of the accelerometer, g, at about ±32 768 counts.
    pub range_g: f64,
    /// Amplitude spectral density of the white noise of each axis, g/√Hz.
    pub noise_g_per_root_hertz: f64,
    /// Nominal sampling rate, Hz.
    pub nominal_rate_hz: f64,
    /// Relative error of the accelerometer's clock, true rate over nominal rate − 1; within ± 0.03.
    pub clock_error: f64,
    /// Standard deviation of the time stamp of a block of samples, s, from the interrupt latency.
    pub stamp_jitter_s: f64,
}

/// A tachometer wheel on the spindle. An edge, the first one after the gap if there is a gap, is at the spindle
/// angle 0.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TachometerModel {
    /// Number of positions on the tachometer wheel, and number of missing ones, which form the gap.
    pub wheel: Wheel,
    /// Standard deviation of the time stamp of a tachometer edge, s.
    pub jitter_s: f64,
}

impl Accelerometer {
    /// The sensor IIS3DWB at ±16 g without clock error; time stamps of a microcontroller scatter by about 1 µs.
    pub const IIS3DWB_16G: Self = Self {
        range_g: 16.0,
        noise_g_per_root_hertz: 75e-6,
        nominal_rate_hz: 26_667.0,
        clock_error: 0.0,
        stamp_jitter_s: 1e-6,
    };

    /// True sampling rate of the accelerometer, Hz, with its clock error.
    pub fn rate_hz(&self) -> f64 {
        self.nominal_rate_hz * (1.0 + self.clock_error)
    }

    /// Sensor settings of the signal chain; they hold the nominal rate, not the true one.
    pub fn sensor(&self) -> Sensor {
        Sensor {
            nominal_rate: Hertz(self.nominal_rate_hz as f32),
            meters_per_second2_per_count: self.count() as f32,
            noise_meters_per_second2_per_root_hertz: (self.noise_g_per_root_hertz * STANDARD_GRAVITY) as f32,
        }
    }

    /// Resolution, m/s² per count.
    fn count(&self) -> f64 {
        // The data sheet states 0.488 mg per count at ±16 g; the resolution is proportional to the range.
        0.488e-3 / 16.0 * self.range_g * STANDARD_GRAVITY
    }
}

/// Samples the acceleration of the tool, or of a sensor location away from it, while the motion is integrated.
///
/// Each sample is the acceleration after a linear-phase low pass without delay: pass band to 0.23, stop band from 0.5
/// of the sampling rate (6.1 and 13.3 kHz for the IIS3DWB). A real sensor adds a constant delay, see [`Self::late_by`].
/// The filter input is the difference of the velocity over a quarter of the sampling interval, so that a jump of the
/// velocity acts as an impulse of acceleration.
#[derive(Clone, Debug)]
pub struct Sampler {
    accelerometer: Accelerometer,
    step_s: f64,
    delay_s: f64,
    filter: [f64; 2 * TAPS_PER_SIDE + 1],
    workspace: Workspace,
    /// Number of velocities of tool or sensor location taken so far. Velocity k belongs to the time (k − ½)·`step_s` −
    /// `delay_s`.
    taken: usize,
    velocity: [f64; 3],
    /// First-order sections in front of the accelerometer, which filter the velocity; `None` if there are none.
    dynamics: Option<SectionFilter<3>>,
    /// Ring buffer of the newest accelerations at the oversampled rate, m/s², for the anti-aliasing filter.
    ring: Vec<[f64; 3]>,
    samples: Vec<[f64; 3]>,
}

impl Sampler {
    /// A sampler of the motion of `model` at the tool; the tool is at rest before t = 0.
    pub fn new(model: &Model, accelerometer: Accelerometer) -> Self {
        Self {
            accelerometer,
            delay_s: 0.0,
            step_s: 1.0 / (accelerometer.rate_hz() * OVERSAMPLING as f64),
            filter: low_pass(),
            workspace: Workspace::new(model),
            taken: 0,
            velocity: [0.0; 3],
            dynamics: None,
            ring: vec![[0.0; 3]; 2 * TAPS_PER_SIDE + 1],
            samples: Vec::new(),
        }
    }

    /// This sampler at a location away from the tool; `modes` are the ratios of the mode shapes, see
    /// [`Workspace::at_sensor`].
    #[must_use]
    pub fn at_sensor(self, model: &Model, modes: &[f64]) -> Self {
        Self {
            workspace: Workspace::at_sensor(model, modes),
            ..self
        }
    }

    /// This sampler with a constant delay of all samples, s.
    #[must_use]
    pub fn late_by(self, delay_s: f64) -> Self {
        Self { delay_s, ..self }
    }

    /// This sampler behind first-order sections in series.
    #[must_use]
    pub fn through(self, sections: &[FirstOrderSection]) -> Self {
        let dynamics = (!sections.is_empty()).then(|| SectionFilter::at_rest(sections, [0.0; 3]));
        Self { dynamics, ..self }
    }

    /// Time that the simulation must continue after the last sample, s, apart from the sensor's delay: half the length
    /// of the anti-aliasing filter, rounded up to oversampled intervals.
    pub fn tail_s(&self) -> f64 {
        (TAPS_PER_SIDE + 1) as f64 * self.step_s
    }

    /// Takes the velocities that lie in the newest integration step, and the acceleration samples that follow from
    /// them.
    pub fn observe(&mut self, step: &DenseStep<'_>) {
        loop {
            let t = (self.taken as f64 - 0.5) * self.step_s - self.delay_s;
            if t > step.to_s() {
                if self.dynamics.is_some() {
                    self.velocity_at(step.to_s(), step);
                }
                return;
            }
            let velocity = if t < 0.0 {
                [0.0; 3]
            } else {
                self.velocity_at(t, step)
            };
            self.take(velocity);
        }
    }

    /// Velocity at the time `t`, s, within the step, behind the dynamics of the sensor.
    fn velocity_at(&mut self, t: f64, step: &DenseStep<'_>) -> [f64; 3] {
        let mut at = |t: f64| step.motion(t, &mut self.workspace).velocity_m_per_s;
        let Some(dynamics) = &mut self.dynamics else {
            return at(t);
        };
        let from_s = dynamics.until_s;
        dynamics.pass(t - from_s, [from_s, 0.5 * (from_s + t), t].map(&mut at))
    }

    fn take(&mut self, velocity: [f64; 3]) {
        let length = self.ring.len();
        if self.taken > 0 {
            // The difference of the last two velocities gives the acceleration of the oversampled interval with the
            // number `taken − 1`.
            let index = self.taken - 1;
            self.ring[index % length] =
                std::array::from_fn(|axis| (velocity[axis] - self.velocity[axis]) / self.step_s);
            if index >= TAPS_PER_SIDE && (index - TAPS_PER_SIDE).is_multiple_of(OVERSAMPLING) {
                let mut sum = [0.0; 3];
                for (offset, weight) in self.filter.iter().enumerate() {
                    // For times before t = 0 the ring buffer of accelerations holds zeros, because the tool is at rest.
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

    /// The samples so far without noise, m/s²; sample k belongs to the time k divided by the true sampling rate, minus
    /// the delay.
    pub fn samples(&self) -> &[[f64; 3]] {
        &self.samples
    }

    /// The samples as blocks of counts with noise, clipping and time stamps; the same seed gives the same blocks.
    pub fn blocks(&self, seed: u64) -> Vec<Block> {
        let Accelerometer {
            noise_g_per_root_hertz,
            stamp_jitter_s,
            ..
        } = self.accelerometer;
        let rate_hz = self.accelerometer.rate_hz();
        let count = self.accelerometer.count();
        // Standard deviation, m/s², of white noise with the bandwidth of half the sampling rate.
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
                    let measured = acceleration + noise * normal(&mut noise_source);
                    // The conversion to i16 saturates, as the sensor does.
                    (measured / count).round() as i16
                });
                block.clipped += u16::from(is_clipped(counts));
                // The push cannot fail: a chunk has at most as many samples as a block can hold.
                let _ = block.counts.push(counts);
            }
            blocks.push(block);
        }
        blocks
    }
}

impl TachometerModel {
    /// One edge per revolution with 2 µs standard deviation of its time stamp.
    pub const ONE_MARK: Self = Self {
        wheel: Wheel {
            positions: 1,
            missing: 0,
        },
        jitter_s: 2e-6,
    };

    /// Time stamps of the edges from t = 0 to `end_s`, s, with jitter, in the order of time; the same seed gives the
    /// same jitter.
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

    /// True times of the tachometer edges from t = 0 to `end_s`, s, without jitter.
    pub fn true_edges_s(&self, spindle: &Spindle, end_s: f64) -> impl Iterator<Item = f64> {
        let positions = u64::from(self.wheel.positions);
        let present = positions - u64::from(self.wheel.missing);
        let spindle = *spindle;
        (0_u64..)
            .map(move |number| {
                (
                    number,
                    spindle.time_s(std::f64::consts::TAU * number as f64 / positions as f64),
                )
            })
            .take_while(move |(_, t)| *t <= end_s)
            .filter(move |(number, _)| number % positions < present)
            .map(|(_, t)| t)
    }
}

/// Independent random streams of one seed: noise, time stamps of blocks and edges of the tachometer do not influence
/// each other.
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
    // The conversion to unsigned nanoseconds sets times before the start of the clock to 0.
    Nanoseconds((t * 1e9).round() as u64)
}

/// Weights of the anti-aliasing low pass at the oversampled rate: a sinc with the −6 dB point at 0.365 of the sampling
/// rate, under a Kaiser window with β = 7 (stop band −70 dB).
fn low_pass() -> [f64; 2 * TAPS_PER_SIDE + 1] {
    let cutoff = 0.365 / OVERSAMPLING as f64;
    let weights: [f64; 2 * TAPS_PER_SIDE + 1] = std::array::from_fn(|index| {
        let n = index as f64 - TAPS_PER_SIDE as f64;
        let sinc = if n == 0.0 {
            2.0 * cutoff
        } else {
            (2.0 * PI * cutoff * n).sin() / (PI * n)
        };
        let r = n / (TAPS_PER_SIDE as f64 + 1.0);
        sinc * bessel_i0(7.0 * (1.0 - r * r).sqrt())
    });
    let sum: f64 = weights.iter().sum();
    weights.map(|weight| weight / sum)
}

/// Modified Bessel function I₀(x), from its power series.
fn bessel_i0(x: f64) -> f64 {
    let mut term = 1.0;
    let mut sum = 1.0;
    for k in 1..60 {
        term *= (0.5 * x / f64::from(k)).powi(2);
        sum += term;
    }
    sum
}
