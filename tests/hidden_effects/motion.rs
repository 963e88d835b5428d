//! Integrates structures with nonlinear laws in time: the linear structure by its matrix exponential, the laws by a Runge–Kutta method with
//! fixed steps (Lawson's) and with steps that end when a law switches.

use nalgebra::{DMatrix, DVector};

use super::law::{Branch, Law, ROOM, State, signs};
use super::sliders::{Branches, Sliders};

/// A force along x, y, z, N, as a function of time, displacement and velocity.
pub(crate) type Force<'a> = dyn Fn(f64, [f64; 3], [f64; 3]) -> [f64; 3] + 'a;

/// Equation of motion M q̈ + C q̇ + K q + Bᵀ f_r = Bᵀ F of the structure, u = B q the displacement of the tool.
#[derive(Clone, Debug)]
pub(crate) struct System {
    /// Number of degrees of freedom.
    freedoms: usize,
    inverse_mass: Vec<f64>,
    damping: Vec<f64>,
    stiffness: Vec<f64>,
    /// B, one row of x, y, z per degree of freedom.
    tip: Vec<[f64; 3]>,
    /// M⁻¹ Bᵀ.
    mobility: Vec<[f64; 3]>,
    laws: Vec<Law>,
    /// Time from which the laws of time count, s.
    start_s: f64,
    sliders: Vec<Sliders>,
    /// The step h for which `half` holds e^(A·h/2), by rows.
    step_s: f64,
    half: Vec<f64>,
}

/// Motion of the tool on a grid of equally spaced times.
#[derive(Clone, Debug, Default)]
pub(crate) struct Path {
    pub(crate) u: Vec<[f64; 3]>,
    pub(crate) v: Vec<[f64; 3]>,
    pub(crate) a: Vec<[f64; 3]>,
    /// Displacements and accelerations of the first two degrees of freedom.
    pub(crate) freedoms: Vec<[[f64; 2]; 2]>,
}

impl System {
    /// Builds the equation of motion without laws.
    pub(crate) fn new(
        mass: &DMatrix<f64>,
        damping: &DMatrix<f64>,
        stiffness: &DMatrix<f64>,
        tip: &[[f64; 3]],
        step_s: f64,
    ) -> Self {
        let freedoms = mass.nrows();
        let rows = |matrix: &DMatrix<f64>| matrix.transpose().as_slice().to_vec();
        let inverse = mass.clone().try_inverse().unwrap();
        let mobility = (0..freedoms)
            .map(|i| std::array::from_fn(|axis| (0..freedoms).map(|j| inverse[(i, j)] * tip[j][axis]).sum()))
            .collect();
        Self {
            freedoms,
            inverse_mass: rows(&inverse),
            damping: rows(damping),
            stiffness: rows(stiffness),
            tip: tip.to_vec(),
            mobility,
            laws: Vec::new(),
            start_s: 0.0,
            sliders: Vec::new(),
            step_s,
            half: rows(&(first_order(&inverse, damping, stiffness) * (0.5 * step_s)).exp()),
        }
    }

    /// e^(A·h/2)·y for the state of the structure; internal states of laws do not change.
    fn half(&self, y: &State) -> State {
        let n = 2 * self.freedoms;
        let mut after = *y;
        for (after, row) in after.iter_mut().zip(self.half.chunks_exact(n)) {
            *after = row.iter().zip(y).map(|(a, y)| a * y).sum();
        }
        after
    }

    /// The system with its laws of time counted from `start_s`.
    pub(crate) fn beginning_at(mut self, start_s: f64) -> Self {
        self.start_s = start_s;
        self
    }

    /// Adds a law to the equation of motion.
    pub(crate) fn add(&mut self, law: Law) {
        let own = self
            .laws
            .iter()
            .filter(|law| matches!(law, Law::BoucWen { .. }))
            .count();
        self.laws.push(match law {
            Law::BoucWen {
                axis,
                stiffness,
                yield_m,
                ..
            } => Law::BoucWen {
                axis,
                stiffness,
                yield_m,
                own: 2 * self.freedoms + own,
            },
            other => other,
        });
    }

    /// Adds a joint along an axis to the equation of motion.
    pub(crate) fn add_joint(&mut self, axis: usize, sliders: Sliders) {
        self.laws.push(Law::Joint {
            axis,
            sliders: self.sliders.len(),
        });
        self.sliders.push(sliders);
    }

    /// Moves the sliders of all joints to where they are in the state `y`.
    fn drag(&self, y: &State, branches: &mut Branches) {
        let u = self.displacement(y);
        for (law, places) in self.laws.iter().zip(&mut branches.places) {
            if let Law::Joint { axis, sliders } = law {
                self.sliders[*sliders].drag(u[*axis], places);
            }
        }
    }

    fn states(&self) -> usize {
        2 * self.freedoms
            + self
                .laws
                .iter()
                .filter(|law| matches!(law, Law::BoucWen { .. }))
                .count()
    }

    fn of_tip(&self, q: &[f64]) -> [f64; 3] {
        let mut sum = [0.0; 3];
        for (q, tip) in q.iter().zip(&self.tip) {
            for axis in 0..3 {
                sum[axis] += q * tip[axis];
            }
        }
        sum
    }

    /// Displacement of the tool along x, y, z.
    pub(crate) fn displacement(&self, y: &State) -> [f64; 3] {
        self.of_tip(&y[..self.freedoms])
    }

    /// The state at rest under a static force, without the laws.
    pub(crate) fn pulled(&self, force_n: [f64; 3]) -> State {
        let n = self.freedoms;
        let stiffness = DMatrix::from_row_slice(n, n, &self.stiffness);
        let load = DVector::from_fn(n, |i, _| {
            (0..3).map(|axis| self.tip[i][axis] * force_n[axis]).sum()
        });
        let q = stiffness.lu().solve(&load).unwrap();
        let mut state = [0.0; ROOM];
        state[..n].copy_from_slice(q.as_slice());
        state
    }

    /// Writes ẏ into `rate`, without the linear structure's part if `whole` is false. Returns the holding force of a sticking law, N.
    fn rate(
        &self,
        t: f64,
        y: &State,
        branches: &Branches,
        force: &Force<'_>,
        whole: bool,
        rate: &mut State,
    ) -> f64 {
        let n = self.freedoms;
        let (u, v) = (self.of_tip(&y[..n]), self.of_tip(&y[n..2 * n]));
        let mut left = force(t, u, v);
        let mut stuck = None;
        for (index, (law, &branch)) in self.laws.iter().zip(&branches.each).enumerate() {
            match law {
                Law::Friction { axis, .. } if branch == 0 => stuck = Some(*axis),
                Law::Joint { axis, sliders } => {
                    left[*axis] -= self.sliders[*sliders].restoring(u[*axis], &branches.places[index]);
                }
                law => {
                    let restoring = law.restoring(t - self.start_s, u, v, y, branch);
                    for axis in 0..3 {
                        left[axis] -= restoring[axis];
                    }
                }
            }
            if let Law::BoucWen {
                axis, yield_m, own, ..
            } = law
            {
                // Bouc–Wen with γ = β = ½: ż = v·(1 − |z/z_y|·(sign(v z) + 1)/2).
                let (of_v, of_z) = signs(branch);
                let share = if of_v == of_z {
                    of_z * y[*own] / yield_m
                } else {
                    0.0
                };
                rate[*own] = v[*axis] * (1.0 - share);
            }
        }
        for i in 0..n {
            rate[i] = if whole { y[n + i] } else { 0.0 };
            rate[n + i] = (0..3)
                .map(|axis| self.mobility[i][axis] * left[axis])
                .sum::<f64>();
        }
        if whole {
            self.resist(y, rate);
        }
        let Some(axis) = stuck else { return 0.0 };
        let acceleration: f64 = (0..n).map(|i| self.tip[i][axis] * rate[n + i]).sum();
        let mobility: f64 = (0..n).map(|i| self.tip[i][axis] * self.mobility[i][axis]).sum();
        let holding = acceleration / mobility;
        for i in 0..n {
            rate[n + i] -= self.mobility[i][axis] * holding;
        }
        holding
    }

    /// Subtracts M⁻¹(C q̇ + K q) from the accelerations.
    fn resist(&self, y: &State, rate: &mut State) {
        let n = self.freedoms;
        for k in 0..n {
            let own = k * n..(k + 1) * n;
            let mut resisting = 0.0;
            for (j, (c, stiffness)) in self.damping[own.clone()]
                .iter()
                .zip(&self.stiffness[own])
                .enumerate()
            {
                resisting += c * y[n + j] + stiffness * y[j];
            }
            for i in 0..n {
                rate[n + i] -= self.inverse_mass[i * n + k] * resisting;
            }
        }
    }

    /// One step: by Lawson's method if the step is the one of the exponential and no law sticks, otherwise by the classical method.
    fn step(&self, t: f64, h: f64, y: &State, branches: &Branches, force: &Force<'_>) -> State {
        let sticks = self
            .laws
            .iter()
            .zip(&branches.each)
            .any(|(law, branch)| matches!(law, Law::Friction { .. }) && *branch == 0);
        // Times are sums, so that a whole step is one within rounding.
        if sticks || (h - self.step_s).abs() > 1e-9 * self.step_s {
            return self.classical_step(t, h, y, branches, force);
        }
        let added = |t: f64, y: &State| {
            let mut rate = [0.0; ROOM];
            self.rate(t, y, branches, force, false, &mut rate);
            rate
        };
        let sum = |y: &State, share: f64, rate: &State| -> State {
            std::array::from_fn(|i| y[i] + share * rate[i])
        };
        let k1 = added(t, y);
        let middle = self.half(y);
        let k1 = self.half(&k1);
        let k2 = added(t + 0.5 * h, &sum(&middle, 0.5 * h, &k1));
        let k3 = added(t + 0.5 * h, &sum(&middle, 0.5 * h, &k2));
        let end = self.half(&middle);
        let k4 = added(t + h, &sum(&end, h, &self.half(&k3)));
        let k1 = self.half(&k1);
        let k23 = self.half(&std::array::from_fn(|i| k2[i] + k3[i]));
        std::array::from_fn(|i| end[i] + h / 6.0 * (k1[i] + 2.0 * k23[i] + k4[i]))
    }

    /// One step of the classical Runge–Kutta method of fourth order.
    fn classical_step(&self, t: f64, h: f64, y: &State, branches: &Branches, force: &Force<'_>) -> State {
        let states = self.states();
        let mut k = [[0.0; ROOM]; 4];
        let mut at = *y;
        self.rate(t, y, branches, force, true, &mut k[0]);
        for (stage, share) in [(1, 0.5), (2, 0.5), (3, 1.0)] {
            for i in 0..states {
                at[i] = y[i] + share * h * k[stage - 1][i];
            }
            let mut rate = [0.0; ROOM];
            self.rate(t + share * h, &at, branches, force, true, &mut rate);
            k[stage] = rate;
        }
        let mut after = *y;
        for i in 0..states {
            after[i] += h / 6.0 * (k[0][i] + 2.0 * k[1][i] + 2.0 * k[2][i] + k[3][i]);
        }
        after
    }

    /// Distance of the laws from their next switch: the smallest, and the index of its law. Negative after the switch.
    fn margin(&self, t: f64, y: &State, branches: &Branches, force: &Force<'_>) -> (f64, usize) {
        let mut least = (f64::INFINITY, 0);
        if self.laws.iter().all(|law| !law.switches()) {
            return least;
        }
        let n = self.freedoms;
        let (u, v) = (self.of_tip(&y[..n]), self.of_tip(&y[n..2 * n]));
        for (index, (law, &branch)) in self.laws.iter().zip(&branches.each).enumerate() {
            let margin = match law {
                Law::Friction { axis, .. } if branch != 0 => f64::from(branch) * v[*axis],
                Law::Friction { breakaway_n, .. } => {
                    let mut rate = [0.0; ROOM];
                    breakaway_n - self.rate(t, y, branches, force, true, &mut rate).abs()
                }
                Law::Gap { axis, half_gap_m, .. } if branch == 0 => half_gap_m - u[*axis].abs(),
                Law::Gap { axis, half_gap_m, .. } => f64::from(branch) * u[*axis] - half_gap_m,
                Law::BoucWen { axis, own, .. } => {
                    let (of_v, of_z) = signs(branch);
                    // Only the zeros of velocity and internal state count, so that their units may differ.
                    (of_v * v[*axis] * self.step_s).min(of_z * y[*own])
                }
                Law::Joint { axis, .. } => f64::from(branch) * v[*axis],
                Law::Stop { axis, gap_m, .. } => f64::from(2 * branch - 1) * (u[*axis] - gap_m),
                _ => f64::INFINITY,
            };
            if margin < least.0 {
                least = (margin, index);
            }
        }
        least
    }

    /// Sets a velocity that is zero within rounding to zero.
    fn stop(&self, axis: usize, velocity: f64, y: &mut State) {
        let n = self.freedoms;
        let mobility: f64 = (0..n).map(|i| self.tip[i][axis] * self.mobility[i][axis]).sum();
        for i in 0..n {
            y[n + i] -= self.mobility[i][axis] * velocity / mobility;
        }
    }

    /// Sets the branch that follows when law `index` switches or, if `start` is true, the branch that holds at the start.
    fn switch(
        &self,
        index: usize,
        t: f64,
        y: &mut State,
        branches: &mut Branches,
        force: &Force<'_>,
        start: bool,
    ) {
        let n = self.freedoms;
        let (u, v) = (self.of_tip(&y[..n]), self.of_tip(&y[n..2 * n]));
        let sign = |value: f64| if value > 0.0 { 1 } else { -1 };
        branches.each[index] = match self.laws[index] {
            Law::Friction { axis, .. } if start && v[axis] != 0.0 => sign(v[axis]),
            Law::Friction {
                axis, breakaway_n, ..
            } => {
                // At the end of sticking the limit is slightly reduced, because the switch was found only within rounding.
                let sticks = branches.each[index] == 0 && !start;
                let limit = if sticks {
                    breakaway_n * (1.0 - 1e-9)
                } else {
                    breakaway_n
                };
                self.stop(axis, v[axis], y);
                branches.each[index] = 0;
                let mut rate = [0.0; ROOM];
                let holding = self.rate(t, y, branches, force, true, &mut rate);
                if holding.abs() < limit { 0 } else { sign(holding) }
            }
            Law::Gap { axis, half_gap_m, .. } if start => {
                if u[axis].abs() <= half_gap_m {
                    0
                } else {
                    sign(u[axis])
                }
            }
            Law::Gap { axis, .. } if branches.each[index] == 0 => sign(u[axis]),
            Law::Gap { .. } => 0,
            Law::BoucWen { axis, own, .. } => {
                let [backward, negative] = [v[axis], y[own]].map(|value| Branch::from(value < 0.0));
                backward + 2 * negative
            }
            Law::Joint { axis, .. } if start => sign(v[axis]),
            Law::Joint { .. } => -branches.each[index],
            Law::Stop { axis, gap_m, .. } if start => Branch::from(u[axis] > gap_m),
            Law::Stop { .. } => 1 - branches.each[index],
            _ => 0,
        };
    }

    /// The branches of all laws at the start.
    pub(crate) fn branches(&self, t: f64, y: &mut State, force: &Force<'_>) -> Branches {
        let mut branches = Branches::new(self.laws.len());
        self.drag(y, &mut branches);
        for index in 0..self.laws.len() {
            self.switch(index, t, y, &mut branches, force, true);
        }
        branches
    }

    /// Advances the state from `t` to `t + h`, with steps that end when a law switches.
    pub(crate) fn advance(&self, t: f64, h: f64, y: &mut State, branches: &mut Branches, force: &Force<'_>) {
        let (mut now, end) = (t, t + h);
        // At most 64 switches per step are resolved.
        for _ in 0..64 {
            let rest = end - now;
            let after = self.step(now, rest, y, branches, force);
            let (margin, _) = self.margin(end, &after, branches, force);
            if margin >= 0.0 {
                *y = after;
                self.drag(y, branches);
                return;
            }
            let outside = self.crossing(now, rest, y, branches, force, margin);
            let mut at = self.step(now, outside * rest, y, branches, force);
            now += outside * rest;
            self.drag(&at, branches);
            let (_, index) = self.margin(now, &at, branches, force);
            self.switch(index, now, &mut at, branches, force, false);
            *y = at;
            if end - now <= 1e-12 * h {
                return;
            }
        }
        *y = self.step(now, end - now, y, branches, force);
        self.drag(y, branches);
    }

    /// The share of a step just after which a law switches, if the end of the step is beyond the switch by `margin`. Regula falsi with the
    /// Illinois modification; every third iteration bisects, in case the margin is strongly curved.
    fn crossing(
        &self,
        t: f64,
        h: f64,
        y: &State,
        branches: &Branches,
        force: &Force<'_>,
        margin: f64,
    ) -> f64 {
        let of = |share: f64| {
            self.margin(
                t + share * h,
                &self.step(t, share * h, y, branches, force),
                branches,
                force,
            )
            .0
        };
        let (mut inside, mut outside) = (0.0, 1.0);
        let (mut low, mut high) = (self.margin(t, y, branches, force).0.max(0.0), margin);
        for round in 0..60 {
            if outside - inside < 1e-12 {
                break;
            }
            let falsi = inside + (outside - inside) * low / (low - high);
            let share = if round % 3 == 2 {
                0.5 * (inside + outside)
            } else {
                falsi.clamp(inside + 1e-13, outside - 1e-13)
            };
            let margin = of(share);
            if margin >= 0.0 {
                (inside, low) = (share, margin);
                high *= 0.5;
            } else {
                (outside, high) = (share, margin);
                low *= 0.5;
            }
        }
        outside
    }

    /// Appends the motion of the tool at one time of the grid to `path`.
    pub(crate) fn note(&self, t: f64, y: &State, branches: &Branches, force: &Force<'_>, path: &mut Path) {
        let n = self.freedoms;
        let mut rate = [0.0; ROOM];
        self.rate(t, y, branches, force, true, &mut rate);
        path.u.push(self.of_tip(&y[..n]));
        path.v.push(self.of_tip(&y[n..2 * n]));
        path.a.push(self.of_tip(&rate[n..2 * n]));
        if n > 1 {
            path.freedoms.push([[y[0], y[1]], [rate[n], rate[n + 1]]]);
        }
    }
}

/// System matrix A of ẏ = A y with y = (q, q̇).
pub(crate) fn first_order(
    inverse_mass: &DMatrix<f64>,
    damping: &DMatrix<f64>,
    stiffness: &DMatrix<f64>,
) -> DMatrix<f64> {
    let n = inverse_mass.nrows();
    let mut a = DMatrix::zeros(2 * n, 2 * n);
    a.view_mut((0, n), (n, n)).fill_with_identity();
    a.view_mut((n, 0), (n, n)).copy_from(&(-inverse_mass * stiffness));
    a.view_mut((n, n), (n, n)).copy_from(&(-inverse_mass * damping));
    a
}
