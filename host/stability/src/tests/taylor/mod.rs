//! Test oracle: motions from Taylor series in time, their largest Floquet multiplier from Arnoldi's method, and the
//! number of multipliers beyond a radius.
//!
//! The oracle shares no code with the default method: no collocation, no matrix exponential, no characteristic matrix,
//! no chip normals. On each step of length h, with σ = (t − t₀)/h, states, forces and delayed displacement u_τ are
//! power series in σ:
//!
//!   (k + 1) x_{k+1} = h (A x_k + B F_k),   F_k = Σ_j [w K_j (u − u_τ)_{k−j} − β_j u_{k−j}],   u_k = C x_k,
//!
//! where the coefficients K_j and β_j follow from the harmonics of the tool's rotation. Steps end where a tooth enters
//! or leaves. The delay is the period, so that u_τ is the series of the same step one period earlier. The state of the
//! map contains x and the coefficients u_k of every step in which a tooth cuts.

use std::f64::consts::TAU;

use nalgebra::Matrix3;
use num_complex::Complex64;

use crate::problem::linear::Problem;

mod counter;
mod largest;

pub(crate) use counter::count_beyond;
pub(crate) use largest::largest_abs;

/// Accuracy of the Taylor series of a period.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Series {
    /// Highest power of a series.
    last: usize,
    /// Largest sum of the last two terms of a series, as a share of the motion; beyond it steps are shortened.
    tail: f64,
    /// Largest phase angle of the free structure in a step, rad.
    angle: f64,
}

impl Series {
    /// Coarse series, with errors near 1e-10.
    pub(crate) const COARSE: Self = Self {
        last: 20,
        tail: 1e-10,
        angle: 2.5,
    };
    /// Fine series, with errors near rounding.
    pub(crate) const FINE: Self = Self {
        last: 26,
        tail: 1e-14,
        angle: 2.0,
    };
}

/// Largest rotation of the tool in a step, rad.
const TURN: f64 = 0.7;

/// Share of the largest term of a coefficient's series below which the last terms are dropped as rounding.
const TERM: f64 = 1e-17;

/// Highest harmonic of the directional coefficients: products of two sines of the tool's rotation angle.
const HARMONICS: usize = 2;

/// One time step of the period.
struct Step {
    duration_s: f64,
    /// Index of the part of the tooth period (between entries and exits) that contains the step.
    part: usize,
    /// Terms w K_j of the regenerative coefficient, N/m, each 3 × 3 by rows; empty in free flight.
    force: Vec<[f64; 9]>,
    /// Terms β_j of the force per axial displacement, N/m; empty without axial-depth modulation.
    forced: Vec<[f64; 3]>,
    /// Index in the state of the first displacement coefficient of this step.
    first: usize,
}

/// One tooth period at one speed and depth.
struct TaylorPeriod {
    series: Series,
    order: usize,
    /// Matrix A of the structure by rows, n × n.
    a: Vec<f64>,
    /// Matrix B of the structure by rows, n × 3.
    b: Vec<[f64; 3]>,
    /// Matrix C of the structure by rows, 3 × n.
    c: Vec<f64>,
    /// Unit of the displacements in the state, m, so that they have the order of magnitude of x.
    scale_m: f64,
    steps: Vec<Step>,
    size: usize,
}

/// Function of the rotation angle of the tool, given by its harmonics 0, 1 and 2.
struct RotatingCoefficient<const N: usize>([[Complex64; N]; HARMONICS + 1]);

impl<const N: usize> RotatingCoefficient<N> {
    /// Harmonics of a function from its values at seven angles: enough to show that a third harmonic vanishes.
    fn of(function: impl Fn(f64) -> [f64; N]) -> Self {
        let count = 2 * HARMONICS + 3;
        let mut harmonics = [[Complex64::ZERO; N]; HARMONICS + 2];
        for l in 0..count {
            let angle = TAU * l as f64 / count as f64;
            for (m, harmonic) in harmonics.iter_mut().enumerate() {
                let factor = Complex64::cis(-(m as f64) * angle) / count as f64;
                for (sum, value) in harmonic.iter_mut().zip(function(angle)) {
                    *sum += factor * value;
                }
            }
        }
        let size = |m: usize| harmonics[m].iter().map(|entry| entry.norm()).fold(0.0, f64::max);
        let largest = (0..=HARMONICS).map(size).fold(0.0, f64::max);
        assert!(size(HARMONICS + 1) <= 1e-12 * largest, "a third harmonic");
        Self([harmonics[0], harmonics[1], harmonics[2]])
    }

    /// Adds the power series of the function over steps that rotate the tool by `turn` from `angle`, both rad.
    fn add_series(&self, angle: f64, turn: f64, factor: f64, terms: &mut [[f64; N]]) {
        for (m, harmonic) in self.0.iter().enumerate() {
            // The harmonics −m are conjugate to m, so that twice the real part of m stands for both.
            let twice = if m == 0 { 1.0 } else { 2.0 };
            let mut phase = Complex64::cis(m as f64 * angle) * (factor * twice);
            for (j, term) in terms.iter_mut().enumerate() {
                if j > 0 {
                    phase *= Complex64::new(0.0, m as f64 * turn / j as f64);
                }
                for (sum, entry) in term.iter_mut().zip(harmonic) {
                    *sum += (phase * entry).re;
                }
            }
        }
    }
}

/// Drops the last terms of a series that lie below [`TERM`].
fn trim<const N: usize>(terms: &mut Vec<[f64; N]>) {
    let size = |term: &[f64; N]| term.iter().map(|entry| entry.abs()).fold(0.0, f64::max);
    let largest = terms.iter().map(size).fold(0.0, f64::max);
    while terms.last().is_some_and(|term| size(term) <= TERM * largest) {
        terms.pop();
    }
}

/// Parts of the tooth period between entries and exits, as phases of the first tooth, with the immersion angles at
/// phase 0 of the teeth that cut in each.
fn parts(problem: &Problem) -> Vec<([f64; 2], Vec<f64>)> {
    let engagement = &problem.process.engagement;
    let (teeth, pitch) = (problem.teeth, TAU / problem.teeth as f64);
    let mut ends = vec![0.0, pitch];
    ends.extend([engagement.start, engagement.exit].map(|angle| angle.rem_euclid(pitch)));
    ends.sort_by(f64::total_cmp);
    let parts = ends.windows(2).filter(|ends| ends[1] - ends[0] > 1e-12);
    parts
        .map(|ends| {
            let middle = 0.5 * (ends[0] + ends[1]);
            let angles = (0..teeth).map(|tooth| tooth as f64 * pitch);
            let cutting =
                angles.filter(|angle| (engagement.start..engagement.exit).contains(&(angle + middle)));
            ([ends[0], ends[1]], cutting.collect())
        })
        .collect()
}

impl TaylorPeriod {
    /// Series of the tooth period with `counts` steps in each of its parts.
    fn new(problem: &Problem, rpm: f64, depth_m: f64, series: Series, counts: &[usize]) -> Self {
        let structure = &problem.structure;
        let process = &problem.process;
        let order = structure.order();
        let rad_per_s = rpm * TAU / 60.0;
        let directional = RotatingCoefficient::of(|angle| {
            let matrix: Matrix3<f64> = process.force.directional(angle);
            std::array::from_fn(|index| matrix[(index / 3, index % 3)])
        });
        let forced = process.axial_depth_modulation.then(|| {
            RotatingCoefficient::of(|angle| {
                let vector = process.force.forced(angle, process.feed_per_tooth_m);
                [vector.x, vector.y, vector.z]
            })
        });
        let mut steps = Vec::new();
        let mut size = order;
        for (part, (([from, to], teeth), &count)) in parts(problem).iter().zip(counts).enumerate() {
            let turn = (to - from) / count as f64;
            for index in 0..count {
                let phase = from + turn * index as f64;
                let mut force = vec![[0.0; 9]; if teeth.is_empty() { 0 } else { series.last }];
                let mut edge = vec![[0.0; 3]; if forced.is_some() { force.len() } else { 0 }];
                for immersion in teeth {
                    directional.add_series(immersion + phase, turn, depth_m, &mut force);
                    if let Some(forced) = &forced {
                        forced.add_series(immersion + phase, turn, 1.0, &mut edge);
                    }
                }
                trim(&mut force);
                trim(&mut edge);
                let first = size;
                if !force.is_empty() {
                    size += 3 * series.last;
                }
                steps.push(Step {
                    duration_s: turn / rad_per_s,
                    part,
                    force,
                    forced: edge,
                    first,
                });
            }
        }
        Self {
            series,
            order,
            a: structure.a.transpose().as_slice().to_vec(),
            b: (0..order)
                .map(|i| std::array::from_fn(|j| structure.b[(i, j)]))
                .collect(),
            c: structure.c.transpose().as_slice().to_vec(),
            scale_m: structure.c.amax(),
            steps,
            size,
        }
    }

    /// State one period later. Also writes, for each part of the period, the largest share of the last two terms in the
    /// motion.
    fn apply(&self, state: &[f64], tails: &mut [f64]) -> Vec<f64> {
        let (n, last) = (self.order, self.series.last);
        let mut after = vec![0.0; self.size];
        let mut x = vec![0.0; n * (last + 1)];
        let mut seen = vec![[0.0; 3]; last];
        let mut chips = vec![[0.0; 3]; last];
        x[..n].copy_from_slice(&state[..n]);
        let mut largest = 0.0_f64;
        for step in &self.steps {
            for k in 0..last {
                let mut force = [0.0; 3];
                if !step.force.is_empty() {
                    let at = step.first + 3 * k;
                    for axis in 0..3 {
                        let c = &self.c[axis * n..(axis + 1) * n];
                        let sum: f64 = c.iter().zip(&x[k * n..]).map(|(c, x)| c * x).sum();
                        seen[k][axis] = sum;
                        after[at + axis] = sum / self.scale_m;
                        chips[k][axis] = sum - state[at + axis] * self.scale_m;
                    }
                    for (matrix, chip) in step.force.iter().zip(chips[..=k].iter().rev()) {
                        for axis in 0..3 {
                            let row = &matrix[3 * axis..];
                            force[axis] += row[0] * chip[0] + row[1] * chip[1] + row[2] * chip[2];
                        }
                    }
                    for (vector, seen) in step.forced.iter().zip(seen[..=k].iter().rev()) {
                        for axis in 0..3 {
                            force[axis] -= vector[axis] * seen[2];
                        }
                    }
                }
                let factor = step.duration_s / (k + 1) as f64;
                let (known, next) = x[k * n..].split_at_mut(n);
                for (i, next) in next[..n].iter_mut().enumerate() {
                    let b = &self.b[i];
                    let pushed = b[0] * force[0] + b[1] * force[1] + b[2] * force[2];
                    let own: f64 = self.a[i * n..].iter().zip(&*known).map(|(a, x)| a * x).sum();
                    *next = factor * (own + pushed);
                }
            }
            let size = |k: usize| x[k * n..][..n].iter().map(|x| x.abs()).fold(0.0, f64::max);
            largest = (0..=last).map(size).fold(largest, f64::max);
            let tail = &mut tails[step.part];
            *tail = longer(*tail, (size(last) + size(last - 1)) / largest);
            // The series at σ = 1.
            for i in 0..n {
                x[i] = (0..=last).rev().map(|k| x[k * n + i]).sum();
            }
        }
        after[..n].copy_from_slice(&x[..n]);
        after
    }

    /// Transition matrix Φ by columns, with regenerative forces of `share` times w K u (share = 1 − z). Also writes,
    /// for each part of the period, the largest share of the last two terms in the motion.
    fn transition(&self, share: Complex64, tails: &mut [f64]) -> Vec<Complex64> {
        let (n, last) = (self.order, self.series.last);
        let mut phi = vec![Complex64::ZERO; n * n];
        let mut x = vec![Complex64::ZERO; n * (last + 1)];
        let mut seen = vec![[Complex64::ZERO; 3]; last];
        for (column, out) in phi.chunks_exact_mut(n).enumerate() {
            x[..n].fill(Complex64::ZERO);
            x[column] = Complex64::ONE;
            for step in &self.steps {
                for k in 0..last {
                    let mut force = [Complex64::ZERO; 3];
                    if !step.force.is_empty() {
                        for (seen, c) in seen[k].iter_mut().zip(self.c.chunks_exact(n)) {
                            *seen = c.iter().zip(&x[k * n..]).map(|(c, x)| x * *c).sum();
                        }
                        for (matrix, seen) in step.force.iter().zip(seen[..=k].iter().rev()) {
                            for axis in 0..3 {
                                let row = &matrix[3 * axis..];
                                force[axis] += seen[0] * row[0] + seen[1] * row[1] + seen[2] * row[2];
                            }
                        }
                        force = force.map(|force| force * share);
                        for (vector, seen) in step.forced.iter().zip(seen[..=k].iter().rev()) {
                            for axis in 0..3 {
                                force[axis] -= seen[2] * vector[axis];
                            }
                        }
                    }
                    let factor = step.duration_s / (k + 1) as f64;
                    let (known, next) = x[k * n..].split_at_mut(n);
                    for (i, next) in next[..n].iter_mut().enumerate() {
                        let b = &self.b[i];
                        let pushed = force[0] * b[0] + force[1] * b[1] + force[2] * b[2];
                        let own: Complex64 = self.a[i * n..].iter().zip(&*known).map(|(a, x)| x * *a).sum();
                        *next = (own + pushed) * factor;
                    }
                }
                let size = |k: usize| x[k * n..][..n].iter().map(|x| x.l1_norm()).fold(0.0, f64::max);
                let largest = (0..=last).map(size).fold(f64::MIN_POSITIVE, f64::max);
                let tail = &mut tails[step.part];
                *tail = longer(*tail, (size(last) + size(last - 1)) / largest);
                // The series at σ = 1.
                for i in 0..n {
                    x[i] = (0..=last).rev().map(|k| x[k * n + i]).sum();
                }
            }
            out.copy_from_slice(&x[..n]);
        }
        phi
    }

    /// Approximate number of floating-point operations of [`transition`](Self::transition). A product of a complex and
    /// a real number counts as two.
    fn transition_operations(&self) -> f64 {
        let (n, last) = (self.order as f64, self.series.last as f64);
        let of_step = |step: &Step| 4.0 * n * n + 12.0 * n + 18.0 * step.force.len() as f64;
        2.0 * n * last * self.steps.iter().map(of_step).sum::<f64>()
    }

    /// Starting vector, the same at every call, with components along all directions; the delayed displacement is
    /// constant in each step.
    fn start(&self) -> Vec<f64> {
        let mut state = vec![0.0; self.size];
        let number = |i: usize| ((i + 1) as f64 * 2.0_f64.sqrt()).fract() - 0.5;
        for (i, entry) in state[..self.order].iter_mut().enumerate() {
            *entry = number(i);
        }
        for step in self.steps.iter().filter(|step| !step.force.is_empty()) {
            for axis in 0..3 {
                state[step.first + axis] = number(step.first + axis);
            }
        }
        state
    }
}

/// Number of steps of each part of the period with which the series are tried first.
fn least_counts(problem: &Problem, rpm: f64, series: Series) -> Vec<usize> {
    let period_s = problem.tooth_period_s(rpm);
    let rate = (0..problem.structure.order())
        .map(|column| problem.structure.a.column(column).lp_norm(1))
        .fold(0.0, f64::max);
    let pitch = TAU / problem.teeth as f64;
    parts(problem)
        .iter()
        .map(|([from, to], _)| {
            let share = (to - from) / pitch;
            let steps = (rate * period_s * share / series.angle).max((to - from) / TURN);
            steps.ceil() as usize
        })
        .collect()
}

/// The larger of two shares of the last terms; infinite if one is not a number, since the motion has overflowed.
fn longer(p: f64, q: f64) -> f64 {
    if p.is_nan() || q.is_nan() {
        f64::INFINITY
    } else {
        p.max(q)
    }
}

/// True if the last terms of all series are below the share `tail` of the motion.
fn are_short(tails: &[f64], tail: f64) -> bool {
    tails.iter().all(|&found| found < tail)
}

/// Largest number of steps of a period. Motions that need more leave the range of numbers or take seconds.
const STEPS_MAX: usize = 8000;

/// Raises the number of steps of the parts whose last terms are too large; `None` if the total exceeds [`STEPS_MAX`].
fn refine(counts: &mut [usize], tails: &[f64], series: Series) -> Option<()> {
    for (count, tail) in counts.iter_mut().zip(tails) {
        if !tail.is_finite() {
            // The motion has overflowed, so that its terms do not say how many steps are needed.
            *count *= 4;
        } else if *tail >= series.tail {
            let finer = 1.05 * (tail / series.tail).powf(1.0 / (series.last - 1) as f64);
            *count = (*count as f64 * finer.clamp(1.1, 4.0)).ceil() as usize;
        }
    }
    (counts.iter().sum::<usize>() <= STEPS_MAX).then_some(())
}
