//! The dominant Floquet multiplier of a machine and the growing coordinate of its motion, from the linear equations of the integrator.
//!
//! With z the motion and the surface that is still to be cut, z_{k+1} = M·z_k + b_{k mod N} from one tooth passing to the next. The left
//! eigenvector l of M (lᵀM = μ·lᵀ) gives the growing coordinate c = lᵀz, c_{k+1} = μ·c_k + lᵀb: its distance from the periodic orbit grows
//! by μ at each passing whatever the other modes do.

use rustfft::num_complex::Complex64;

use super::integrator::Integrator;
use super::machine::Machine;

/// The dominant multiplier and its coordinate.
#[derive(Clone, Debug)]
pub struct Floquet {
    pub multiplier: Complex64,
    left: Vec<Complex64>,
    points: Vec<usize>,
    /// Coordinate of the orbit at the start of the passing with number k modulo the number of teeth.
    orbit: Vec<Complex64>,
    /// Root mean square over one tooth period and both axes of the acceleration for |c| = 1, m/s².
    pub acceleration: f64,
    /// Strongest frequency of the growing mode in acceleration, Hz.
    pub frequency_hz: f64,
}

fn linear(machine: &Machine) -> Integrator {
    let still = Machine {
        feed_per_tooth_m: 0.0,
        runout_m: 0.0,
        ..machine.clone()
    };
    let mut integrator = Integrator::new(&still);
    integrator.loses_contact = false;
    integrator
}

fn state(integrator: &Integrator, points: &[usize]) -> Vec<f64> {
    let motion = integrator.motion.iter().flatten().copied();
    motion
        .chain(points.iter().map(|&p| integrator.surface[p]))
        .collect()
}

fn set(integrator: &mut Integrator, points: &[usize], z: &[f64]) {
    for (slot, value) in integrator.motion.iter_mut().flatten().zip(z) {
        *slot = *value;
    }
    for (&point, value) in points.iter().zip(&z[4..]) {
        integrator.surface[point] = *value;
    }
    integrator.step = 0;
}

/// The multiplier that two successive directions of a power iteration show: z_{k+2} = a·z_{k+1} + b·z_k by least squares.
fn pair(states: &[Vec<f64>]) -> Complex64 {
    let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
    let [.., x, y, z] = states else {
        return Complex64::default();
    };
    let (xx, xy, yy, xz, yz) = (dot(x, x), dot(x, y), dot(y, y), dot(x, z), dot(y, z));
    let determinant = xx * yy - xy * xy;
    if determinant < 1e-12 * xx * yy {
        return Complex64::new(xy / xx, 0.0);
    }
    let (b, a) = (
        (xz * yy - yz * xy) / determinant,
        (yz * xx - xz * xy) / determinant,
    );
    let root = Complex64::new(0.25 * a * a + b, 0.0).sqrt();
    let (first, second) = (0.5 * a + root, 0.5 * a - root);
    let larger = if first.norm() > second.norm() {
        first
    } else {
        second
    };
    if larger.im < 0.0 { larger.conj() } else { larger }
}

/// The last three directions of a power iteration with `map`, each of the length that the map gives it. The start is arbitrary.
fn iterate(size: usize, passings: usize, mut map: impl FnMut(&[f64]) -> Vec<f64>) -> Vec<Vec<f64>> {
    let mut z: Vec<f64> = (0..size).map(|n| 1e-6 * ((n * 7919 % 13) as f64 - 6.0)).collect();
    let mut states = Vec::new();
    for passing in 0..passings {
        if passing + 3 <= passings {
            let norm = z.iter().map(|x| x * x).sum::<f64>().sqrt().max(1e-300);
            z.iter_mut().for_each(|x| *x /= norm);
        }
        states.push(z.clone());
        z = map(&z);
    }
    states.split_off(passings - 3)
}

/// The dominant multiplier at this depth.
pub fn multiplier(machine: &Machine, depth_m: f64) -> Complex64 {
    let mut integrator = linear(machine);
    let points = integrator.engaged();
    // The scale of motion and velocity differ: the power iteration does not mind.
    let states = iterate(4 + points.len(), 160, |z| {
        set(&mut integrator, &points, z);
        for _ in 0..integrator.steps() {
            integrator.advance(machine.turns_per_second, depth_m);
        }
        state(&integrator, &points)
    });
    pair(&states)
}

impl Floquet {
    pub fn new(machine: &Machine, depth_m: f64) -> Self {
        let mut integrator = linear(machine);
        let points = integrator.engaged();
        let size = 4 + points.len();
        let mut map = |z: &[f64]| {
            set(&mut integrator, &points, z);
            for _ in 0..integrator.steps() {
                integrator.advance(machine.turns_per_second, depth_m);
            }
            state(&integrator, &points)
        };
        let columns: Vec<Vec<f64>> = (0..size)
            .map(|n| {
                let mut unit = vec![0.0; size];
                unit[n] = 1.0;
                map(&unit)
            })
            .collect();
        let right = iterate(size, 240, &mut map);
        let left = iterate(size, 240, |u| {
            columns
                .iter()
                .map(|column| column.iter().zip(u).map(|(a, b)| a * b).sum())
                .collect()
        });
        let multiplier = pair(&right);
        let vector = |states: &[Vec<f64>]| -> Vec<Complex64> {
            let [x, y, _] = states else { return Vec::new() };
            x.iter().zip(y).map(|(x, y)| y - multiplier.conj() * x).collect()
        };
        let (right, mut left) = if multiplier.im == 0.0 {
            let real = |states: &[Vec<f64>]| states[2].iter().map(|&x| x.into()).collect::<Vec<Complex64>>();
            (real(&right), real(&left))
        } else {
            (vector(&right), vector(&left))
        };
        let product: Complex64 = left.iter().zip(&right).map(|(l, r)| l * r).sum();
        left.iter_mut().for_each(|l| *l /= product);
        let mut floquet = Self {
            multiplier,
            left,
            points,
            orbit: vec![Complex64::default(); machine.teeth],
            acceleration: 0.0,
            frequency_hz: 0.0,
        };
        floquet.find_orbit(machine, depth_m);
        floquet.measure(machine, depth_m, &right);
        floquet
    }

    fn coordinate(&self, integrator: &Integrator) -> Complex64 {
        let z = state(integrator, &self.points);
        self.left.iter().zip(z).map(|(l, z)| l * z).sum()
    }

    /// o_{k+1} = μ·o_k + β_k, periodic over the teeth.
    fn find_orbit(&mut self, machine: &Machine, depth_m: f64) {
        let forcing: Vec<Complex64> = (0..machine.teeth)
            .map(|tooth| {
                let mut integrator = Integrator::new(machine);
                integrator.loses_contact = false;
                integrator.step = tooth * integrator.steps();
                for _ in 0..integrator.steps() {
                    integrator.advance(machine.turns_per_second, depth_m);
                }
                self.coordinate(&integrator)
            })
            .collect();
        let whole = self.multiplier.powu(machine.teeth as u32);
        let once = forcing
            .iter()
            .fold(Complex64::default(), |sum, b| self.multiplier * sum + b);
        let mut orbit = once / (1.0 - whole);
        for (slot, b) in self.orbit.iter_mut().zip(&forcing) {
            *slot = orbit;
            orbit = self.multiplier * orbit + b;
        }
    }

    /// Level and frequency of the growing mode: two periods of the acceleration of Re(r) and Im(r) with the growth taken off.
    fn measure(&mut self, machine: &Machine, depth_m: f64, right: &[Complex64]) {
        let mut integrator = linear(machine);
        let steps = integrator.steps();
        let parts: [Vec<[f64; 2]>; 2] = [0, 1].map(|part| {
            let z: Vec<f64> = right
                .iter()
                .map(|r| if part == 0 { r.re } else { r.im })
                .collect();
            set(&mut integrator, &self.points, &z);
            (0..steps)
                .map(|_| integrator.advance(machine.turns_per_second, depth_m))
                .collect()
        });
        // A complex coordinate c moves as Re(c·r) and is there twice, with its conjugate.
        let factor = if self.multiplier.im == 0.0 { 1.0 } else { 2.0 };
        let square: f64 = parts
            .iter()
            .flatten()
            .map(|a| 0.5 * factor * factor * (a[0] * a[0] + a[1] * a[1]))
            .sum();
        let share = if self.multiplier.im == 0.0 { 2.0 } else { 1.0 };
        self.acceleration = (share * square / steps as f64).sqrt();
        let angle = self.multiplier.arg() / std::f64::consts::TAU;
        let tooth_hz = 1.0 / machine.tooth_period_s();
        let mut best = (0.0, 0.0);
        for harmonic in -16..=16 {
            let cycles = angle + f64::from(harmonic);
            let mut sums = [Complex64::default(); 2];
            for (n, (re, im)) in parts[0].iter().zip(&parts[1]).enumerate() {
                let turn =
                    Complex64::from_polar(1.0, -std::f64::consts::TAU * cycles * n as f64 / steps as f64);
                for (sum, (re, im)) in sums.iter_mut().zip(re.iter().zip(im)) {
                    *sum += turn * Complex64::new(*re, *im);
                }
            }
            let power = sums.iter().map(Complex64::norm_sqr).sum::<f64>();
            if power > best.0 {
                best = (power, cycles.abs() * tooth_hz);
            }
        }
        self.frequency_hz = best.1;
    }

    /// Level of the growing motion at the start of a passing, root mean square of the acceleration over both axes, m/s².
    pub fn level(&self, integrator: &Integrator) -> f64 {
        let passing = integrator.step / integrator.steps();
        let orbit = self.orbit[passing % self.orbit.len()];
        (self.coordinate(integrator) - orbit).norm() * self.acceleration
    }
}

/// The depth at which |μ| is `abs`, above depths of which none reaches it; `None` where none up to a limit does.
pub fn depth_of(machine: &Machine, abs: f64) -> Option<f64> {
    let at = |depth_m: f64| multiplier(machine, depth_m).norm();
    let (mut low, mut high) = (0.0, 1e-5);
    while at(high) < abs {
        (low, high) = (high, 1.3 * high);
        if high > 0.1 {
            return None;
        }
    }
    for _ in 0..14 {
        let middle = 0.5 * (low + high);
        if at(middle) < abs {
            low = middle;
        } else {
            high = middle;
        }
    }
    Some(high)
}
