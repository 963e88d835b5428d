//! Random machines, and the case file of each as the baseline.

use std::f64::consts::TAU;
use std::fmt::Write as _;

use nalgebra::{Complex, DMatrix};
use rand::RngExt;
use rand_chacha::ChaCha8Rng;

/// A machine without hidden effects.
#[derive(Clone, Debug)]
pub(crate) struct Machine {
    /// Directions in which the tool moves: 0, 1, 2 for x, y, z.
    pub(crate) axes: Vec<usize>,
    pub(crate) mass: DMatrix<f64>,
    pub(crate) damping: DMatrix<f64>,
    pub(crate) stiffness: DMatrix<f64>,
    /// Displacement of the tool per unit of each degree of freedom, along x, y, z.
    pub(crate) tip: Vec<[f64; 3]>,
    /// True if the case gives modes and not matrices.
    pub(crate) modal: bool,
    /// Lowest and highest natural frequency, rad/s.
    pub(crate) omega: [f64; 2],
    /// Typical vibration amplitude of the machine, m.
    pub(crate) amplitude_m: f64,
}

/// A random number between `low` and `high`, uniform in its logarithm.
pub(crate) fn between(random: &mut ChaCha8Rng, low: f64, high: f64) -> f64 {
    (low.ln() + (high / low).ln() * random.random::<f64>()).exp()
}

/// A random sign: −1 or 1.
pub(crate) fn either(random: &mut ChaCha8Rng) -> f64 {
    if random.random::<bool>() { 1.0 } else { -1.0 }
}

impl Machine {
    /// Draws a robot (8 to 40 Hz) or a spindle (200 to 1200 Hz) with this number of directions.
    pub(crate) fn draw(random: &mut ChaCha8Rng, directions: usize) -> Self {
        let robot = random.random::<bool>();
        let (frequency, mass, amplitude_m) = if robot {
            (
                between(random, 8.0, 20.0),
                between(random, 50.0, 300.0),
                between(random, 1e-4, 1e-3),
            )
        } else {
            (
                between(random, 200.0, 600.0),
                between(random, 0.05, 2.0),
                between(random, 2e-6, 2e-5),
            )
        };
        let modal = directions == 1 && random.random::<f64>() < 0.3;
        let freedoms = if modal { 2 } else { directions };
        let mut omegas = vec![TAU * frequency];
        while omegas.len() < freedoms {
            omegas.push(omegas[omegas.len() - 1] * random.random_range(1.25..2.0));
        }
        if !modal && random.random::<bool>() {
            omegas.reverse();
        }
        let masses: Vec<f64> = omegas.iter().map(|_| mass * between(random, 0.5, 2.0)).collect();
        let ratios: Vec<f64> = omegas.iter().map(|_| between(random, 0.005, 0.08)).collect();
        let diagonal = |value: &dyn Fn(usize) -> f64| {
            DMatrix::from_fn(freedoms, freedoms, |i, j| if i == j { value(i) } else { 0.0 })
        };
        let mut machine = Self {
            axes: (0..directions).collect(),
            mass: diagonal(&|i| masses[i]),
            damping: diagonal(&|i| 2.0 * ratios[i] * omegas[i] * masses[i]),
            stiffness: diagonal(&|i| masses[i] * omegas[i].powi(2)),
            tip: (0..freedoms)
                .map(|i| std::array::from_fn(|axis| f64::from(u8::from(axis == if modal { 0 } else { i }))))
                .collect(),
            modal,
            omega: [
                omegas.iter().fold(f64::INFINITY, |a, b| a.min(*b)),
                omegas.iter().fold(0.0, |a, b| b.max(a)),
            ],
            amplitude_m,
        };
        if !modal {
            machine.couple(random);
        }
        machine
    }

    /// Adds small off-diagonal entries to the matrices, which couple the directions.
    fn couple(&mut self, random: &mut ChaCha8Rng) {
        for matrix in [&mut self.mass, &mut self.damping, &mut self.stiffness] {
            for i in 0..matrix.nrows() {
                for j in 0..i {
                    let share = random.random_range(-0.08..0.08);
                    let value = share * (matrix[(i, i)] * matrix[(j, j)]).sqrt();
                    matrix[(i, j)] = value;
                    matrix[(j, i)] = value;
                }
            }
        }
    }

    /// Static stiffness at the tool along `axis`, N/m: for modes with all other directions free, for matrices the diagonal entry.
    pub(crate) fn stiffness_along(&self, axis: usize) -> f64 {
        if !self.modal {
            return self.stiffness[(axis, axis)];
        }
        1.0 / (0..self.tip.len())
            .map(|i| self.tip[i][axis].powi(2) / self.stiffness[(i, i)])
            .sum::<f64>()
    }

    /// Receptance of the tool along x, y, z, m/N: B (K − ω²M + iωC)⁻¹ Bᵀ.
    pub(crate) fn receptance(&self, omega: f64) -> DMatrix<Complex<f64>> {
        let dynamic = DMatrix::from_fn(self.tip.len(), self.tip.len(), |i, j| {
            Complex::new(
                self.stiffness[(i, j)] - omega * omega * self.mass[(i, j)],
                omega * self.damping[(i, j)],
            )
        });
        let tip = DMatrix::from_fn(3, self.tip.len(), |axis, i| Complex::from(self.tip[i][axis]));
        let inverse = dynamic.try_inverse().unwrap();
        &tip * inverse * tip.transpose()
    }

    /// Text of the table `[structure]` of the case file.
    pub(crate) fn case_text(&self) -> String {
        let mut text = String::from("[structure]\n");
        let names: Vec<&str> = self
            .axes
            .iter()
            .map(|axis| ["\"x\"", "\"y\"", "\"z\""][*axis])
            .collect();
        let directions = names.join(", ");
        if self.modal {
            writeln!(text, "kind = \"modes\"\ndirections = [{directions}]").unwrap();
            for i in 0..self.tip.len() {
                let (m, c, k) = (self.mass[(i, i)], self.damping[(i, i)], self.stiffness[(i, i)]);
                let omega = (k / m).sqrt();
                let ratio = c / (2.0 * m * omega);
                // H = 1/(m(s − λ)(s − λ̄)) has the residue 1/(2i·m·ω_d) at λ.
                let left = -1.0 / (2.0 * m * omega * (1.0 - ratio * ratio).sqrt());
                writeln!(
                    text,
                    "[[structure.mode]]\nfrequency_hz = {:e}\ndamping_ratio = {ratio:e}\nleft = [[0.0, {left:e}]]\nright = [[1.0, 0.0]]",
                    omega / TAU
                )
                .unwrap();
            }
        } else {
            writeln!(text, "kind = \"matrices\"\ndirections = [{directions}]").unwrap();
            for (name, matrix) in [
                ("mass", &self.mass),
                ("damping", &self.damping),
                ("stiffness", &self.stiffness),
            ] {
                let rows: Vec<String> = matrix
                    .row_iter()
                    .map(|row| {
                        let entries: Vec<String> = row.iter().map(|value| format!("{value:e}")).collect();
                        format!("[{}]", entries.join(", "))
                    })
                    .collect();
                writeln!(text, "{name} = [{}]", rows.join(", ")).unwrap();
            }
        }
        text
    }
}
