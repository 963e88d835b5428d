//! A small integrator of the delay equations of milling, independent of that of the host.
//!
//! Structure in first-order modal form: q̇_r = λ_r q_r + L_rᵀF, X = 2 Re Σ R_r q_r. Tooth j at immersion angle φ_j reaches u_j =
//! x sin φ_j + y cos φ_j + runout_j beyond its nominal circle. The chip thickness is h = u_j − w + f sin φ_j, where w is the
//! surface that the preceding teeth have left, and 0 if the tooth does not touch (edge angle 90°, eqs 3.1–3.4). The surface
//! becomes w ← max(u_j, w − f sin φ_j) at each angle.
//!
//! The method is Runge–Kutta of order 4 with steps that divide the tooth period and meet entry and exit. Hermite interpolation
//! gives values at half steps, which keeps the order.

use std::f64::consts::TAU;

/// A complex number with the operations that the integrator needs.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Complex {
    pub re: f64,
    pub im: f64,
}

impl Complex {
    pub const fn new(re: f64, im: f64) -> Self {
        Self { re, im }
    }
    fn add(self, b: Self) -> Self {
        Self::new(self.re + b.re, self.im + b.im)
    }
    fn mul(self, b: Self) -> Self {
        Self::new(self.re * b.re - self.im * b.im, self.re * b.im + self.im * b.re)
    }
    fn scale(self, by: f64) -> Self {
        Self::new(self.re * by, self.im * by)
    }
}

/// One mode: H(s) = R Lᵀ/(s − λ) + its conjugate.
#[derive(Clone, Copy, Debug)]
pub struct Mode {
    pub pole: Complex,
    pub left: [Complex; 3],
    pub right: [Complex; 3],
}

impl Mode {
    pub fn new(frequency_hz: f64, damping_ratio: f64, left: [Complex; 3], right: [Complex; 3]) -> Self {
        let omega = TAU * frequency_hz;
        let pole = Complex::new(
            -damping_ratio * omega,
            omega * (1.0 - damping_ratio.powi(2)).sqrt(),
        );
        Self { pole, left, right }
    }

    /// A mode in one direction with a real modal mass.
    pub fn single(direction: usize, frequency_hz: f64, damping_ratio: f64, mass_kg: f64) -> Self {
        let omega_d = TAU * frequency_hz * (1.0 - damping_ratio.powi(2)).sqrt();
        let mut left = [Complex::default(); 3];
        let mut right = [Complex::default(); 3];
        left[direction] = Complex::new(1.0, 0.0);
        right[direction] = Complex::new(0.0, -1.0 / (2.0 * mass_kg * omega_d));
        Self::new(frequency_hz, damping_ratio, left, right)
    }
}

/// Everything that is constant during a cut: structure, tool and material.
#[derive(Clone, Debug)]
pub struct Process {
    pub modes: Vec<Mode>,
    pub teeth: usize,
    /// Cutting force coefficients, tangential, radial, axial, in N/m².
    pub coefficients: [f64; 3],
    pub start_deg: f64,
    pub exit_deg: f64,
    pub feed_per_tooth_m: f64,
    pub rpm: f64,
    /// False allows a negative chip thickness, as in the linear equations.
    pub loses_contact: bool,
    /// False omits the regenerative part of the chip. The motion then is the forced orbit, on which X = X_τ.
    pub regenerative: bool,
    /// Runout e in m: tooth j is e·cos(ψ + 2πj/N) beyond the nominal circle.
    pub runout_m: f64,
    pub runout_angle: f64,
}

/// `kuka-kr90-acetal`: Table 7.1, half-immersion down-milling.
pub fn robot(rpm: f64) -> Process {
    let c = Complex::new;
    let first = Mode::new(
        16.99,
        0.0285,
        [
            c(-0.001834, -0.000534),
            c(-0.005147, 0.004861),
            c(-0.00171, 0.001637),
        ],
        [
            c(-0.002057, -0.000718),
            c(-0.003921, 0.005505),
            c(-0.001393, 0.001431),
        ],
    );
    let second = Mode::new(
        18.48,
        0.0996,
        [
            c(0.003231, -0.007626),
            c(-0.002853, 0.000308),
            c(-0.000508, 0.000672),
        ],
        [
            c(0.005046, -0.001777),
            c(-0.002399, -0.001326),
            c(-0.000278, 0.000696),
        ],
    );
    Process {
        modes: vec![first, second],
        teeth: 2,
        coefficients: [119e6, 20.23e6, 39.27e6],
        start_deg: 90.0,
        exit_deg: 180.0,
        feed_per_tooth_m: 0.15e-3,
        rpm,
        loses_contact: true,
        regenerative: true,
        runout_m: 0.0,
        runout_angle: 0.3,
    }
}

/// `insperger-2dof-ad0.5`: 922 Hz in x and y, half-immersion down-milling.
pub fn machine_tool(rpm: f64) -> Process {
    Process {
        modes: vec![
            Mode::single(0, 922.0, 0.011, 0.03993),
            Mode::single(1, 922.0, 0.011, 0.03993),
        ],
        teeth: 2,
        coefficients: [6e8, 2e8, 0.0],
        start_deg: 90.0,
        exit_deg: 180.0,
        feed_per_tooth_m: 0.1e-3,
        rpm,
        loses_contact: true,
        regenerative: true,
        runout_m: 0.0,
        runout_angle: 0.3,
    }
}

/// Times of entry and exit of the tool.
#[derive(Clone, Copy, Debug)]
pub struct Cut {
    pub depth_m: f64,
    /// Time at which the tool meets the material.
    pub enter_s: f64,
    /// Duration in which the engagement grows to its full angle; 0 for at once.
    pub ramp_s: f64,
    /// Time at which the tool leaves the material.
    pub leave_s: f64,
}

/// One integration step: position and velocity at both ends, which define a cubic between them.
#[derive(Clone, Copy, Debug)]
pub struct Step {
    pub position: [[f64; 3]; 2],
    pub velocity: [[f64; 3]; 2],
    /// True if any tooth cuts.
    pub cutting: bool,
}

/// The integrator.
pub struct Milling {
    process: Process,
    cut: Cut,
    steps_per_tooth: usize,
    /// Surface at each half step of the tooth period, for each position of a tooth.
    surface: Vec<Vec<f64>>,
    state: Vec<Complex>,
    step: usize,
    /// Additional force on the tool in N, constant over a step: noise that excites the structure.
    pub disturbance_n: [f64; 3],
}

impl Milling {
    /// A cut at its start. `steps_per_tooth` must place entry and exit at the ends of steps.
    pub fn new(process: Process, cut: Cut, steps_per_tooth: usize) -> Self {
        let places = process.teeth;
        let state = vec![Complex::default(); process.modes.len()];
        let surface = vec![vec![0.0; 2 * steps_per_tooth]; places];
        Self {
            process,
            cut,
            steps_per_tooth,
            surface,
            state,
            step: 0,
            disturbance_n: [0.0; 3],
        }
    }

    pub fn tooth_period_s(&self) -> f64 {
        60.0 / self.process.rpm / self.process.teeth as f64
    }

    pub fn dt(&self) -> f64 {
        self.tooth_period_s() / self.steps_per_tooth as f64
    }

    fn position(&self, state: &[Complex]) -> [f64; 3] {
        [0, 1, 2].map(|d| {
            self.process
                .modes
                .iter()
                .zip(state)
                .map(|(m, &q)| 2.0 * m.right[d].mul(q).re)
                .sum()
        })
    }

    fn derivative(&self, state: &[Complex], force: [f64; 3]) -> Vec<Complex> {
        let modal = |m: &Mode| {
            (0..3).fold(Complex::default(), |sum, d| {
                sum.add(m.left[d].scale(force[d] + self.disturbance_n[d]))
            })
        };
        self.process
            .modes
            .iter()
            .zip(state)
            .map(|(m, &q)| m.pole.mul(q).add(modal(m)))
            .collect()
    }

    fn velocity(&self, state: &[Complex], force: [f64; 3]) -> [f64; 3] {
        self.position(&self.derivative(state, force))
    }

    /// Immersion angle in degrees, 0 to 360, of the tooth at position `place` at half step `half` of a tooth period. The tooth
    /// at position p is p pitches ahead.
    fn angle_deg(&self, place: usize, half: f64) -> f64 {
        let pitch = 360.0 / self.process.teeth as f64;
        (half / (2 * self.steps_per_tooth) as f64 + place as f64) * pitch
    }

    /// Runout of the tooth at position `place` in tooth period `tooth`.
    fn runout(&self, place: usize, tooth: usize) -> f64 {
        let n = self.process.teeth;
        let j = (place + n - tooth % n) % n;
        self.process.runout_m * (self.process.runout_angle + TAU * j as f64 / n as f64).cos()
    }

    /// Engagement at a time: the last immersion angle that is cut, and the depth.
    fn engagement(&self, time: f64) -> (f64, f64) {
        let Process {
            start_deg, exit_deg, ..
        } = self.process;
        let Cut {
            depth_m,
            enter_s,
            ramp_s,
            leave_s,
        } = self.cut;
        if time < enter_s || time >= leave_s {
            return (start_deg, 0.0);
        }
        let share = if ramp_s > 0.0 {
            ((time - enter_s) / ramp_s).min(1.0)
        } else {
            1.0
        };
        (start_deg + share * (exit_deg - start_deg), depth_m)
    }

    /// Cutting force on the tool at half step `half` of the present tooth period, of the teeth engaged in this step.
    fn force(&self, state: &[Complex], half: usize, exit_deg: f64, depth_m: f64) -> [f64; 3] {
        let mut force = [0.0; 3];
        if depth_m == 0.0 {
            return force;
        }
        let [x, y, _] = self.position(state);
        let tooth = self.step / self.steps_per_tooth;
        let slot = half % (2 * self.steps_per_tooth);
        let wrapped = half / (2 * self.steps_per_tooth);
        let middle = (self.step % self.steps_per_tooth * 2 + 1) as f64;
        for place in 0..self.process.teeth {
            let inside = self.angle_deg(place, middle);
            if inside < self.process.start_deg || inside > exit_deg {
                continue;
            }
            let (sin, cos) = self.angle_deg(place, half as f64).to_radians().sin_cos();
            let reach = x * sin + y * cos + self.runout(place, tooth);
            // At the end of a tooth period, the same angle belongs to the next position.
            let before = self.surface.get(place + wrapped).map_or(0.0, |s| s[slot]);
            let regeneration = if self.process.regenerative {
                reach - before
            } else {
                0.0
            };
            let chip = regeneration + self.process.feed_per_tooth_m * sin;
            if chip <= 0.0 && self.process.loses_contact {
                continue;
            }
            let [kt, kr, ka] = self.process.coefficients;
            let area = depth_m * chip;
            force[0] += area * (-cos * kt - sin * kr);
            force[1] += area * (sin * kt - cos * kr);
            force[2] += area * -ka;
        }
        force
    }

    /// Stores the surface of the engaged teeth at a half step. The end of a step is the start of the next one, which stores it;
    /// with `last`, the end is stored for the teeth that leave the cut with this step.
    fn leave_surface(&mut self, state: &[Complex], half: usize, exit_deg: f64, depth_m: f64, last: bool) {
        let [x, y, _] = self.position(state);
        let tooth = self.step / self.steps_per_tooth;
        let middle = (self.step % self.steps_per_tooth * 2 + 1) as f64;
        let wrapped = half / (2 * self.steps_per_tooth);
        for place in 0..self.process.teeth {
            let inside = self.angle_deg(place, middle);
            let leaves = self.angle_deg(place, middle + 2.0) > exit_deg;
            let engaged = depth_m > 0.0 && inside >= self.process.start_deg && inside <= exit_deg;
            if !engaged || last && !leaves {
                continue;
            }
            let (sin, cos) = self.angle_deg(place, half as f64).to_radians().sin_cos();
            let reach = x * sin + y * cos + self.runout(place, tooth);
            let surface = self.surface.get_mut(place + wrapped);
            if let Some(slot) = surface.and_then(|s| s.get_mut(half % (2 * self.steps_per_tooth))) {
                let left = *slot - self.process.feed_per_tooth_m * sin;
                *slot = if self.process.loses_contact {
                    reach.max(left)
                } else {
                    reach
                };
            }
        }
    }

    /// Integrates one step.
    pub fn advance(&mut self) -> Step {
        let dt = self.dt();
        let time = self.step as f64 * dt;
        let (exit_deg, depth) = self.engagement(time + 0.5 * dt);
        let half = self.step % self.steps_per_tooth * 2;
        let start = self.state.clone();
        let plus = |k: &[Complex], by: f64| -> Vec<Complex> {
            start.iter().zip(k).map(|(q, d)| q.add(d.scale(by))).collect()
        };
        let f1 = self.force(&start, half, exit_deg, depth);
        let k1 = self.derivative(&start, f1);
        let s2 = plus(&k1, 0.5 * dt);
        let k2 = self.derivative(&s2, self.force(&s2, half + 1, exit_deg, depth));
        let s3 = plus(&k2, 0.5 * dt);
        let k3 = self.derivative(&s3, self.force(&s3, half + 1, exit_deg, depth));
        let s4 = plus(&k3, dt);
        let k4 = self.derivative(&s4, self.force(&s4, half + 2, exit_deg, depth));
        let end: Vec<Complex> = (0..start.len())
            .map(|i| {
                let sum = k1[i].add(k2[i].scale(2.0)).add(k3[i].scale(2.0)).add(k4[i]);
                start[i].add(sum.scale(dt / 6.0))
            })
            .collect();
        let f4 = self.force(&end, half + 2, exit_deg, depth);
        let d4 = self.derivative(&end, f4);
        let middle: Vec<Complex> = (0..start.len())
            .map(|i| {
                start[i]
                    .add(end[i])
                    .scale(0.5)
                    .add(k1[i].add(d4[i].scale(-1.0)).scale(dt / 8.0))
            })
            .collect();
        let step = Step {
            position: [self.position(&start), self.position(&end)],
            velocity: [self.velocity(&start, f1), self.velocity(&end, f4)],
            cutting: f1 != [0.0; 3] || f4 != [0.0; 3],
        };
        self.leave_surface(&start, half, exit_deg, depth, false);
        self.leave_surface(&middle, half + 1, exit_deg, depth, false);
        self.leave_surface(&end, half + 2, exit_deg, depth, true);
        self.state = end;
        self.step += 1;
        step
    }

    /// Changes the modal state of the first mode.
    pub fn push(&mut self, by: Complex) {
        self.state[0] = self.state[0].add(by);
    }

    /// Modal state.
    pub fn state(&self) -> &[Complex] {
        &self.state
    }

    /// Duration of one revolution in s.
    pub fn turn_s(&self) -> f64 {
        60.0 / self.process.rpm
    }
}
