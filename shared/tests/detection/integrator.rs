//! An integrator of milling in steps of the spindle angle, independent of those of the host and of the signal chain.
//!
//! Mode r: m·(q̈ + 2ζω·q̇ + ω²·q) = e·F, displacement X = Σ e_r·q_r. Tooth at immersion φ reaches u = x·sin φ + y·cos φ + runout beyond the nominal
//! circle; the chip thickness is h = u − w + f·sin φ with the surface w that the preceding tooth left at this angle, and 0 out of contact. The
//! surface becomes max(u, w − f·sin φ). A step is the exact propagator of each mode under a constant force, with the mean of the forces at both
//! ends (Heun). Steps divide the tooth pitch, so that the surface lives on the points of the steps.

use super::machine::Machine;

/// State of motion and surface.
#[derive(Clone, Debug)]
pub struct Integrator {
    machine: Machine,
    /// q and q̇ of both modes.
    pub motion: [[f64; 2]; 2],
    /// Surface at each step of a revolution, m.
    pub surface: Vec<f64>,
    steps: usize,
    /// Steps since angle 0.
    pub step: usize,
    propagator: Option<Propagator>,
    /// Sine and cosine of the immersion at each point.
    directions: Vec<(f64, f64)>,
    engaged: Vec<bool>,
    /// False allows negative chips and leaves no memory of more than one tooth: the linear equations.
    pub loses_contact: bool,
    /// Force on each mode besides cutting, N.
    pub disturbance_n: [f64; 2],
}

/// q(h) and q̇(h) of each mode from q, q̇ and a constant force.
#[derive(Clone, Copy, Debug)]
struct Propagator {
    seconds: f64,
    matrices: [[[f64; 2]; 2]; 2],
    statics: [f64; 2],
}

impl Propagator {
    fn new(machine: &Machine, seconds: f64) -> Self {
        let matrices = machine.modes.map(|mode| {
            let omega = std::f64::consts::TAU * mode.frequency_hz;
            let decay = mode.damping_ratio * omega;
            let damped = omega * (1.0 - mode.damping_ratio.powi(2)).sqrt();
            let (sin, cos) = (damped * seconds).sin_cos();
            let e = (-decay * seconds).exp();
            [
                [e * (cos + decay / damped * sin), e * sin / damped],
                [
                    -e * omega * omega / damped * sin,
                    e * (cos - decay / damped * sin),
                ],
            ]
        });
        let statics = machine
            .modes
            .map(|m| 1.0 / (m.mass_kg * (std::f64::consts::TAU * m.frequency_hz).powi(2)));
        Self {
            seconds,
            matrices,
            statics,
        }
    }

    fn apply(&self, motion: &[[f64; 2]; 2], force: [f64; 2]) -> [[f64; 2]; 2] {
        [0, 1].map(|r| {
            let rest = self.statics[r] * force[r];
            let (q, v) = (motion[r][0] - rest, motion[r][1]);
            let [[a, b], [c, d]] = self.matrices[r];
            [rest + a * q + b * v, c * q + d * v]
        })
    }
}

impl Integrator {
    pub fn new(machine: &Machine) -> Self {
        let steps = machine.steps();
        let points = steps * machine.teeth;
        let angle_deg = |point: usize| 360.0 * point as f64 / points as f64;
        let engaged =
            |point: usize| angle_deg(point) > machine.start_deg && angle_deg(point) < machine.exit_deg;
        Self {
            directions: (0..points)
                .map(|point| angle_deg(point).to_radians().sin_cos())
                .collect(),
            engaged: (0..points).map(engaged).collect(),
            machine: machine.clone(),
            motion: [[0.0; 2]; 2],
            surface: vec![0.0; points],
            steps,
            step: 0,
            propagator: None,
            loses_contact: true,
            disturbance_n: [0.0; 2],
        }
    }

    pub fn steps(&self) -> usize {
        self.steps
    }

    /// Numbers of the surface points that are cut in steady engagement, in order of the angle.
    pub fn engaged(&self) -> Vec<usize> {
        (0..self.surface.len())
            .filter(|&point| self.engaged[point])
            .collect()
    }

    /// Displacement along x and y.
    fn displacement(&self, motion: &[[f64; 2]; 2]) -> [f64; 2] {
        [0, 1].map(|d| {
            (0..2)
                .map(|r| self.machine.modes[r].direction[d] * motion[r][0])
                .sum()
        })
    }

    /// Reach of the tooth at a point, beyond the nominal circle, and the sine of its immersion.
    fn reach(&self, displacement: [f64; 2], place: usize, step: usize) -> (f64, f64) {
        let point = (place * self.steps + step % self.steps) % self.surface.len();
        let (sin, cos) = self.directions[point];
        // The tooth at place p now is tooth p − k of the tool, k the pitches since angle 0.
        let turns = step / self.steps % self.machine.teeth;
        let tooth = place + self.machine.teeth - turns;
        (
            displacement[0] * sin + displacement[1] * cos + self.machine.runout(tooth),
            sin,
        )
    }

    /// Cutting force on each mode at the point of `step`.
    fn force(&self, motion: &[[f64; 2]; 2], step: usize, depth_m: f64) -> [f64; 2] {
        let mut modal = self.disturbance_n;
        if depth_m <= 0.0 {
            return modal;
        }
        let displacement = self.displacement(motion);
        let [tangential, radial] = self.machine.coefficients;
        for place in 0..self.machine.teeth {
            let point = (place * self.steps + step % self.steps) % self.surface.len();
            if !self.engaged[point] {
                continue;
            }
            let (sin, cos) = self.directions[point];
            let (reach, _) = self.reach(displacement, place, step);
            let chip = reach - self.surface[point] + self.machine.feed_per_tooth_m * sin;
            if chip <= 0.0 && self.loses_contact {
                continue;
            }
            let area = depth_m * chip;
            let force = [
                area * (-cos * tangential - sin * radial),
                area * (sin * tangential - cos * radial),
            ];
            for (modal, mode) in modal.iter_mut().zip(&self.machine.modes) {
                *modal += mode.direction[0] * force[0] + mode.direction[1] * force[1];
            }
        }
        modal
    }

    /// Leaves the surface at the point of the present step.
    fn leave_surface(&mut self, depth_m: f64) {
        let displacement = self.displacement(&self.motion);
        for place in 0..self.machine.teeth {
            let point = (place * self.steps + self.step % self.steps) % self.surface.len();
            if !self.engaged[point] {
                continue;
            }
            let (reach, sin) = self.reach(displacement, place, self.step);
            let old = self.surface[point] - self.machine.feed_per_tooth_m * sin;
            self.surface[point] = if depth_m <= 0.0 {
                // Nothing is cut: the tool finds the nominal surface when it enters.
                0.0
            } else if self.loses_contact {
                reach.max(old)
            } else {
                reach
            };
        }
    }

    /// Integrates one step of the spindle angle at this speed. Returns the acceleration along x and y at its start, m/s².
    pub fn advance(&mut self, turns_per_second: f64, depth_m: f64) -> [f64; 2] {
        let seconds = 1.0 / (turns_per_second * self.surface.len() as f64);
        let propagator = match self.propagator {
            Some(known) if known.seconds == seconds => known,
            _ => Propagator::new(&self.machine, seconds),
        };
        self.propagator = Some(propagator);
        let start = self.force(&self.motion, self.step, depth_m);
        let acceleration = self.acceleration(start);
        let predicted = propagator.apply(&self.motion, start);
        self.leave_surface(depth_m);
        let end = self.force(&predicted, self.step + 1, depth_m);
        let mean = [0, 1].map(|r| 0.5 * (start[r] + end[r]));
        self.motion = propagator.apply(&self.motion, mean);
        self.step += 1;
        acceleration
    }

    /// q̈ = F/m − 2ζω·q̇ − ω²·q, along x and y.
    fn acceleration(&self, force: [f64; 2]) -> [f64; 2] {
        let mut acceleration = [0.0; 2];
        for ((mode, motion), force) in self.machine.modes.iter().zip(&self.motion).zip(force) {
            let omega = std::f64::consts::TAU * mode.frequency_hz;
            let modal = force / mode.mass_kg
                - 2.0 * mode.damping_ratio * omega * motion[1]
                - omega * omega * motion[0];
            for (sum, part) in acceleration.iter_mut().zip(mode.direction) {
                *sum += part * modal;
            }
        }
        acceleration
    }
}
