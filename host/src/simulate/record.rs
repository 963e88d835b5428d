//! A virtual cut as a recording.

use std::f64::consts::TAU;
use std::path::Path;

use quietcut_core::tachometer::Wheel;

use super::effect::{EffectError, Effects, Pickup};
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
}

impl Recorder {
    fn rate_hz(self) -> f64 {
        match self {
            Self::Sensor { accelerometer, .. } => accelerometer.rate_hz(),
            Self::Ideal { rate_hz } => rate_hz,
        }
    }
}

impl VirtualCut {
    /// Cuts, and records forces on the tool, its displacement and acceleration in the directions of the structure, and
    /// the tachometer; `path` is where the recording will be written.
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
        let spindle = Spindle::new(self.spindle_rpm);
        let rate_hz = recorder.rate_hz();
        let samples = (self.seconds * rate_hz).floor() as usize + 1;
        let mut truth = Truth::new(&model, rate_hz, samples);
        let mut sampler = match recorder {
            Recorder::Sensor { accelerometer, .. } => Some(Sampler::new(&model, accelerometer)),
            Recorder::Ideal { .. } => None,
        };
        let tail_s = sampler.as_ref().map_or(1.0 / rate_hz, Sampler::tail_s);
        let statistics = model.run(self.seconds + tail_s, Settings::default(), |segment| {
            truth.observe(segment);
            if let Some(sampler) = &mut sampler {
                sampler.observe(segment);
            }
        })?;
        let (accelerations, seed) = match (recorder, sampler) {
            (Recorder::Sensor { accelerometer, seed }, Some(sampler)) => {
                (felt(&sampler, accelerometer, seed), Some(seed))
            }
            _ => (truth.accelerations(), None),
        };
        let directions = &case.structure()?.directions;
        let effects = Effects::of_case(case)?.and(&self.effects);
        let mut channels = Vec::new();
        let series: [(Quantity, &[[f64; 3]]); 3] = [
            (Quantity::Force, &truth.forces_n),
            (Quantity::Displacement, &truth.displacements_m),
            (Quantity::Acceleration, &accelerations),
        ];
        for (quantity, values) in series {
            for direction in [Direction::X, Direction::Y, Direction::Z] {
                let Some(axis) = direction.axis().filter(|_| directions.contains(&direction)) else {
                    continue;
                };
                let pickup = effects.pickup(Pickup::of_axis(quantity, axis));
                if pickup.delay_s != 0.0 {
                    return Err(EffectError::Structure {
                        name: "sensor-delay",
                        what: "the channels of a cut cannot be late yet; those of --experiment can".into(),
                    }
                    .into());
                }
                channels.push(Channel {
                    name: pickup.name.clone(),
                    quantity,
                    samples: values
                        .iter()
                        .take(samples)
                        .map(|value| pickup.read(*value))
                        .collect(),
                });
            }
        }
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

    fn sidecar(&self, case: &Case, wheel: Wheel) -> Result<Sidecar, VirtualCutError> {
        let cut = case.cut()?;
        let mut sidecar = Sidecar {
            kind: Some(Kind::Cutting),
            cut: Some(RecordedCut {
                spindle_rpm: Some(self.spindle_rpm),
                axial_depth_mm: Some(self.depth_mm),
                start_deg: Some(cut.start_deg),
                exit_deg: Some(cut.exit_deg),
                feed_per_tooth_mm: Some(cut.feed_per_tooth_mm),
                teeth: u32::try_from(case.tool()?.teeth).ok(),
            }),
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
        let pitch_s = spindle.time_s(TAU / f64::from(tachometer.wheel.positions));
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

/// What the sensor says, back in m/s².
fn felt(sampler: &Sampler, accelerometer: Accelerometer, seed: u64) -> Vec<[f64; 3]> {
    let count = f64::from(accelerometer.sensor().meters_per_second2_per_count);
    sampler
        .blocks(seed)
        .iter()
        .flat_map(|block| &block.counts)
        .map(|counts| counts.map(|value| f64::from(value) * count))
        .collect()
}

/// The motion itself, at a steady rate.
struct Truth {
    rate_hz: f64,
    samples: usize,
    room: Room,
    forces_n: Vec<[f64; 3]>,
    displacements_m: Vec<[f64; 3]>,
    accelerations: Vec<[f64; 3]>,
    /// Where there is no acceleration at an instant: velocities half a sample before each sample.
    velocities: Option<Vec<[f64; 3]>>,
}

impl Truth {
    fn new(model: &Model, rate_hz: f64, samples: usize) -> Self {
        Self {
            rate_hz,
            samples,
            room: Room::new(model),
            forces_n: Vec::with_capacity(samples),
            displacements_m: Vec::with_capacity(samples),
            accelerations: Vec::with_capacity(samples),
            velocities: model
                .dynamics
                .velocity_jumps()
                .then(|| Vec::with_capacity(samples + 1)),
        }
    }

    fn observe(&mut self, segment: &Segment<'_>) {
        while self.forces_n.len() < self.samples {
            let t = self.forces_n.len() as f64 / self.rate_hz;
            if t > segment.to_s() {
                break;
            }
            let motion = segment.motion(t, &mut self.room);
            self.forces_n.push(motion.force_n);
            self.displacements_m.push(motion.displacement_m);
            self.accelerations.extend(motion.acceleration_m_per_s2);
        }
        if let Some(velocities) = &mut self.velocities {
            while velocities.len() <= self.samples {
                let t = (velocities.len() as f64 - 0.5) / self.rate_hz;
                if t > segment.to_s() {
                    break;
                }
                velocities.push(if t < 0.0 {
                    [0.0; 3]
                } else {
                    segment.motion(t, &mut self.room).velocity_m_per_s
                });
            }
        }
    }

    fn accelerations(&self) -> Vec<[f64; 3]> {
        let Some(velocities) = &self.velocities else {
            return self.accelerations.clone();
        };
        velocities
            .windows(2)
            .map(|pair| std::array::from_fn(|axis| (pair[1][axis] - pair[0][axis]) * self.rate_hz))
            .collect()
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
