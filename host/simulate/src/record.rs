//! Recording of a virtual cut: response channels, tachometer level and sidecar.

use std::f64::consts::TAU;
use std::path::Path;

use quietcut_core::tachometer::Wheel;

use super::anti_aliasing::decimated;
use super::criteria::SAMPLES_PER_PITCH_MIN;
use super::effect::{Effects, Pickup};
use super::sensor::{Accelerometer, Sampler, TachometerModel};
use super::{DenseStep, Model, Reading, Settings, Spindle, Statistics, VirtualCut, VirtualCutError};
use quietcut_model::case::Case;
use quietcut_model::structure::Direction;
use quietcut_recording::{Channel, Quantity, RecordedChannel, RecordedCut, Recording, Sidecar, TestKind};

/// Model of the data acquisition that records the motion of the tool.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Recorder {
    /// The digital accelerometer with its bandwidth, range, noise, 16-bit resolution and clock error; other quantities
    /// are sampled ideally.
    Sensor {
        /// Sensor model.
        accelerometer: Accelerometer,
        /// Seed of noise and jitter; the same seed gives the same recording.
        seed: u64,
    },
    /// Ideal sampling without noise and filter. If the velocity of the structure jumps with the force, acceleration
    /// samples are means over one sampling interval.
    Ideal {
        /// Sampling rate, Hz.
        rate_hz: f64,
    },
    /// Ideal sampling after one linear-phase anti-aliasing filter without delay: pass band to 0.35, stop band from 0.5
    /// of the rate. The tachometer is not filtered.
    Filtered {
        /// Sampling rate, Hz.
        rate_hz: f64,
        /// Rate at which the simulated motion is evaluated before the filter, divided by the sampling rate of the
        /// recording. With 0 or 1 there is no filter.
        oversampling: usize,
    },
}

impl Recorder {
    fn rate_hz(self) -> f64 {
        match self {
            Self::Sensor { accelerometer, .. } => accelerometer.rate_hz(),
            Self::Ideal { rate_hz } | Self::Filtered { rate_hz, .. } => rate_hz,
        }
    }

    fn oversampling(self) -> usize {
        match self {
            Self::Filtered { oversampling, .. } => oversampling.max(1),
            Self::Sensor { .. } | Self::Ideal { .. } => 1,
        }
    }
}

impl VirtualCut {
    /// Simulates the cut and records the [measured](Self::measured) quantities along those of x, y and z that the
    /// structure has, and the tachometer. `path` is the path of the recording's file.
    ///
    /// The time base is the true time, so that a sensor with a clock error has its true sampling rate. Forces,
    /// displacements and velocities are sampled at the same instants as the acceleration.
    ///
    /// # Errors
    /// As [`VirtualCut::sense`]; also a tachometer wheel too fine for the sampling rate.
    pub fn record(
        &self,
        case: &Case,
        recorder: Recorder,
        tachometer: TachometerModel,
        path: &Path,
    ) -> Result<(Recording, Statistics), VirtualCutError> {
        let model = self.model(case)?;
        let spindle = self.spindle(case)?;
        let rate_hz = recorder.rate_hz();
        let samples = (self.seconds * rate_hz).floor() as usize + 1;
        let pickups = self.pickups(case)?;
        let oversampling = recorder.oversampling();
        let mut readings: Vec<Reading> = pickups
            .iter()
            .map(|pickup| {
                let count = (samples - 1) * oversampling + 1;
                Reading::new(&model, pickup.clone(), rate_hz * oversampling as f64, count)
            })
            .collect();
        let mut sensors = Sensors::new(&model, recorder, &pickups);
        let tail_s = sensors.tail_s().max(1.0 / rate_hz);
        let statistics = model.run(self.seconds + tail_s, Settings::default(), |step| {
            readings.iter_mut().for_each(|reading| reading.observe(step));
            sensors.observe(step);
        })?;
        let seed = match recorder {
            Recorder::Sensor { seed, .. } => Some(seed),
            Recorder::Ideal { .. } | Recorder::Filtered { .. } => None,
        };
        let mut channels: Vec<Channel> = readings
            .into_iter()
            .map(Reading::samples)
            .map(|(pickup, truth)| Channel {
                name: pickup.name.clone(),
                quantity: pickup.quantity,
                samples: match sensors.measured(&pickup) {
                    Some(measured) => measured
                        .iter()
                        .take(samples)
                        .map(|value| pickup.read(*value))
                        .collect(),
                    None => decimated(truth, oversampling),
                },
            })
            .collect();
        channels.push(Channel {
            name: "tacho".into(),
            quantity: Quantity::Level,
            samples: self.level(tachometer, &spindle, rate_hz, samples, seed)?,
        });
        let shortest = channels
            .iter()
            .map(|channel| channel.samples.len())
            .min()
            .unwrap_or(0);
        for channel in &mut channels {
            channel.samples.truncate(shortest);
        }
        let recording = Recording {
            path: path.into(),
            sample_rate_hz: rate_hz,
            start_s: 0.0,
            since_s: 0.0,
            channels,
            sidecar: self.sidecar(case, tachometer.wheel)?,
        };
        Ok((recording, statistics))
    }

    /// The pickups of a virtual cut's response channels: for each quantity in the order of `measured`, along x, y and
    /// z.
    fn pickups(&self, case: &Case) -> Result<Vec<Pickup>, VirtualCutError> {
        let directions = &case.structure()?.directions;
        let effects = Effects::of_case(case)?.and(&self.effects);
        let mut pickups = Vec::new();
        for quantity in &self.measured {
            for direction in [Direction::X, Direction::Y, Direction::Z] {
                if let Some(axis) = direction.axis().filter(|_| directions.contains(&direction)) {
                    pickups.push(effects.pickup(Pickup::of_axis(*quantity, axis)));
                }
            }
        }
        Ok(pickups)
    }

    fn sidecar(&self, case: &Case, wheel: Wheel) -> Result<Sidecar, VirtualCutError> {
        let cut = case.cut()?;
        let mut sidecar = Sidecar {
            kind: Some(TestKind::Cutting),
            cut: Some(RecordedCut {
                spindle_rpm: Some(self.spindle_rpm),
                last_rpm: self.last_rpm,
                axial_depth_mm: Some(self.depth_mm),
                start_deg: Some(cut.start_deg),
                exit_deg: Some(cut.exit_deg),
                feed_per_tooth_mm: Some(cut.feed_per_tooth_mm),
                teeth: u32::try_from(case.tool()?.teeth).ok(),
            }),
            posture: case.posture.recorded(),
            ..Sidecar::default()
        };
        sidecar.channels.insert(
            "tacho".into(),
            RecordedChannel {
                pulses_per_rev: Some(wheel.positions),
                missing: Some(wheel.missing),
                ..RecordedChannel::default()
            },
        );
        Ok(sidecar)
    }

    /// Tachometer level, 0 to 1: high for half the shortest pitch period of the wheel after each edge. An edge rises
    /// over two samples, as after an anti-aliasing filter, so that its midpoint can be interpolated between samples.
    fn level(
        &self,
        tachometer: TachometerModel,
        spindle: &Spindle,
        rate_hz: f64,
        samples: usize,
        seed: Option<u64>,
    ) -> Result<Vec<f64>, VirtualCutError> {
        let [pitch_s, _] = spindle.bounds_s(TAU / f64::from(tachometer.wheel.positions));
        // Shortest pitch period of the wheel, s, that the sampling resolves.
        let least = SAMPLES_PER_PITCH_MIN / rate_hz;
        if pitch_s < least {
            return Err(VirtualCutError::WheelTooFine {
                positions: tachometer.wheel.positions,
                spindle_rpm: self.spindle_rpm,
                rate_hz,
                needed_hz: SAMPLES_PER_PITCH_MIN / pitch_s,
            });
        }
        let end_s = samples as f64 / rate_hz;
        let rises: Vec<f64> = match seed {
            None => tachometer.true_edges_s(spindle, end_s).collect(),
            Some(seed) => tachometer
                .edges(spindle, end_s, seed)
                .iter()
                .map(|edge| edge.time.0 as f64 * 1e-9)
                .collect(),
        };
        let mut level = vec![0.0; samples];
        for rise in rises {
            let fall = rise + 0.5 * pitch_s;
            let first = ((rise * rate_hz).floor() - 1.0).max(0.0) as usize;
            let last = ((fall * rate_hz).ceil() + 1.0) as usize;
            for (index, level) in level.iter_mut().enumerate().take(last + 1).skip(first) {
                let t = index as f64;
                let up = (0.5 + 0.5 * (t - rise * rate_hz)).clamp(0.0, 1.0);
                let down = (0.5 - 0.5 * (t - fall * rate_hz)).clamp(0.0, 1.0);
                *level = up.min(down).max(*level);
            }
        }
        Ok(level)
    }
}

/// The accelerometers of a recording: one for each combination of delay, dynamics and sensor location; none without
/// [`Recorder::Sensor`].
struct Sensors {
    accelerometer: Option<(Accelerometer, u64)>,
    /// Each simulated accelerometer, with the pickup of one of the channels that read it.
    samplers: Vec<(Pickup, Sampler)>,
}

/// True if two channels read the same accelerometer: same quantity, delay, location and dynamics.
fn is_one_sensor(a: &Pickup, b: &Pickup) -> bool {
    a.quantity == b.quantity && a.delay_s == b.delay_s && a.modes == b.modes && a.sections == b.sections
}

impl Sensors {
    fn new(model: &Model, recorder: Recorder, pickups: &[Pickup]) -> Self {
        let Recorder::Sensor { accelerometer, seed } = recorder else {
            return Self {
                accelerometer: None,
                samplers: Vec::new(),
            };
        };
        let mut samplers: Vec<(Pickup, Sampler)> = Vec::new();
        for pickup in pickups
            .iter()
            .filter(|pickup| pickup.quantity == Quantity::Acceleration)
        {
            if !samplers.iter().any(|(known, _)| is_one_sensor(known, pickup)) {
                let sampler = Sampler::new(model, accelerometer)
                    .at_sensor(model, &pickup.modes)
                    .late_by(pickup.delay_s)
                    .through(&pickup.sections);
                samplers.push((pickup.clone(), sampler));
            }
        }
        Self {
            accelerometer: Some((accelerometer, seed)),
            samplers,
        }
    }

    /// Time that the simulation must continue after the last sample of the recording, s, because the filters need later
    /// motion.
    fn tail_s(&self) -> f64 {
        self.samplers
            .iter()
            .map(|(pickup, sampler)| sampler.tail_s() - pickup.delay_s)
            .fold(0.0, f64::max)
    }

    fn observe(&mut self, step: &DenseStep<'_>) {
        for (_, sampler) in &mut self.samplers {
            sampler.observe(step);
        }
    }

    /// Accelerations along x, y and z, m/s², measured by the accelerometer that a channel reads; `None` for channels
    /// without an accelerometer.
    fn measured(&self, pickup: &Pickup) -> Option<Vec<[f64; 3]>> {
        let (accelerometer, seed) = self.accelerometer?;
        let (_, sampler) = self
            .samplers
            .iter()
            .find(|(known, _)| is_one_sensor(known, pickup))?;
        let count = f64::from(accelerometer.sensor().meters_per_second2_per_count);
        let blocks = sampler.blocks(seed);
        let counts = blocks.iter().flat_map(|block| &block.counts);
        Some(
            counts
                .map(|counts| counts.map(|value| f64::from(value) * count))
                .collect(),
        )
    }
}

#[cfg(test)]
mod tests;
