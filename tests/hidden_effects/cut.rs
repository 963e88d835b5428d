//! Cuts with all details of the chip: entry and exit of teeth at their angles, the surface that all earlier passes left, and loss of
//! contact.

use std::cell::Cell;
use std::f64::consts::TAU;
use std::fmt::Write as _;
use std::sync::OnceLock;

use nalgebra::DMatrix;
use quietcut::recording::{Channel, Quantity, RecordedChannel, RecordedCut, Recording, Sidecar, TestKind};
use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

use super::cause::{Cause, EffectKind, PROCESS, RESTORING, Scale};
use super::chip::{Chips, Run};
use super::disturbance::Disturbance;
use super::job::{CutScale, Job};
use super::machine::{Machine, between};
use super::motion::{Path, System};
use super::oracle::{Lab, Output};
use super::process::Process;
use super::sensor::{Sensor, letter, noisy, read_by};
use super::signal::interpolated;
use super::uncertainty;

/// Cuts of a machine, with the sensors that record them.
pub(crate) struct CutBench {
    pub(crate) machine: Machine,
    pub(crate) job: Job,
    runs: Vec<Run>,
    /// True if forces are measured. Their channels come before those of motion.
    forces: bool,
    motion: Vec<Sensor>,
    pub(crate) rate_hz: f64,
    samples: usize,
    /// Number of samples before the record, in which the transient of the cut decays.
    before: usize,
    steps: usize,
    pub(crate) scale: Scale,
    /// Machine and job of the case, where they differ from the true ones.
    stated: Option<(Machine, Job)>,
    /// By cut: what a workshop adds.
    disturbances: Vec<Disturbance>,
    /// Motions of the baseline. Sensor errors need no others.
    plain: OnceLock<Vec<Motion>>,
}

impl CutBench {
    /// Draws two or three stable cuts of a machine with two or three directions, at different speeds and feeds.
    pub(crate) fn draw(random: &mut ChaCha8Rng, forces: bool) -> Self {
        let directions = if random.random::<f64>() < 0.3 { 3 } else { 2 };
        let mut machine = Machine::draw(random, directions);
        // The transient must decay within a few revolutions: soft machines with little damping would need long records.
        machine.damping *= 3.0;
        let mut teeth = random.random_range(2..=4);
        let ktc = between(random, 70.0, 1500.0);
        let (start_deg, exit_deg) = [
            (90.0, 180.0),
            (0.0, 90.0),
            (0.0, 180.0),
            (120.0, 180.0),
            (0.0, 70.0),
        ][random.random_range(0..5)];
        // Four teeth in a slot give a constant force without vibration.
        if teeth == 4 && exit_deg - start_deg == 180.0 {
            teeth = 3;
        }
        let feed_mm = between(random, 0.05, 0.2);
        let edges = if random.random::<bool>() {
            between(random, 0.05, 0.2) * ktc * feed_mm
        } else {
            0.0
        };
        let job = Job {
            teeth,
            edge_angle_deg: if directions == 3 {
                random.random_range(45.0..75.0)
            } else {
                90.0
            },
            diameter_mm: between(random, 8.0, 40.0),
            cutting_mpa: [
                ktc,
                ktc * random.random_range(0.15..0.5),
                if directions == 3 {
                    ktc * random.random_range(0.05..0.3)
                } else {
                    0.0
                },
            ],
            edge_n_per_mm: [edges, 0.7 * edges, 0.0],
            start_deg,
            exit_deg,
            feed_mm,
            runout: [0.0; 2],
        };
        let tooth_hz = machine.omega[0] / TAU * random.random_range(0.35..1.6);
        let rpm = 60.0 * tooth_hz / teeth as f64;
        // The loop gain is below one at every frequency, so that the cut is stable at any speed.
        let compliance = machine.axes.iter().fold(0.0_f64, |most, &a| {
            let (m, c, k) = (
                machine.mass[(a, a)],
                machine.damping[(a, a)],
                machine.stiffness[(a, a)],
            );
            most.max(1.0 / (c * (k / m).sqrt()))
        });
        let cutting = 1.0 + (exit_deg - start_deg) / 360.0 * teeth as f64;
        let depth_mm = random.random_range(0.1..0.4) * 1e3 / (2.0 * cutting * ktc * 1e6 * compliance);
        let count = if random.random::<f64>() < 0.7 { 2 } else { 3 };
        let runs: Vec<Run> = (0..count)
            .map(|index| Run {
                rpm: rpm * [1.0, 1.37, 0.8][index],
                depth_mm: depth_mm * [1.0, 0.9, 0.6][index],
                feed_mm: feed_mm * [1.0, 0.6, 1.3][index],
                angle: random.random_range(0.0..TAU),
                jumped: 0,
            })
            .collect();
        let fastest = runs.iter().fold(0.0_f64, |most, run| most.max(run.rpm)) / 60.0 * teeth as f64;
        let rate_hz = (48.0 * fastest).max(16.0 * machine.omega[1] / TAU);
        let steps = (machine.omega[1] / (0.12 * rate_hz)).max(2.0).ceil() as usize;
        let turns = 24.0;
        let samples = (turns * 60.0 / rpm * rate_hz) as usize;
        let slowest = machine.axes.iter().fold(f64::INFINITY, |least, &a| {
            least.min(0.5 * machine.damping[(a, a)] / machine.mass[(a, a)])
        });
        let before = ((8.0 / slowest).min(40.0 * 60.0 / rpm) * rate_hz) as usize;
        let acceleration = random.random::<f64>() < 0.4;
        let motion = machine
            .axes
            .iter()
            .map(|&axis| Sensor {
                axis,
                acceleration,
                at_housing: false,
            })
            .collect();
        let scale = Scale {
            peak_m: 1e-3 * feed_mm,
            seconds: samples as f64 / rate_hz,
            sample_s: 1.0 / rate_hz,
            cut: Some(CutScale {
                job: job.clone(),
                depth_mm,
                rpm,
            }),
        };
        Self {
            machine,
            job,
            runs,
            forces,
            motion,
            rate_hz,
            samples,
            before,
            steps,
            scale,
            stated: None,
            disturbances: Vec::new(),
            plain: OnceLock::new(),
        }
    }

    /// This bench in a workshop: the tool has runout, the case is known from tests only, and cuts and records are disturbed.
    ///
    /// Restoring forces are then scaled by the motion of the baseline.
    pub(crate) fn in_workshop(mut self, random: &mut ChaCha8Rng) -> Self {
        self.job.runout = [
            between(random, 5.0, 20.0).min(200.0 * self.job.feed_mm),
            random.random_range(0.0..360.0),
        ];
        let z: Vec<f64> = (0..uncertainty::count(&self.machine))
            .map(|_| StandardNormal.sample(random))
            .collect();
        self.stated = Some(uncertainty::moved(&self.machine, &self.job, &z));
        self.disturbances = self.runs.iter().map(|_| Disturbance::draw(random)).collect();
        let motion = self.motion(&self.runs[0], &[], None);
        self.scale.peak_m = motion.half_range_m();
        self
    }

    /// This bench with machine and job that differ by `z` standard deviations.
    pub(crate) fn moved(&self, z: &[f64]) -> Self {
        let (machine, job) = uncertainty::moved(&self.machine, &self.job, z);
        Self {
            machine,
            job,
            runs: self.runs.clone(),
            motion: self.motion.clone(),
            scale: self.scale.clone(),
            stated: self.stated.clone(),
            disturbances: self.disturbances.clone(),
            plain: OnceLock::new(),
            ..*self
        }
    }

    /// Output of the disturbed cuts.
    pub(crate) fn disturbed(&self, causes: &[Cause]) -> Output {
        self.runs
            .iter()
            .zip(&self.disturbances)
            .map(|(run, disturbance)| self.sensed(&self.motion(run, causes, Some(disturbance)), causes))
            .collect()
    }

    /// Keeps the first cut only and makes it so deep that it chatters; `None` if no tried depth does.
    ///
    /// In chatter most of the motion differs from revolution to revolution. Its amplitude is bounded by `MOST_FEEDS`.
    pub(crate) fn chattering(mut self) -> Option<Self> {
        self.runs.truncate(1);
        self.runs[0].jumped = MOST_MISSED;
        for _ in 0..16 {
            self.runs[0].depth_mm *= 1.3;
            let motion = self.motion(&self.runs[0], &[], None);
            if motion.largest_m() > MOST_FEEDS * 1e-3 * self.runs[0].feed_mm {
                return None;
            }
            if motion.share_new_each_turn() > 0.7 {
                self.scale.cut = Some(CutScale {
                    job: self.job.clone(),
                    depth_mm: self.runs[0].depth_mm,
                    rpm: self.runs[0].rpm,
                });
                return Some(self);
            }
        }
        None
    }

    /// Keeps the first cut only, recorded from the instant at which the tool, at rest, begins with full engagement.
    pub(crate) fn starting_at_rest(mut self) -> Self {
        self.runs.truncate(1);
        self.runs[0].angle = 0.0;
        self.before = 0;
        self
    }

    /// Speed, rev/min, and axial depth, mm, of the first cut.
    pub(crate) fn working_point(&self) -> [f64; 2] {
        [self.runs[0].rpm, self.runs[0].depth_mm]
    }

    /// Names of the channels of an output: forces, then motion.
    pub(crate) fn channel_names(&self) -> Vec<String> {
        self.sensors().iter().map(|sensor| sensor.name()).collect()
    }

    /// Names of the channels of force.
    pub(crate) fn force_names(&self) -> Vec<String> {
        let forces = self.sensors().len() - self.motion.len();
        self.channel_names()[..forces].to_vec()
    }

    /// Names of the channels that an error of a sensor concerns.
    pub(crate) fn channels_of(&self, sensor: usize) -> Vec<String> {
        match sensor {
            EVERY_FORCE => self.force_names(),
            EVERY_SENSOR => self.motion_names(),
            sensor => self.channel_names().get(sensor).cloned().into_iter().collect(),
        }
    }

    /// True if the motion grows over a record: the last third of it is twice as large as the first.
    pub(crate) fn grows(&self, output: &Output) -> bool {
        output.iter().any(|sensed| {
            let motion = &sensed[sensed.len() - 2];
            let third = motion.len() / 3;
            let size = |part: &[f64]| {
                let mean = part.iter().sum::<f64>() / part.len() as f64;
                part.iter().map(|value| (value - mean).powi(2)).sum::<f64>()
            };
            size(&motion[2 * third..]) > 4.0 * size(&motion[..third])
        })
    }

    /// Names of the channels of motion.
    pub(crate) fn motion_names(&self) -> Vec<String> {
        let forces = self.sensors().len() - self.motion.len();
        self.channel_names()[forces..].to_vec()
    }

    /// Text of the case file: the baseline.
    pub(crate) fn case_text(&self) -> String {
        let (machine, job) = self
            .stated
            .as_ref()
            .map_or((&self.machine, &self.job), |(machine, job)| (machine, job));
        let Job {
            teeth,
            edge_angle_deg,
            diameter_mm,
            cutting_mpa,
            edge_n_per_mm,
            start_deg,
            exit_deg,
            feed_mm,
            ..
        } = job;
        let mut text = machine.case_text();
        writeln!(
            text,
            "[tool]\nteeth = {teeth}\nedge_angle_deg = {edge_angle_deg:?}\ndiameter_mm = {diameter_mm:e}"
        )
        .unwrap();
        if self.stated.is_some() {
            text += &uncertainty::keys_of_runout(job);
        }
        writeln!(text, "[material]").unwrap();
        for (index, letter) in ['t', 'r', 'a'].iter().enumerate() {
            writeln!(
                text,
                "k{letter}c_mpa = {:e}\nk{letter}e_n_per_mm = {:e}",
                cutting_mpa[index], edge_n_per_mm[index]
            )
            .unwrap();
        }
        if self.stated.is_some() {
            text += &uncertainty::keys_of_material(job);
        }
        writeln!(
            text,
            "[cut]\nstart_deg = {start_deg:?}\nexit_deg = {exit_deg:?}\nfeed_per_tooth_mm = {feed_mm:e}"
        )
        .unwrap();
        if self.stated.is_some() {
            text += &uncertainty::section(machine);
        }
        text
    }

    /// Forces, motion and spindle angle of one cut at the samples of its record.
    fn motion(&self, run: &Run, causes: &[Cause], disturbance: Option<&Disturbance>) -> Motion {
        let step_s = 1.0 / (self.rate_hz * self.steps as f64);
        let mut changed = self.machine.clone();
        causes
            .iter()
            .for_each(|cause| cause.change(&mut changed, &self.scale));
        let mut system = System::new(
            &changed.mass,
            &changed.damping,
            &changed.stiffness,
            &changed.tip,
            step_s,
        );
        causes
            .iter()
            .for_each(|cause| cause.add(&self.machine, &self.scale, &mut system));
        let system = system.beginning_at(self.before as f64 / self.rate_hz);
        let chips = Chips {
            job: &self.job,
            run,
            process: Process::under(causes, &self.job, &self.machine, &self.scale),
            before_s: self.before as f64 / self.rate_hz,
            step_s,
            furthest_m: Cell::new(0.0),
            disturbance,
        };
        let count = (self.before + self.samples) * self.steps;
        let mut found = Motion::default();
        let (mut y, mut u) = (system.pulled([0.0; 3]), Vec::with_capacity(count));
        let mut branches = system.branches(0.0, &mut y, &|_, _, _| [0.0; 3]);
        for k in 0..count {
            let (t, to) = (k as f64 * step_s, (k + 1) as f64 * step_s);
            if k >= self.before * self.steps && k.is_multiple_of(self.steps) {
                let x = system.displacement(&y);
                let cutting = chips.cutting(t, x, chips.engaged(t + 1e-6 * step_s), &u);
                let force = |t: f64, x: [f64; 3], v: [f64; 3]| chips.force(t, x, v, cutting, &u);
                let mut path = Path::default();
                system.note(t, &y, &branches, &force, &mut path);
                found.force.push(chips.force(t, x, path.v[0], cutting, &u));
                found.u.push(x);
                found.a.push(path.a[0]);
                found.angle.push(chips.angle(t));
            }
            let x = system.displacement(&y);
            let away = x.iter().fold(0.0, |sum, x| sum + x * x).sqrt();
            chips.furthest_m.set(chips.furthest_m.get().max(away));
            u.push(x);
            let mut from = t;
            for switch in chips.switches(t, to) {
                chips.advance(&system, [from, switch], &mut y, &mut branches, &u);
                from = switch;
                let x = system.displacement(&y);
                let [before, after] = [-1e-6, 1e-6].map(|beside| {
                    let cutting = chips.cutting(switch, x, chips.engaged(switch + beside * step_s), &u);
                    let force = |t: f64, x: [f64; 3], v: [f64; 3]| chips.force(t, x, v, cutting, &u);
                    let mut path = Path::default();
                    system.note(switch, &y, &branches, &force, &mut path);
                    path.a[0]
                });
                let jump = std::array::from_fn(|axis| after[axis] - before[axis]);
                found
                    .jumps
                    .push((switch - self.before as f64 / self.rate_hz, jump));
            }
            chips.advance(&system, [from, to], &mut y, &mut branches, &u);
        }
        found
    }

    /// Readings of all sensors in a motion, and after them the spindle angle, which stands for the tachometer.
    fn sensed(&self, motion: &Motion, causes: &[Cause]) -> Vec<Vec<f64>> {
        let mut channels: Vec<Vec<f64>> = self
            .sensors()
            .iter()
            .enumerate()
            .map(|(index, sensed)| match sensed {
                Sensed::Force(axis) => {
                    let gain: f64 = causes
                        .iter()
                        .filter(|cause| cause.sensor == index || cause.sensor == EVERY_FORCE)
                        .filter(|cause| cause.kind == EffectKind::SensorGain)
                        .map(|cause| cause.values(&self.machine, &self.scale)[0].1)
                        .product();
                    motion.force.iter().map(|force| gain * force[*axis]).collect()
                }
                Sensed::Motion(sensor) => {
                    let about = |cause: &&Cause| cause.sensor == index || cause.sensor == EVERY_SENSOR;
                    let mut causes: Vec<&Cause> = causes
                        .iter()
                        .filter(|cause| cause.kind.of_sensor())
                        .filter(about)
                        .collect();
                    let late = |cause: &&Cause| cause.kind == EffectKind::SensorDelay && sensor.acceleration;
                    let series = match causes.iter().position(late) {
                        Some(place) => {
                            let delay_s = causes.remove(place).values(&self.machine, &self.scale)[0].1;
                            &motion.late(delay_s, self.rate_hz)
                        }
                        None if sensor.acceleration => &motion.a,
                        None => &motion.u,
                    };
                    read_by(
                        &self.machine,
                        &self.scale,
                        *sensor,
                        &causes,
                        series,
                        1,
                        self.samples,
                    )
                }
            })
            .collect();
        channels.push(motion.angle.clone());
        channels
    }

    /// The sensors of a cut: forces if they are measured, then motion.
    fn sensors(&self) -> Vec<Sensed> {
        let forces = self
            .machine
            .axes
            .iter()
            .filter(|_| self.forces)
            .map(|&axis| Sensed::Force(axis));
        forces
            .chain(self.motion.iter().map(|sensor| Sensed::Motion(*sensor)))
            .collect()
    }

    /// The working point in the sidecar of a recording.
    fn said_of(&self, run: &Run) -> RecordedCut {
        serde_json::from_value(serde_json::json!({
            "spindle_rpm": run.rpm,
            "axial_depth_mm": run.depth_mm,
            "start_deg": self.job.start_deg,
            "exit_deg": self.job.exit_deg,
            "feed_per_tooth_mm": run.feed_mm,
            "teeth": self.job.teeth,
        }))
        .unwrap()
    }

    /// Recordings of an output, with white noise of the standard deviations `sigma` by sensor.
    pub(crate) fn recordings(
        &self,
        output: &Output,
        sigma: &[f64],
        random: &mut ChaCha8Rng,
        name: &str,
    ) -> Vec<Recording> {
        let sensors = self.sensors();
        self.runs
            .iter()
            .zip(output)
            .enumerate()
            .map(|(number, (run, sensed))| {
                let mut channels: Vec<Channel> = sensors
                    .iter()
                    .zip(sensed)
                    .zip(sigma)
                    .map(|((sensor, samples), sigma)| Channel {
                        name: sensor.name(),
                        quantity: sensor.quantity(),
                        samples: match self.disturbances.get(number) {
                            None => noisy(samples, *sigma, random),
                            Some(disturbance) => {
                                disturbance.recorded(samples, *sigma, self.rate_hz, random.random())
                            }
                        },
                    })
                    .collect();
                channels.push(Channel {
                    name: "tacho".into(),
                    quantity: Quantity::Level,
                    samples: level(&self.jittered(number, &sensed[sensors.len()], random)),
                });
                let mut sidecar = Sidecar {
                    kind: Some(TestKind::Cutting),
                    cut: Some(self.said_of(run)),
                    ..Sidecar::default()
                };
                let tacho = RecordedChannel {
                    pulses_per_rev: Some(1),
                    ..RecordedChannel::default()
                };
                sidecar.channels.insert("tacho".into(), tacho);
                Recording {
                    path: format!("{name}-{number}.csv").into(),
                    sample_rate_hz: self.rate_hz,
                    start_s: 0.0,
                    since_s: 0.0,
                    channels,
                    sidecar,
                }
            })
            .collect()
    }

    /// Spindle angles with the jitter of the tachometer of a cut: one error for each pulse.
    fn jittered(&self, number: usize, angle: &[f64], random: &mut ChaCha8Rng) -> Vec<f64> {
        let Some(disturbance) = self.disturbances.get(number) else {
            return angle.to_vec();
        };
        let per_sample = (angle[angle.len() - 1] - angle[0]) / (angle.len() - 1) as f64;
        let count = (angle[angle.len() - 1] / TAU) as usize + 2;
        let errors: Vec<f64> = (0..count)
            .map(|_| {
                let deviate: f64 = StandardNormal.sample(random);
                disturbance.jitter() * per_sample * deviate
            })
            .collect();
        angle
            .iter()
            .map(|angle| angle + errors[((angle / TAU).round().max(0.0) as usize).min(count - 1)])
            .collect()
    }

    /// Standard deviation of the spindle angle from the tachometer, rad: a fiftieth of a sample.
    pub(crate) fn angle_sigma(&self) -> f64 {
        0.02 * TAU * self.runs[0].rpm / 60.0 / self.rate_hz
    }
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Sensed {
    Force(usize),
    Motion(Sensor),
}

impl Sensed {
    fn name(self) -> String {
        match self {
            Self::Force(axis) => format!("f{}", letter(axis)),
            Self::Motion(sensor) => sensor.name(),
        }
    }

    fn quantity(self) -> Quantity {
        match self {
            Self::Force(_) => Quantity::Force,
            Self::Motion(sensor) if sensor.acceleration => Quantity::Acceleration,
            Self::Motion(_) => Quantity::Displacement,
        }
    }
}

#[derive(Default)]
struct Motion {
    force: Vec<[f64; 3]>,
    u: Vec<[f64; 3]>,
    a: Vec<[f64; 3]>,
    /// Jumps of the acceleration: time from the start of the record, s, and height along x, y, z.
    jumps: Vec<(f64, [f64; 3])>,
    angle: Vec<f64>,
}

impl Motion {
    /// Half the range of the displacement along the axis that moves most, m.
    fn half_range_m(&self) -> f64 {
        (0..3)
            .map(|axis| {
                let of = |start: f64, choose: fn(f64, f64) -> f64| {
                    self.u.iter().fold(start, |found, u| choose(found, u[axis]))
                };
                0.5 * (of(f64::NEG_INFINITY, f64::max) - of(f64::INFINITY, f64::min))
            })
            .fold(0.0, f64::max)
    }

    fn largest_m(&self) -> f64 {
        self.u.iter().flatten().fold(0.0, |most, u| most.max(u.abs()))
    }

    /// Share of the motion that differs between revolutions: variance about the mean at equal spindle angles over the whole variance, the
    /// smallest of the axes that move.
    fn share_new_each_turn(&self) -> f64 {
        const PARTS: usize = 48;
        let share = |axis: usize| {
            let mut parts = vec![Vec::new(); PARTS];
            for (u, angle) in self.u.iter().zip(&self.angle) {
                let part = angle.rem_euclid(TAU) / TAU * PARTS as f64;
                parts[(part as usize).min(PARTS - 1)].push(u[axis]);
            }
            let scatter = |values: &[f64]| {
                let mean = values.iter().sum::<f64>() / values.len().max(1) as f64;
                values.iter().map(|value| (value - mean).powi(2)).sum::<f64>()
            };
            let all: Vec<f64> = self.u.iter().map(|u| u[axis]).collect();
            let whole = scatter(&all);
            (whole > 0.0).then(|| parts.iter().map(|part| scatter(part)).sum::<f64>() / whole)
        };
        (0..3).filter_map(share).fold(1.0, f64::min)
    }

    /// The acceleration `delay_s` before each sample. Steps stay steps; between them it is interpolated.
    fn late(&self, delay_s: f64, rate_hz: f64) -> Vec<[f64; 3]> {
        let jumped = |t: f64| {
            let before = self.jumps.iter().take_while(|(at, _)| *at <= t);
            before.fold([0.0; 3], |sum, (_, jump)| {
                std::array::from_fn(|axis| sum[axis] + jump[axis])
            })
        };
        let smooth: Vec<[f64; 3]> = self
            .a
            .iter()
            .enumerate()
            .map(|(k, a)| {
                let jumped = jumped(k as f64 / rate_hz);
                std::array::from_fn(|axis| a[axis] - jumped[axis])
            })
            .collect();
        (0..self.a.len())
            .map(|k| {
                let t = (k as f64 / rate_hz - delay_s).max(0.0);
                let (smooth, jumped) = (interpolated(&smooth, t * rate_hz), jumped(t));
                std::array::from_fn(|axis| smooth[axis] + jumped[axis])
            })
            .collect()
    }
}

impl Lab for CutBench {
    fn output(&self, causes: &[Cause]) -> Output {
        let moved = |causes: &[Cause]| -> Vec<Motion> {
            self.runs
                .iter()
                .map(|run| self.motion(run, causes, None))
                .collect()
        };
        if causes.iter().all(|cause| cause.kind.of_sensor()) {
            self.plain
                .get_or_init(|| moved(&[]))
                .iter()
                .map(|motion| self.sensed(motion, causes))
                .collect()
        } else {
            moved(causes)
                .iter()
                .map(|motion| self.sensed(motion, causes))
                .collect()
        }
    }

    fn places(&self, kind: EffectKind) -> Vec<(usize, usize)> {
        let first = self.sensors().len() - self.motion.len();
        let last = first + self.motion.len();
        match kind {
            EffectKind::SensorGain => (first..last)
                .map(|sensor| (self.motion[sensor - first].axis, sensor))
                .chain([(0, EVERY_SENSOR)])
                .chain((0..first).map(|force| (self.machine.axes[force], force)))
                .chain((first > 1).then_some((0, EVERY_FORCE)))
                .collect(),
            EffectKind::SensorOffset => Vec::new(),
            kind if kind.of_sensor() => (first..last)
                .map(|sensor| (self.motion[sensor - first].axis, sensor))
                .collect(),
            EffectKind::AxialDepthModulation if self.machine.axes.len() < 3 => Vec::new(),
            EffectKind::Mass | EffectKind::Stiffness | EffectKind::Damping | EffectKind::CommonFactor => {
                self.machine.axes.iter().map(|axis| (*axis, 0)).collect()
            }
            kind if RESTORING.contains(&kind) && kind.has_direction() => {
                self.machine.axes.iter().map(|axis| (*axis, 0)).collect()
            }
            _ => vec![(0, 0)],
        }
    }

    fn kinds(&self) -> Vec<EffectKind> {
        let mut kinds = PROCESS.to_vec();
        if self.stated.is_some() {
            kinds.extend(RESTORING);
        }
        kinds.extend([
            EffectKind::SensorGain,
            EffectKind::SensorDelay,
            EffectKind::CrossAxis,
            EffectKind::Mass,
            EffectKind::Stiffness,
            EffectKind::Damping,
        ]);
        kinds
    }

    fn names(&self, kind: EffectKind) -> &'static [&'static str] {
        // A factor does not change edge coefficients that are zero.
        let edgeless = kind == EffectKind::CommonForce && self.job.edge_n_per_mm == [0.0; 3];
        if edgeless {
            &kind.names()[..1]
        } else {
            kind.names()
        }
    }

    /// Offset of each sensor in each cut. The spindle angle has none.
    fn nuisance(&self, sigma: &[f64]) -> DMatrix<f64> {
        let (runs, channels, samples) = (self.runs.len(), sigma.len(), self.samples);
        let sensors = channels - 1;
        let mut columns = DMatrix::zeros(runs * channels * samples, runs * sensors);
        for run in 0..runs {
            for sensor in 0..sensors {
                let first = (run * channels + sensor) * samples;
                let column = run * sensors + sensor;
                columns.view_mut((first, column), (samples, 1)).fill(1.0);
            }
        }
        columns
    }
}

/// Largest number of passes that a tooth in chatter may miss.
const MOST_MISSED: usize = 64;

/// Largest displacement of the tool in chatter, in feeds per tooth.
const MOST_FEEDS: f64 = 20.0;

/// Sensor index of an error that all channels of motion have.
pub(crate) const EVERY_SENSOR: usize = usize::MAX;

/// Sensor index of a gain that all channels of force have, as that of a dynamometer.
pub(crate) const EVERY_FORCE: usize = usize::MAX - 1;

/// Level of a tachometer with one pulse per revolution. It rises within two samples when the angle passes a multiple of 2π, and falls half
/// a revolution later.
fn level(angle: &[f64]) -> Vec<f64> {
    (0..angle.len())
        .map(|k| {
            let per_sample = if k + 1 < angle.len() {
                angle[k + 1] - angle[k]
            } else {
                angle[k] - angle[k - 1]
            };
            let turn = angle[k].rem_euclid(TAU);
            // Samples since the last rise, and since the last fall.
            let since_rise = if turn > 0.75 * TAU { turn - TAU } else { turn } / per_sample;
            let since_fall = (turn - 0.5 * TAU) / per_sample;
            (0.5 + 0.5 * since_rise).clamp(0.0, 1.0).min(
                (0.5 - 0.5 * since_fall)
                    .clamp(0.0, 1.0)
                    .max(f64::from(u8::from(turn > 0.75 * TAU))),
            )
        })
        .collect()
}
