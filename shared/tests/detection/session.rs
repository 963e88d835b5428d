//! A session: run-up from standstill, air, entry, stable cut, and then either growing chatter or disturbances of a stable cut; stop.

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::floquet::{Floquet, depth_of, multiplier};
use super::integrator::Integrator;
use super::machine::{Machine, log_uniform};

/// Part of a session.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Phase {
    Standstill,
    RunUp,
    Air,
    Entry,
    Stable,
    Disturbed,
    Growing,
    Stop,
}

impl Phase {
    pub const ALL: [Self; 8] = [
        Self::Standstill,
        Self::RunUp,
        Self::Air,
        Self::Entry,
        Self::Stable,
        Self::Disturbed,
        Self::Growing,
        Self::Stop,
    ];
}

/// Errors of the sensors and disturbances, drawn at random.
#[derive(Clone, Copy, Debug)]
pub struct Faults {
    /// Share of tachometer pulses that are missing, and of those that come twice.
    pub missed: f64,
    pub doubled: f64,
    pub jitter_s: f64,
    /// Hum: frequency in Hz and amplitude in m/s². The second is a harmonic of the spindle, in orders.
    pub hum: [(f64, f64); 2],
    /// Root mean square of coloured noise of the machine, m/s², and its corner, Hz.
    pub coloured: (f64, f64),
    /// Unbalance: acceleration at full speed, m/s².
    pub unbalance: f64,
}

/// What a session does, drawn from a seed.
#[derive(Clone, Debug)]
pub struct Session {
    pub seed: u64,
    pub machine: Machine,
    pub floquet: Option<Floquet>,
    pub stable_depth_m: f64,
    pub growing_depth_m: f64,
    /// Passings over which the depth changes at entry and at the begin of growth.
    pub entry_passings: f64,
    pub growth_passings: f64,
    pub run_up_s: f64,
    /// Time in which the spindle stops; 0: the tool leaves the material and turns on.
    pub stop_s: f64,
    /// Relative change of speed and of feed in the disturbed phase, and factor of the material in hard spots.
    pub overrides: [f64; 2],
    pub hard: f64,
    /// Ratio of the measured acceleration to that of the tool.
    pub transmission: f64,
    pub faults: Faults,
}

/// |μ| up to which a cut counts as stable, and the smallest that is scored as growing.
pub const STABLE: f64 = 0.95;
/// Machines that are drawn for one session at most.
const DRAWS: usize = 40;
/// Largest ratio of the depths of the growing and the stable cut: a larger step throws the tool out of the material at once.
const LARGEST_STEP: f64 = 2.5;
const GROWTH: [f64; 8] = [1.01, 1.02, 1.03, 1.05, 1.1, 1.25, 1.6, 3.0];

impl Session {
    /// Draws a session; `grows` asks for one whose last cut is unstable. `None` where none of some machines can be used.
    pub fn draw(seed: u64, grows: bool) -> Option<Self> {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        (0..DRAWS).find_map(|_| Self::draw_once(&mut random, seed, grows))
    }

    fn draw_once(random: &mut ChaCha8Rng, seed: u64, grows: bool) -> Option<Self> {
        let mut machine = Machine::draw(random);
        let stable_abs = random.random_range(if grows { 0.85 } else { 0.6 }..STABLE);
        if multiplier(&machine, 0.0).norm() > 0.98 * stable_abs {
            // A mode that rings longer than that is stable in air only.
            return None;
        }
        let stable_depth_m = depth_of(&machine, stable_abs)?;
        let wanted = GROWTH[random.random_range(0..GROWTH.len())];
        let mut growing_depth_m = stable_depth_m;
        let floquet = if grows {
            growing_depth_m = depth_of(&machine, wanted)?;
            if growing_depth_m > LARGEST_STEP * stable_depth_m {
                return None;
            }
            let floquet = Floquet::new(&machine, growing_depth_m);
            // Power iterations that have not converged have no single dominant multiplier.
            let again = multiplier(&machine, growing_depth_m);
            if (floquet.multiplier - again).norm() > 2e-3 * wanted
                || (again.norm() / wanted - 1.0).abs() > 0.2 * (wanted - 1.0)
                || again.re > 0.9 * again.norm()
            {
                return None;
            }
            Some(floquet)
        } else {
            None
        };
        let overrides = [random.random_range(0.8..1.2), random.random_range(0.8..1.2)];
        if !grows {
            let mut other = machine.clone();
            for part in [0.25, 0.5, 0.75, 1.0] {
                other.turns_per_second = machine.turns_per_second * (1.0 + part * (overrides[0] - 1.0));
                if multiplier(&other, stable_depth_m).norm() > STABLE {
                    return None;
                }
            }
        }
        let force = stable_depth_m * machine.coefficients[0] * machine.feed_per_tooth_m;
        let noise = log_uniform(random, 1e-3, 3e-2);
        machine.force_noise = noise * force / machine.modes[0].frequency_hz.sqrt();
        let forced = log_uniform(random, 1.0, 15.0);
        let transmission = forced / forced_level(&machine, stable_depth_m);
        let faults = Faults::draw(random, forced);
        Some(Self {
            seed,
            floquet,
            stable_depth_m,
            growing_depth_m,
            entry_passings: [0.0, 1.0, 8.0, 30.0, 100.0][random.random_range(0..5)],
            growth_passings: [0.0, 2.0, 10.0, 40.0][random.random_range(0..4)],
            run_up_s: random.random_range(0.4..1.2),
            stop_s: [0.0, 0.1, 0.4][random.random_range(0..3)],
            overrides,
            hard: random.random_range(1.1..1.5),
            transmission,
            faults,
            machine,
        })
    }

    /// Axial depth at a time since the begin of a phase.
    fn depth_m(&self, phase: Phase, since_s: f64) -> f64 {
        let passings = since_s / self.machine.tooth_period_s();
        let part = |over: f64| {
            if over > 0.0 {
                (passings / over).min(1.0)
            } else {
                1.0
            }
        };
        match phase {
            Phase::Standstill | Phase::RunUp | Phase::Air => 0.0,
            Phase::Entry => self.stable_depth_m * part(self.entry_passings),
            Phase::Stable => self.stable_depth_m,
            Phase::Disturbed => {
                // Hard spots of 6 tooth passings, ten times a second.
                let place = (since_s * 10.0).fract() / 10.0 / self.machine.tooth_period_s();
                // Harder material is a deeper cut; the speed override is over by then.
                let hard = if since_s > 1.4 && place < 6.0 {
                    self.hard
                } else {
                    1.0
                };
                self.stable_depth_m * hard.min(1.0 + 0.5 * (hard - 1.0))
            }
            Phase::Growing => {
                self.stable_depth_m
                    + (self.growing_depth_m - self.stable_depth_m) * part(self.growth_passings)
            }
            Phase::Stop => 0.0,
        }
    }

    /// Revolutions per second at a time since the begin of a phase.
    fn speed(&self, phase: Phase, since_s: f64) -> f64 {
        let full = self.machine.turns_per_second;
        match phase {
            Phase::Standstill => 0.0,
            Phase::RunUp => full * (since_s / self.run_up_s).min(1.0),
            Phase::Disturbed => {
                let away = self.overrides[0] - 1.0;
                let part = if since_s < 0.3 {
                    since_s / 0.3
                } else if since_s < 0.8 {
                    1.0
                } else {
                    ((1.1 - since_s) / 0.3).max(0.0)
                };
                full * (1.0 + part * away)
            }
            Phase::Stop if self.stop_s > 0.0 => full * (1.0 - since_s / self.stop_s).max(0.0),
            _ => full,
        }
    }

    fn seconds(&self, phase: Phase) -> f64 {
        let period = self.machine.tooth_period_s();
        match phase {
            Phase::Standstill => 0.15,
            Phase::RunUp => self.run_up_s,
            Phase::Air => 0.9,
            Phase::Entry => (self.entry_passings * period).max(0.3),
            Phase::Stable => 1.3,
            Phase::Disturbed => 2.2,
            Phase::Growing => 6.0,
            Phase::Stop => self.stop_s + 1.6,
        }
    }

    /// The phases of the session.
    pub fn phases(&self) -> Vec<Phase> {
        let last = if self.floquet.is_some() {
            Phase::Growing
        } else {
            Phase::Disturbed
        };
        [
            Phase::Standstill,
            Phase::RunUp,
            Phase::Air,
            Phase::Entry,
            Phase::Stable,
            last,
            Phase::Stop,
        ]
        .to_vec()
    }
}

impl Faults {
    fn draw(random: &mut ChaCha8Rng, forced: f64) -> Self {
        let share = |random: &mut ChaCha8Rng| log_uniform(random, 0.003, 0.1) * forced;
        let faulty = random.random_bool(0.3);
        let rate = |random: &mut ChaCha8Rng| {
            if faulty {
                random.random_range(0.0..0.01)
            } else {
                0.0
            }
        };
        Self {
            missed: rate(random),
            doubled: rate(random),
            jitter_s: log_uniform(random, 0.5e-6, 10e-6),
            hum: [
                (log_uniform(random, 20.0, 1500.0), share(random)),
                (f64::from(random.random_range(1..8)), share(random)),
            ],
            coloured: (share(random), log_uniform(random, 20.0, 2000.0)),
            unbalance: share(random),
        }
    }
}

/// Root mean square of the acceleration of the forced vibration at this depth, both axes, m/s².
fn forced_level(machine: &Machine, depth_m: f64) -> f64 {
    let mut integrator = Integrator::new(machine);
    let (passings, counted) = (120, machine.teeth.max(8));
    let (mut square, mut mean) = (0.0, [0.0; 2]);
    for passing in 0..passings {
        for _ in 0..integrator.steps() {
            let a = integrator.advance(machine.turns_per_second, depth_m);
            if passing + counted >= passings {
                square += a[0] * a[0] + a[1] * a[1];
                mean = [mean[0] + a[0], mean[1] + a[1]];
            }
        }
    }
    let count = (counted * integrator.steps()) as f64;
    (square / count - (mean[0] * mean[0] + mean[1] * mean[1]) / count / count).sqrt()
}

/// What the true motion is at one instant.
#[derive(Clone, Copy, Debug)]
pub struct Truth {
    pub phase: Phase,
    /// Level of the growing motion at the last tooth passing, m/s² at the sensor.
    pub level: f64,
}

/// Runs the motion of a session in steps of time.
pub struct Motion<'a> {
    session: &'a Session,
    integrator: Integrator,
    phases: Vec<Phase>,
    /// Index and begin of the present phase.
    phase: usize,
    began_s: f64,
    /// Angle in revolutions.
    pub angle: f64,
    newest: [[f64; 2]; 2],
    level: f64,
    random: ChaCha8Rng,
}

impl<'a> Motion<'a> {
    pub fn new(session: &'a Session) -> Self {
        Self {
            integrator: Integrator::new(&session.machine),
            phases: session.phases(),
            phase: 0,
            began_s: 0.0,
            angle: 0.0,
            newest: [[0.0; 2]; 2],
            level: 0.0,
            random: ChaCha8Rng::seed_from_u64(session.seed ^ 0x5eed),
            session,
        }
    }

    /// Ends the present phase.
    pub fn end_phase(&mut self, time_s: f64) {
        self.phase += 1;
        self.began_s = time_s;
        self.level = 0.0;
    }

    pub fn truth(&self) -> Option<Truth> {
        Some(Truth {
            phase: *self.phases.get(self.phase)?,
            level: self.level,
        })
    }

    /// Goes on to `time_s`, a time `step_s` after the last; the acceleration along x and y, m/s².
    pub fn advance(&mut self, time_s: f64, step_s: f64) -> Option<[f64; 2]> {
        if time_s - self.began_s > self.session.seconds(*self.phases.get(self.phase)?) {
            self.end_phase(time_s);
        }
        let phase = *self.phases.get(self.phase)?;
        let since_s = time_s - self.began_s;
        let session = self.session;
        let speed = session.speed(phase, since_s);
        self.angle += speed * step_s;
        let full = session.machine.turns_per_second;
        if speed < 0.02 * full {
            // At standstill the structure rests.
            return Some([0.0; 2]);
        }
        let per_turn = (self.integrator.steps() * session.machine.teeth) as f64;
        let depth_m = session.depth_m(phase, since_s);
        let step_seconds = 1.0 / (speed * per_turn);
        // Most of the force that excites the structure comes from the cut.
        let share = if depth_m > 0.0 { 1.0 } else { 0.1 };
        let deviation = share * session.machine.force_noise * (0.5 / step_seconds).sqrt();
        while (self.integrator.step as f64) < self.angle * per_turn {
            self.integrator.disturbance_n = [0; 2].map(|_| deviation * normal(&mut self.random));
            if self.integrator.step.is_multiple_of(self.integrator.steps())
                && let (Some(floquet), Phase::Growing) = (&session.floquet, phase)
            {
                self.level = session.transmission * floquet.level(&self.integrator);
            }
            let acceleration = self.integrator.advance(speed, depth_m);
            self.newest = [self.newest[1], acceleration];
        }
        // The newest point lies up to a step ahead of the angle.
        let ahead = (self.integrator.step as f64 - self.angle * per_turn).clamp(0.0, 1.0);
        Some([0, 1].map(|d| {
            let [before, after] = self.newest;
            session.transmission * (after[d] + ahead * (before[d] - after[d]))
        }))
    }
}

/// A standard normal variate (Box and Muller).
pub fn normal(random: &mut ChaCha8Rng) -> f64 {
    let u: f64 = 1.0 - random.random::<f64>();
    let v: f64 = random.random();
    (-2.0 * u.ln()).sqrt() * (std::f64::consts::TAU * v).cos()
}
