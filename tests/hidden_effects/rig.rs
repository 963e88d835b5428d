//! Virtual tests of a machine's structure, and their recordings.

use std::f64::consts::TAU;
use std::sync::OnceLock;

use nalgebra::{Complex, DMatrix};
use quietcut::recording::{Channel, Quantity, RecordedChannel, Recording, Sidecar, TestKind};
use rand::RngExt;
use rand_chacha::ChaCha8Rng;

use super::cause::{Cause, EffectKind, OF_OWN_FAMILY, STRUCTURAL, Scale};
use super::machine::{Machine, between};
use super::motion::{Path, System, first_order};
use super::noise::Whitening;
use super::oracle::{Lab, Output};
use super::sensor::{Sensor, letter, noisy, read_by, sensors};
use super::signal::{interpolated, signal};

/// EffectKind of a test of the structure.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Test {
    /// A shaker with many tones, or a hammer.
    Shaker,
    /// A sine sweep, or a step sine.
    Sweep,
    /// Free decay from static deflection.
    FreeDecay,
}

/// One run of a test.
#[derive(Clone, Debug)]
pub(crate) struct Run {
    /// Force along x, y, z at every half integration step, N; empty without force.
    force_n: Vec<[f64; 3]>,
    /// Directions in which a force acts.
    driven: Vec<usize>,
    /// Static force before a free decay, N.
    pull_n: [f64; 3],
}

/// A test: its runs and its sensors.
#[derive(Debug)]
pub(crate) struct Rig {
    pub(crate) kind: TestKind,
    pub(crate) runs: Vec<Run>,
    pub(crate) sensors: Vec<Sensor>,
    pub(crate) rate_hz: f64,
    /// Number of samples of a run.
    pub(crate) samples: usize,
    /// Number of integration steps per sample.
    steps: usize,
    pub(crate) scale: Scale,
    /// Standard deviation of each force sensor's noise, N.
    force_noise_n: f64,
    /// Motions of the baseline machine. Sensor errors need no others.
    plain: OnceLock<Vec<Path>>,
}

/// Range of the standard deviation of a force sensor's noise, as a share of the largest root mean square of the force: from good load cells
/// to bad ones.
const FORCE_NOISE: [f64; 2] = [1e-4, 5e-3];

impl Run {
    /// Root mean square of the force along its largest direction, N.
    fn force_rms_n(&self) -> f64 {
        let along = |axis: usize| self.force_n.iter().map(|force| force[axis].powi(2)).sum::<f64>();
        let most = (0..3).map(along).fold(0.0, f64::max);
        (most / self.force_n.len().max(1) as f64).sqrt()
    }
}

impl Rig {
    /// Draws a test of `machine`, with directions driven one by one and together, at two or three levels.
    pub(crate) fn draw(random: &mut ChaCha8Rng, test: Test, machine: &Machine) -> Self {
        let highest = machine.omega[1] / TAU;
        let rate_hz = highest * random.random_range(18.0..26.0);
        let cycles = random.random_range(60.0..110.0);
        let samples = (cycles / (machine.omega[0] / TAU) * rate_hz) as usize;
        let steps = (machine.omega[1] / (0.12 * rate_hz)).ceil() as usize;
        let mut rig = Self {
            kind: TestKind::Shaker,
            runs: Vec::new(),
            sensors: sensors(random, machine),
            rate_hz,
            samples,
            steps,
            scale: Scale {
                peak_m: 2.0 * machine.amplitude_m,
                seconds: samples as f64 / rate_hz,
                sample_s: 1.0 / rate_hz,
                cut: None,
            },
            force_noise_n: 0.0,
            plain: OnceLock::new(),
        };
        let variant = random.random::<f64>();
        rig.kind = match test {
            Test::Shaker if variant < 0.25 => TestKind::Hammer,
            Test::Shaker => TestKind::Shaker,
            Test::Sweep if variant < 0.3 => TestKind::StepSine,
            Test::Sweep => TestKind::Sweep,
            Test::FreeDecay => TestKind::FreeDecay,
        };
        let levels: &[f64] = if random.random::<bool>() {
            &[1.0, 0.3]
        } else {
            &[0.25, 1.0, 0.6]
        };
        let mut shapes: Vec<Vec<usize>> = machine.axes.iter().map(|axis| vec![*axis]).collect();
        if machine.axes.len() > 1 {
            shapes.push(machine.axes.clone());
        }
        for (index, shape) in shapes.iter().enumerate() {
            // The first direction is driven at all levels, any other only at the first level.
            let levels = if index == 0 { levels } else { &levels[..1] };
            for level in levels {
                let run = rig.run(random, machine, shape);
                rig.runs.push(rig.scaled(run, machine, *level));
            }
        }
        let largest = rig.runs.iter().map(Run::force_rms_n).fold(0.0, f64::max);
        rig.force_noise_n = largest * between(random, FORCE_NOISE[0], FORCE_NOISE[1]);
        rig
    }

    /// One sweep along `axis` with the force amplitude `amplitude_n`.
    pub(crate) fn sweep(
        machine: &Machine,
        axis: usize,
        sensors: Vec<Sensor>,
        amplitude_n: f64,
        [first_hz, last_hz]: [f64; 2],
    ) -> Self {
        let rate_hz = 20.0 * machine.omega[1] / TAU;
        let (samples, steps) = (2000, 8);
        let seconds = samples as f64 / rate_hz;
        let half_s = 0.5 / (rate_hz * steps as f64);
        let force_n = (0..2 * samples * steps + 8)
            .map(|k| {
                let t = k as f64 * half_s;
                let mut force = [0.0; 3];
                force[axis] =
                    amplitude_n * (TAU * (first_hz * t + 0.5 * (last_hz - first_hz) / seconds * t * t)).sin();
                force
            })
            .collect();
        Self {
            kind: TestKind::Sweep,
            runs: vec![Run {
                force_n,
                driven: vec![axis],
                pull_n: [0.0; 3],
            }],
            sensors,
            rate_hz,
            samples,
            steps,
            scale: Scale {
                peak_m: 2.0 * machine.amplitude_m,
                seconds,
                sample_s: 1.0 / rate_hz,
                cut: None,
            },
            force_noise_n: 0.0,
            plain: OnceLock::new(),
        }
    }

    fn run(&self, random: &mut ChaCha8Rng, machine: &Machine, driven: &[usize]) -> Run {
        let points = 2 * self.samples * self.steps + 8;
        let half_s = 0.5 / (self.rate_hz * self.steps as f64);
        let mut run = Run {
            force_n: Vec::new(),
            driven: driven.to_vec(),
            pull_n: [0.0; 3],
        };
        if self.kind == TestKind::FreeDecay {
            for &axis in driven {
                run.pull_n[axis] = 1.0;
            }
            return run;
        }
        run.force_n = vec![[0.0; 3]; points];
        for &axis in driven {
            let signal = signal(self.kind, self.scale.seconds, random, machine);
            for (k, force) in run.force_n.iter_mut().enumerate() {
                force[axis] = signal(k as f64 * half_s);
            }
        }
        run
    }

    /// Scales the force of a run so that the baseline machine moves by `level` times its typical amplitude.
    fn scaled(&self, mut run: Run, machine: &Machine, level: f64) -> Run {
        let path = self.path(&run, &self.system_of(machine, &[]));
        let mut factor = f64::INFINITY;
        for &axis in &run.driven {
            let rms = (path.u.iter().map(|u| u[axis].powi(2)).sum::<f64>() / path.u.len() as f64).sqrt();
            let peak = path.u.iter().fold(0.0_f64, |a, u| a.max(u[axis].abs()));
            factor = factor.min(level * machine.amplitude_m / rms.max(0.4 * peak));
        }
        for force in &mut run.force_n {
            *force = force.map(|value| value * factor);
        }
        run.pull_n = run.pull_n.map(|value| value * factor);
        run
    }

    /// Equation of motion of a machine while `causes` act.
    fn system_of(&self, machine: &Machine, causes: &[Cause]) -> System {
        let mut changed = machine.clone();
        for cause in causes {
            cause.change(&mut changed, &self.scale);
        }
        let step_s = 1.0 / (self.rate_hz * self.steps as f64);
        let mut system = System::new(
            &changed.mass,
            &changed.damping,
            &changed.stiffness,
            &changed.tip,
            step_s,
        );
        for cause in causes {
            cause.add(machine, &self.scale, &mut system);
        }
        system
    }

    /// Motion of one run on the grid of the integration.
    fn path(&self, run: &Run, system: &System) -> Path {
        let step = 1.0 / (self.rate_hz * self.steps as f64);
        let half = 0.5 * step;
        let force = |t: f64, _: [f64; 3], _: [f64; 3]| {
            if run.force_n.is_empty() {
                return [0.0; 3];
            }
            interpolated(&run.force_n, t / half)
        };
        let count = self.samples * self.steps;
        let mut path = Path {
            u: Vec::with_capacity(count + 1),
            a: Vec::with_capacity(count + 1),
            ..Path::default()
        };
        let mut y = system.pulled(run.pull_n);
        let mut branches = system.branches(0.0, &mut y, &force);
        for k in 0..count {
            let t = k as f64 * step;
            system.note(t, &y, &branches, &force, &mut path);
            system.advance(t, step, &mut y, &mut branches, &force);
        }
        path
    }

    /// Readings of all sensors without noise while `causes` act.
    pub(crate) fn output(&self, machine: &Machine, causes: &[Cause]) -> Output {
        let moved = |causes: &[Cause]| -> Vec<Path> {
            let system = self.system_of(machine, causes);
            self.runs.iter().map(|run| self.path(run, &system)).collect()
        };
        let of_paths = |paths: &[Path]| {
            let of = |path| {
                (0..self.sensors.len())
                    .map(|index| self.read(index, machine, causes, path))
                    .collect()
            };
            paths.iter().map(of).collect()
        };
        if causes.iter().all(|cause| cause.kind.of_sensor()) {
            of_paths(self.plain.get_or_init(|| moved(&[])))
        } else {
            of_paths(&moved(causes))
        }
    }

    /// Readings of one sensor in a motion while `causes` act.
    fn read(&self, index: usize, machine: &Machine, causes: &[Cause], path: &Path) -> Vec<f64> {
        let sensor = self.sensors[index];
        let tip = if sensor.acceleration { &path.a } else { &path.u };
        let about: Vec<&Cause> = causes
            .iter()
            .filter(|cause| cause.kind.of_sensor() && cause.sensor == index)
            .collect();
        let by_mode = about
            .iter()
            .find(|cause| cause.kind == EffectKind::SensorOffsetByMode);
        let elsewhere = by_mode.map(|cause| {
            let [first, second] = [0, 1].map(|mode| cause.values(machine, &self.scale)[mode].1 - 1.0);
            let moved = |(tip, freedoms): (&[f64; 3], &[[f64; 2]; 2])| {
                let [q1, q2] = freedoms[usize::from(sensor.acceleration)];
                let mut moved = *tip;
                moved[sensor.axis] += first * q1 + second * q2;
                moved
            };
            tip.iter().zip(&path.freedoms).map(moved).collect::<Vec<_>>()
        });
        read_by(
            machine,
            &self.scale,
            sensor,
            &about,
            elsewhere.as_ref().unwrap_or(tip),
            self.steps,
            self.samples,
        )
    }

    /// Force of a run along an axis at the samples of its record, N.
    fn force_of(&self, run: &Run, axis: usize) -> Vec<f64> {
        (0..self.samples)
            .map(|k| run.force_n[2 * k * self.steps][axis])
            .collect()
    }

    /// Recordings of an output, with white noise of the standard deviations `sigma` by sensor and with noise on the forces.
    pub(crate) fn recordings(
        &self,
        output: &Output,
        sigma: &[f64],
        random: &mut ChaCha8Rng,
        name: &str,
    ) -> Vec<Recording> {
        self.runs
            .iter()
            .zip(output)
            .enumerate()
            .map(|(number, (run, sensed))| {
                let mut channels = Vec::new();
                if self.kind != TestKind::FreeDecay {
                    for &axis in &run.driven {
                        channels.push(Channel {
                            name: format!("f{}", letter(axis)),
                            quantity: Quantity::Force,
                            samples: noisy(&self.force_of(run, axis), self.force_noise_n, random),
                        });
                    }
                }
                let mut sidecar = Sidecar {
                    kind: Some(self.kind),
                    ..Sidecar::default()
                };
                for ((sensor, samples), sigma) in self.sensors.iter().zip(sensed).zip(sigma) {
                    let name = sensor.name();
                    if sensor.at_housing {
                        let at = RecordedChannel {
                            at: Some("spindle-housing".into()),
                            ..RecordedChannel::default()
                        };
                        sidecar.channels.insert(name.clone(), at);
                    }
                    channels.push(Channel {
                        name,
                        quantity: if sensor.acceleration {
                            Quantity::Acceleration
                        } else {
                            Quantity::Displacement
                        },
                        samples: noisy(samples, *sigma, random),
                    });
                }
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
}

/// A machine with the test that is made on it.
pub(crate) struct Bench {
    pub(crate) machine: Machine,
    pub(crate) rig: Rig,
}

impl Lab for Bench {
    fn output(&self, causes: &[Cause]) -> Output {
        self.rig.output(&self.machine, causes)
    }

    fn places(&self, kind: EffectKind) -> Vec<(usize, usize)> {
        let sensors = &self.rig.sensors;
        // In free decays the delay of the only sensor is equivalent to an earlier start of the record.
        let only_late =
            kind == EffectKind::SensorDelay && self.rig.kind == TestKind::FreeDecay && sensors.len() == 1;
        if kind == EffectKind::CommonForce || only_late || !Cause::possible(kind, &self.machine) {
            Vec::new()
        } else if kind.of_sensor() {
            (0..sensors.len())
                .filter(|sensor| {
                    let of_place = matches!(kind, EffectKind::SensorOffset | EffectKind::SensorOffsetByMode);
                    !of_place || sensors[*sensor].at_housing
                })
                .map(|sensor| (sensors[sensor].axis, sensor))
                .collect()
        } else if matches!(kind, EffectKind::ModeCoupling | EffectKind::Drift) {
            vec![(0, 0)]
        } else {
            self.machine.axes.iter().map(|axis| (*axis, 0)).collect()
        }
    }

    fn kinds(&self) -> Vec<EffectKind> {
        let of_machine = |kind| match kind {
            EffectKind::SensorOffset if self.machine.modal => EffectKind::SensorOffsetByMode,
            kind => kind,
        };
        let structural = STRUCTURAL.into_iter().map(of_machine);
        structural.chain(OF_OWN_FAMILY).collect()
    }

    fn is_free_decay(&self) -> bool {
        self.rig.kind == TestKind::FreeDecay
    }

    /// Free decays of the baseline machine, separate for each run.
    fn nuisance(&self, sigma: &[f64]) -> DMatrix<f64> {
        let Machine {
            mass,
            damping,
            stiffness,
            tip,
            ..
        } = &self.machine;
        let freedoms = mass.nrows();
        let inverse = mass.clone().try_inverse().unwrap();
        let n = 2 * freedoms;
        let a = first_order(&inverse, damping, stiffness);
        let one = (&a / self.rig.rate_hz).exp();
        let (sensors, samples, runs) = (&self.rig.sensors, self.rig.samples, self.rig.runs.len());
        let length = sensors.len() * samples;
        let mut columns = DMatrix::zeros(length * runs, n * runs);
        let mut power = DMatrix::identity(n, n);
        for k in 0..samples {
            let rates = &a * &power;
            for (s, sensor) in sensors.iter().enumerate() {
                for state in 0..n {
                    let seen = |i: usize| {
                        if sensor.acceleration {
                            rates[(freedoms + i, state)]
                        } else {
                            power[(i, state)]
                        }
                    };
                    let value: f64 = (0..freedoms).map(|i| tip[i][sensor.axis] * seen(i)).sum();
                    for run in 0..runs {
                        columns[(run * length + s * samples + k, run * n + state)] = value / sigma[s];
                    }
                }
            }
            power = &one * power;
        }
        columns
    }

    /// Noise of the force sensors, filtered by the receptances of the baseline machine.
    fn whitening(&self, sigma: &[f64]) -> Option<Whitening> {
        let rig = &self.rig;
        if rig.force_noise_n == 0.0 {
            return None;
        }
        let seen = |run: usize, bin: usize| {
            let omega = TAU * bin as f64 * rig.rate_hz / rig.samples as f64;
            let receptance = self.machine.receptance(omega);
            let driven = &rig.runs[run].driven;
            DMatrix::from_fn(rig.sensors.len(), driven.len(), |s, force| {
                let sensor = rig.sensors[s];
                let rate = if sensor.acceleration { -omega * omega } else { 1.0 };
                receptance[(sensor.axis, driven[force])] * Complex::from(rate * rig.force_noise_n / sigma[s])
            })
        };
        Some(Whitening::new(
            rig.runs.len(),
            rig.sensors.len(),
            rig.samples,
            seen,
        ))
    }
}
