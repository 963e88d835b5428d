//! A virtual cut as a recording.

use std::f64::consts::TAU;
use std::path::Path;

use quietcut_core::tachometer::Wheel;

use super::anti_aliasing::decimated;
use super::effect::{Effects, Pickup};
use super::sensor::{Accelerometer, Sampler, TachometerModel};
use super::{Model, Room, Segment, Settings, Spindle, Statistics, VirtualCut, VirtualCutError};
use crate::case::Case;
use crate::recording::{Channel, Kind, Quantity, RecordedChannel, RecordedCut, Recording, Sidecar};
use crate::structure::Direction;

/// How the motion of the tool is recorded.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Recorder {
    /// By the accelerometer: with its band, range, noise, 16 bits and clock; `seed` makes the noise repeat.
    Sensor {
        /// The sensor.
        accelerometer: Accelerometer,
        /// Seed of noise and jitter.
        seed: u64,
    },
    /// Without any fault, at this rate in Hz: the acceleration itself. Where a structure's velocity jumps there is none,
    /// and it is the mean over one sample.
    Ideal {
        /// Samples per second.
        rate_hz: f64,
    },
    /// As [`Self::Ideal`], all channels but the tachometer through one anti-aliasing filter of linear phase, flat to 0.35
    /// and closed from 0.5 of the rate, without delay.
    Filtered {
        /// Samples per second.
        rate_hz: f64,
        /// The motion is taken this many times as often, and then filtered.
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
    /// Cuts, and records what is [measured](Self::measured) in the directions of the structure, and the tachometer; `path`
    /// is where the recording will be written.
    ///
    /// Time is the true one: a sensor whose clock is off samples at another rate than it says. Forces and displacements
    /// are those at the instants of the samples.
    ///
    /// # Errors
    /// As [`VirtualCut::hear`], and a wheel too fine for the sample rate.
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
        let mut truth = Truth::new(
            &model,
            rate_hz * oversampling as f64,
            (samples - 1) * oversampling + 1,
            pickups.clone(),
        );
        let mut sensors = Sensors::new(&model, recorder, &pickups);
        let tail_s = sensors.tail_s().max(1.0 / rate_hz);
        let statistics = model.run(self.seconds + tail_s, Settings::default(), |segment| {
            truth.observe(segment);
            sensors.observe(segment);
        })?;
        let seed = match recorder {
            Recorder::Sensor { seed, .. } => Some(seed),
            Recorder::Ideal { .. } | Recorder::Filtered { .. } => None,
        };
        let mut channels: Vec<Channel> = pickups
            .iter()
            .zip(truth.channels())
            .map(|(pickup, truth)| Channel {
                name: pickup.name.clone(),
                quantity: pickup.quantity,
                samples: match sensors.felt(pickup) {
                    Some(felt) => felt
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
            channels,
            sidecar: self.sidecar(case, tachometer.wheel)?,
        };
        Ok((recording, statistics))
    }

    /// What is measured, by quantity and direction.
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
            kind: Some(Kind::Cutting),
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

    /// The level of the tachometer, 0 to 1: high for half a pitch of the wheel from each edge on. An edge rises over
    /// two samples, as an anti-aliased one does, so that its middle can be found between samples.
    fn level(
        &self,
        tachometer: TachometerModel,
        spindle: &Spindle,
        rate_hz: f64,
        samples: usize,
        seed: Option<u64>,
    ) -> Result<Vec<f64>, VirtualCutError> {
        let [pitch_s, _] = spindle.bounds_s(TAU / f64::from(tachometer.wheel.positions));
        // A rise and a fall of two samples each and a flat between.
        let least = 6.0 / rate_hz;
        if pitch_s < least {
            return Err(VirtualCutError::WheelTooFine {
                positions: tachometer.wheel.positions,
                spindle_rpm: self.spindle_rpm,
                rate_hz,
                needed_hz: 6.0 / pitch_s,
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

/// The accelerometers of a recording, one for each delay of its channels.
struct Sensors {
    accelerometer: Option<(Accelerometer, u64)>,
    samplers: Vec<(f64, Sampler)>,
}

impl Sensors {
    fn new(model: &Model, recorder: Recorder, pickups: &[Pickup]) -> Self {
        let Recorder::Sensor { accelerometer, seed } = recorder else {
            return Self {
                accelerometer: None,
                samplers: Vec::new(),
            };
        };
        let mut samplers: Vec<(f64, Sampler)> = Vec::new();
        for pickup in pickups
            .iter()
            .filter(|pickup| pickup.quantity == Quantity::Acceleration)
        {
            if !samplers.iter().any(|(delay_s, _)| *delay_s == pickup.delay_s) {
                let sampler = Sampler::new(model, accelerometer).late_by(pickup.delay_s);
                samplers.push((pickup.delay_s, sampler));
            }
        }
        Self {
            accelerometer: Some((accelerometer, seed)),
            samplers,
        }
    }

    /// How much longer than the last sample the motion must go on, s.
    fn tail_s(&self) -> f64 {
        self.samplers
            .iter()
            .map(|(delay_s, sampler)| sampler.tail_s() - delay_s)
            .fold(0.0, f64::max)
    }

    fn observe(&mut self, segment: &Segment<'_>) {
        for (_, sampler) in &mut self.samplers {
            sampler.observe(segment);
        }
    }

    /// What the sensor of a channel says, back in m/s²; `None` where it has none.
    fn felt(&self, pickup: &Pickup) -> Option<Vec<[f64; 3]>> {
        let (accelerometer, seed) = self.accelerometer?;
        let (_, sampler) = self
            .samplers
            .iter()
            .find(|(delay_s, _)| pickup.quantity == Quantity::Acceleration && *delay_s == pickup.delay_s)?;
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

/// What channels would say without a sensor's faults, each at its own delay, at a steady rate.
///
/// Where a structure has no acceleration at an instant it is the mean over one sample.
struct Truth {
    rate_hz: f64,
    samples: usize,
    room: Room,
    velocity_jumps: bool,
    /// Samples of each channel; where accelerations are means, its velocities half a sample before.
    channels: Vec<(Pickup, Vec<f64>)>,
}

impl Truth {
    fn new(model: &Model, rate_hz: f64, samples: usize, pickups: Vec<Pickup>) -> Self {
        Self {
            rate_hz,
            samples,
            room: Room::new(model),
            velocity_jumps: model.dynamics.velocity_jumps(),
            channels: pickups
                .into_iter()
                .map(|pickup| (pickup, Vec::with_capacity(samples + 1)))
                .collect(),
        }
    }

    fn observe(&mut self, segment: &Segment<'_>) {
        for (pickup, values) in &mut self.channels {
            let mean = self.velocity_jumps && pickup.quantity == Quantity::Acceleration;
            let (early, count) = if mean {
                (0.5, self.samples + 1)
            } else {
                (0.0, self.samples)
            };
            while values.len() < count {
                let t = (values.len() as f64 - early) / self.rate_hz - pickup.delay_s;
                if t > segment.to_s() {
                    break;
                }
                if t < 0.0 {
                    values.push(0.0);
                    continue;
                }
                let motion = segment.motion(t, &mut self.room);
                values.push(pickup.read(match pickup.quantity {
                    Quantity::Force => motion.force_n,
                    Quantity::Displacement => motion.displacement_m,
                    Quantity::Acceleration if !mean => motion.acceleration_m_per_s2.unwrap_or([0.0; 3]),
                    _ => motion.velocity_m_per_s,
                }));
            }
        }
    }

    fn channels(self) -> impl Iterator<Item = Vec<f64>> {
        let (rate_hz, velocity_jumps) = (self.rate_hz, self.velocity_jumps);
        self.channels.into_iter().map(move |(pickup, values)| {
            if velocity_jumps && pickup.quantity == Quantity::Acceleration {
                values
                    .windows(2)
                    .map(|pair| (pair[1] - pair[0]) * rate_hz)
                    .collect()
            } else {
                values
            }
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::recording::{Sensed, Speed};
    use crate::simulate::{Entry, tests::case};

    fn cut(rpm: f64, seconds: f64) -> VirtualCut {
        VirtualCut {
            entry: Entry::Ramp { seconds: 0.2 },
            ..VirtualCut::new(rpm, 1.0, seconds)
        }
    }

    #[test]
    fn what_is_recorded_replays_as_what_was_heard() {
        // The same cut straight to blocks, and by way of a recording.
        let case = case("kuka-kr90-acetal");
        let accelerometer = Accelerometer {
            clock_error: 0.02,
            stamp_jitter_s: 0.0,
            ..Accelerometer::IIS3DWB_16G
        };
        let tachometer = TachometerModel {
            jitter_s: 0.0,
            ..TachometerModel::ONE_MARK
        };
        let cut = cut(900.0, 3.0);
        let heard = cut.hear(&case, accelerometer, tachometer, 7).unwrap();
        let recorder = Recorder::Sensor {
            accelerometer,
            seed: 7,
        };
        let (recording, _) = cut
            .record(&case, recorder, tachometer, Path::new("cut.csv"))
            .unwrap();
        let names: Vec<&str> = recording
            .channels
            .iter()
            .map(|channel| channel.name.as_str())
            .collect();
        assert_eq!(
            names,
            ["fx", "fy", "fz", "x", "y", "z", "ax", "ay", "az", "tacho"]
        );
        let sensed = Sensed::new(&recording, Speed::default()).unwrap();
        assert_eq!(sensed.settings.tool.teeth, 2);
        assert_eq!(sensed.working_point.unwrap().axial_depth.0, 1.0);
        // The recording is scaled anew: samples agree to a count of the coarser of the two.
        let fine = f64::from(sensed.settings.sensor.meters_per_second2_per_count);
        let coarse = f64::from(accelerometer.sensor().meters_per_second2_per_count);
        for (a, b) in heard.blocks.iter().zip(&sensed.blocks) {
            assert!(a.time.0.abs_diff(b.time.0) <= 1);
            for (a, b) in a.counts.iter().zip(&b.counts) {
                for (a, b) in a.iter().zip(b) {
                    assert!((f64::from(*a) * coarse - f64::from(*b) * fine).abs() <= fine);
                }
            }
        }
        // Edges to a hundredth of a sample, once the detector knows the swing: the record begins in the middle of an
        // edge, and it learns by a quarter per turn.
        let edges: Vec<u64> = heard.edges.iter().map(|edge| edge.time.0).collect();
        let found: Vec<u64> = sensed.edges.iter().map(|edge| edge.time.0).collect();
        assert!(
            found.len() + 2 >= edges.len(),
            "{} of {}",
            found.len(),
            edges.len()
        );
        for edge in found.iter().filter(|edge| **edge > 2_000_000_000) {
            let nearest = edges.iter().map(|other| other.abs_diff(*edge)).min().unwrap();
            assert!(nearest < 400, "{edge}: {nearest} ns off");
        }
    }

    #[test]
    fn the_ideal_record_obeys_the_equation_of_motion() {
        let case = case("kuka-kr90-full-cubic");
        let (recording, _) = cut(900.0, 1.0)
            .record(
                &case,
                Recorder::Ideal { rate_hz: 5000.0 },
                TachometerModel::ONE_MARK,
                Path::new("cut.csv"),
            )
            .unwrap();
        let crate::structure::Form::Matrices(m) = &case.structure.as_ref().unwrap().form else {
            panic!("matrices")
        };
        let of = |name: &str, k: usize| recording.channel(name).unwrap().samples[k];
        let pair = |prefix: &str, k| {
            nalgebra::Vector2::new(of(&format!("{prefix}x"), k), of(&format!("{prefix}y"), k))
        };
        let dt = 1.0 / 5000.0;
        let mut worst: f64 = 0.0;
        for k in 1..recording.len() - 1 {
            // Velocity by the central difference, good to (ω dt)²/6: the damping forces are small.
            let v = (pair("", k + 1) - pair("", k - 1)) / (2.0 * dt);
            let x = pair("", k);
            let residual = &m.mass * pair("a", k)
                + &m.damping * v
                + &m.stiffness * x
                + m.cubic_damping.as_ref().unwrap() * v.map(|v| v.powi(3))
                + m.cubic_stiffness.as_ref().unwrap() * x.map(|x| x.powi(3))
                - pair("f", k);
            worst = worst.max(residual.amax());
        }
        // Forces are up to 11 N; a kink of the motion within the difference leaves some millinewtons.
        assert!(worst < 0.02, "{worst}");
        let largest = (0..recording.len())
            .map(|k| pair("f", k).amax())
            .fold(0.0, f64::max);
        assert!(largest > 5.0, "{largest}");
    }

    #[test]
    fn mean_accelerations_add_up_to_the_velocity_where_it_jumps() {
        let case = case("kuka-kr90-acetal");
        let (recording, _) = cut(900.0, 1.0)
            .record(
                &case,
                Recorder::Ideal { rate_hz: 2000.0 },
                TachometerModel::ONE_MARK,
                Path::new("cut.csv"),
            )
            .unwrap();
        let a = &recording.channel("ay").unwrap().samples;
        let y = &recording.channel("y").unwrap().samples;
        let dt = 1.0 / 2000.0;
        let (mut speed, mut place, mut worst) = (0.0, 0.0, 0.0_f64);
        for k in 0..a.len() {
            worst = worst.max((place - y[k]).abs());
            speed += a[k] * dt;
            place += speed * dt;
        }
        let largest = y.iter().fold(0.0_f64, |a, b| a.max(b.abs()));
        // Twice summed, the error of the rectangle rule is of the order of dt times the velocity.
        assert!(worst < 0.05 * largest, "{worst} of {largest}");
    }

    #[test]
    fn channels_may_be_late_scaled_and_left_out() {
        let case = case("kuka-kr90-full-cubic");
        let recorder = Recorder::Ideal { rate_hz: 5000.0 };
        let record = |effects: &[&str], measured: &[Quantity]| {
            let cut = VirtualCut {
                effects: Effects::parse(effects.iter().copied()).unwrap(),
                measured: measured.to_vec(),
                ..cut(900.0, 1.0)
            };
            let path = Path::new("cut.csv");
            cut.record(&case, recorder, TachometerModel::ONE_MARK, path)
                .unwrap()
                .0
        };
        let plain = record(
            &[],
            &[Quantity::Force, Quantity::Displacement, Quantity::Velocity],
        );
        let faulty = record(
            &[
                "sensor-delay=0.0012",
                "sensor-delay.channel=x",
                "sensor-gain=1.2",
                "sensor-gain.channel=vy",
            ],
            &[Quantity::Displacement, Quantity::Velocity],
        );
        assert!(faulty.channel("fx").is_none() && plain.channel("fx").is_some());
        let of = |recording: &Recording, name: &str, k: usize| recording.channel(name).unwrap().samples[k];
        for k in 6..plain.len() {
            // Six samples late, to rounding of the time.
            assert!((of(&faulty, "x", k) - of(&plain, "x", k - 6)).abs() < 1e-15);
            assert_eq!(of(&faulty, "vy", k), 1.2 * of(&plain, "vy", k));
            assert_eq!(of(&faulty, "y", k), of(&plain, "y", k));
        }
    }

    #[test]
    fn a_wheel_too_fine_for_the_rate_is_refused() {
        let fine = TachometerModel {
            wheel: Wheel {
                positions: 60,
                missing: 2,
            },
            jitter_s: 0.0,
        };
        let error = cut(10_000.0, 1.0)
            .record(
                &case("kuka-kr90-acetal"),
                Recorder::Ideal { rate_hz: 26_667.0 },
                fine,
                Path::new("cut.csv"),
            )
            .unwrap_err();
        assert!(error.to_string().contains("60000 Hz"), "{error}");
    }
}
