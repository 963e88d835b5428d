//! Modes in pole–residue form, refined until the weighted squares of what is left are least.
//!
//! H_pq(s) = Σ_r Ψᴿ_pr Ψᴸ_qr/(s − λ_r) + conjugates + U_pq + L_pq/s² with real U (compliance of modes above) and L (inertia
//! of those below), by Levenberg and Marquardt with exact derivatives. Residues are of rank one throughout.

use nalgebra::{Cholesky, DMatrix, DVector};
use num_complex::Complex64;
use std::f64::consts::TAU;

use super::covariance::covariance;
use super::stabilization::matrix_of;
use super::weights::{Weights, root_mean_square};
use super::{IdentifiedMode, Receptances, shape};
use quietcut_frf::rational_fit::residues;
use quietcut_model::structure::Mode;

/// A pole with its shapes.
#[derive(Clone, Debug)]
pub(super) struct Shaped {
    pub(super) pole: Complex64,
    pub(super) right: Vec<Complex64>,
    pub(super) left: Vec<Complex64>,
}

impl Shaped {
    /// How many numbers it is: its pole, right and left shape.
    pub(super) fn width(&self) -> usize {
        2 + 2 * (self.right.len() + self.left.len())
    }
}

/// The parameters of a fit.
#[derive(Clone, Debug)]
pub(super) struct PoleResidue {
    pub(super) modes: Vec<Shaped>,
    /// U and L of each receptance.
    pub(super) outside: Vec<[f64; 2]>,
}

/// A fit with what is known of it.
pub(super) struct Refined {
    pub(super) fit: PoleResidue,
    /// Covariance of the parameters in the order of [`PoleResidue::parameters`].
    pub(super) covariance: DMatrix<f64>,
    pub(super) relative_error: f64,
    pub(super) misfit: f64,
}

/// Steps of Levenberg and Marquardt after which a fit is given up, and those without progress.
const STEPS_MAX: usize = 200;
const DAMPING_MAX: f64 = 1e12;

/// Relative decrease of the squares below which they are least.
const SETTLED: f64 = 1e-10;

/// Rounds of weighing each receptance by what is left of it.
const ROUNDS: usize = 3;

impl PoleResidue {
    /// Residues of the poles by linear least squares, each cut to rank one.
    pub(super) fn start(data: &Receptances, poles: &[Complex64]) -> Option<Self> {
        let functions: Vec<&[Complex64]> = data.values.iter().map(Vec::as_slice).collect();
        let fit = residues(&data.frequency_hz, &functions, poles.to_vec())?;
        let modes = poles
            .iter()
            .enumerate()
            .map(|(r, &pole)| {
                let (mut right, mut left, _) = shape::rank_one(&matrix_of(data, &fit.residues, r))?;
                shape::normalize(&mut right, &mut left, &shared(data));
                Some(Shaped { pole, right, left })
            })
            .collect::<Option<Vec<_>>>()?;
        let mut start = Self {
            modes,
            outside: vec![[0.0; 2]; data.values.len()],
        };
        start.fit_outside(data);
        Some(start)
    }

    /// U and L by linear least squares of what the modes leave.
    fn fit_outside(&mut self, data: &Receptances) {
        for k in 0..data.values.len() {
            let (mut gram, mut right) = ([[0.0; 2]; 2], [0.0; 2]);
            for (line, &hertz) in data.frequency_hz.iter().enumerate() {
                let s = Complex64::new(0.0, TAU * hertz);
                let left = (data.values[k][line] - self.of_modes(data.places[k], s)).re;
                let weight = data.deviation[k][line].powi(-2);
                let row = [1.0, (s * s).inv().re];
                for i in 0..2 {
                    right[i] += weight * row[i] * left;
                    for j in 0..2 {
                        gram[i][j] += weight * row[i] * row[j];
                    }
                }
            }
            let determinant = gram[0][0] * gram[1][1] - gram[0][1] * gram[1][0];
            if determinant > 0.0 {
                self.outside[k] = [
                    (right[0] * gram[1][1] - right[1] * gram[0][1]) / determinant,
                    (right[1] * gram[0][0] - right[0] * gram[1][0]) / determinant,
                ];
            }
        }
    }

    fn of_modes(&self, (p, q): (usize, usize), s: Complex64) -> Complex64 {
        self.modes
            .iter()
            .map(|mode| shape::pair(mode.right[p] * mode.left[q], s, mode.pole))
            .sum()
    }

    fn value(&self, place: (usize, usize), k: usize, s: Complex64) -> Complex64 {
        let [above, below] = self.outside[k];
        self.of_modes(place, s) + above + below / (s * s)
    }

    /// Each mode: Re λ, Im λ, right shape (real and imaginary parts in turn), left shape; then U and L of each receptance.
    pub(super) fn parameters(&self) -> DVector<f64> {
        let modes = self.modes.iter().flat_map(|mode| {
            let numbers = std::iter::once(&mode.pole).chain(&mode.right).chain(&mode.left);
            numbers.flat_map(|z| [z.re, z.im]).collect::<Vec<f64>>()
        });
        let all: Vec<f64> = modes.chain(self.outside.iter().flatten().copied()).collect();
        DVector::from_vec(all)
    }

    /// The fit a step further, in the order of [`Self::parameters`].
    pub(super) fn moved(&self, step: &[f64]) -> Self {
        let mut moved = self.clone();
        let mut values = step.iter();
        let mut next = || values.next().copied().unwrap_or(0.0);
        for mode in &mut moved.modes {
            for z in std::iter::once(&mut mode.pole)
                .chain(&mut mode.right)
                .chain(&mut mode.left)
            {
                *z += Complex64::new(next(), next());
            }
        }
        for value in moved.outside.iter_mut().flatten() {
            *value += next();
        }
        moved
    }

    /// What is left of receptance `k`, each value over its deviation.
    pub(super) fn left_of(&self, data: &Receptances, deviation: &[Vec<f64>], k: usize) -> Vec<Complex64> {
        data.frequency_hz
            .iter()
            .enumerate()
            .map(|(line, hertz)| {
                let s = Complex64::new(0.0, TAU * hertz);
                (data.values[k][line] - self.value(data.places[k], k, s)) / deviation[k][line]
            })
            .collect()
    }

    /// What is left of all receptances, as it is weighed.
    pub(super) fn left(&self, data: &Receptances, weights: &Weights) -> Vec<DVector<Complex64>> {
        let plain: Vec<DVector<Complex64>> = (0..data.values.len())
            .map(|k| DVector::from_vec(self.left_of(data, &weights.deviation, k)))
            .collect();
        weights.mixed(plain)
    }

    fn squares(&self, data: &Receptances, weights: &Weights) -> f64 {
        self.left(data, weights).iter().map(DVector::norm_squared).sum()
    }

    /// ∂H_k/∂parameters at a line over the deviation there, written into a row.
    fn derivatives(&self, data: &Receptances, k: usize, s: Complex64, deviation: f64, row: &mut [Complex64]) {
        row.fill(Complex64::ZERO);
        let (p, q) = data.places[k];
        let rights = data.responses.len();
        let width = self.modes.first().map_or(0, Shaped::width);
        for (r, mode) in self.modes.iter().enumerate() {
            let (a, b) = ((s - mode.pole).inv(), (s - mode.pole.conj()).inv());
            let mut put = |at: usize, factor: Complex64, a: Complex64, b: Complex64| {
                let (up, down) = (factor * a, factor.conj() * b);
                row[r * width + at] = (up + down) / deviation;
                row[r * width + at + 1] = Complex64::i() * (up - down) / deviation;
            };
            put(0, mode.right[p] * mode.left[q], a * a, b * b);
            put(2 + 2 * p, mode.left[q], a, b);
            put(2 + 2 * (rights + q), mode.right[p], a, b);
        }
        let at = self.modes.len() * width + 2 * k;
        row[at] = Complex64::from(deviation.recip());
        row[at + 1] = (s * s).inv() / deviation;
    }
}

/// Directions that are both driven and seen, as indices of right and left shape.
pub(super) fn shared(data: &Receptances) -> Vec<(usize, usize)> {
    let of = |(p, direction)| Some((p, data.forces.iter().position(|force| force == direction)?));
    data.responses.iter().enumerate().filter_map(of).collect()
}

/// Least squares from `start`; `None` where they break down.
pub(super) fn refine(data: &Receptances, start: PoleResidue) -> Option<Refined> {
    let mut weights = Weights::of(&data.deviation);
    let mut fit = least_squares(data, &weights, start)?;
    for _ in 0..ROUNDS {
        weights.again(data, &fit);
        fit = least_squares(data, &weights, fit)?;
    }
    for mode in &mut fit.modes {
        shape::normalize(&mut mode.right, &mut mode.left, &shared(data));
    }
    let unknowns = fit.parameters().len();
    let values = 2 * data.values.len() * data.frequency_hz.len();
    let freedom = values.checked_sub(unknowns).filter(|freedom| *freedom > 0)?;
    let misfit = fit.squares(data, &Weights::of(&data.deviation)) / freedom as f64;
    let relative_error = relative_error(data, &fit);
    let covariance = covariance(data, &fit, &weights)? * (values as f64 / freedom as f64);
    Some(Refined {
        fit,
        covariance,
        relative_error,
        misfit,
    })
}

fn relative_error(data: &Receptances, fit: &PoleResidue) -> f64 {
    let plain: Vec<Vec<f64>> = data
        .values
        .iter()
        .map(|values| vec![root_mean_square(values); values.len()])
        .collect();
    let values = data.values.len() * data.frequency_hz.len();
    (fit.squares(data, &Weights::of(&plain)) / values as f64).sqrt()
}

/// Derivatives of all values as they are weighed: parameters by lines, one matrix per receptance.
pub(super) fn jacobian(data: &Receptances, fit: &PoleResidue, weights: &Weights) -> Vec<DMatrix<Complex64>> {
    let unknowns = fit.parameters().len();
    let mut row = vec![Complex64::ZERO; unknowns];
    let plain = (0..data.values.len())
        .map(|k| {
            // A column per line: each is written as it comes.
            let mut matrix = DMatrix::zeros(unknowns, data.frequency_hz.len());
            for (line, hertz) in data.frequency_hz.iter().enumerate() {
                let s = Complex64::new(0.0, TAU * hertz);
                fit.derivatives(data, k, s, weights.deviation[k][line], &mut row);
                matrix.column_mut(line).copy_from_slice(&row);
            }
            matrix
        })
        .collect();
    weights.mixed(plain)
}

/// Re(Jᴴ J) of all receptances.
pub(super) fn normal(jacobian: &[DMatrix<Complex64>]) -> DMatrix<f64> {
    let size = jacobian.first().map_or(0, DMatrix::nrows);
    jacobian.iter().fold(DMatrix::zeros(size, size), |sum, of| {
        let (re, im) = (of.map(|z| z.re), of.map(|z| z.im));
        sum + &re * re.transpose() + &im * im.transpose()
    })
}

fn least_squares(data: &Receptances, weights: &Weights, mut fit: PoleResidue) -> Option<PoleResidue> {
    let mut squares = fit.squares(data, weights);
    let mut damping = 1e-3;
    for _ in 0..STEPS_MAX {
        let jacobian = jacobian(data, &fit, weights);
        let normal = normal(&jacobian);
        let mut gradient = DVector::zeros(normal.nrows());
        for (of, left) in jacobian.iter().zip(fit.left(data, weights)) {
            gradient += of.map(|z| z.re) * left.map(|z| z.re) + of.map(|z| z.im) * left.map(|z| z.im);
        }
        let before = squares;
        while damping < DAMPING_MAX {
            if let Some(step) = step(&normal, &gradient, damping) {
                let next = fit.moved(step.as_slice());
                let then = next.squares(data, weights);
                if then <= squares {
                    (fit, squares) = (next, then);
                    damping = (0.1 * damping).max(1e-9);
                    break;
                }
            }
            damping *= 10.0;
        }
        if damping >= DAMPING_MAX || before - squares <= SETTLED * before {
            return squares.is_finite().then_some(fit);
        }
    }
    None
}

/// (N + μ diag N) step = gradient, in units in which the diagonal of N is one.
pub(super) fn step(normal: &DMatrix<f64>, gradient: &DVector<f64>, damping: f64) -> Option<DVector<f64>> {
    let scale = normal
        .diagonal()
        .map(|entry| if entry > 0.0 { entry.sqrt().recip() } else { 0.0 });
    let mut scaled = DMatrix::from_fn(normal.nrows(), normal.ncols(), |i, j| {
        normal[(i, j)] * scale[i] * scale[j]
    });
    for i in 0..scaled.nrows() {
        scaled[(i, i)] += damping;
    }
    let solution = Cholesky::new(scaled)?.solve(&gradient.component_mul(&scale));
    let step = solution.component_mul(&scale);
    step.iter().all(|value| value.is_finite()).then_some(step)
}

impl Refined {
    /// Norm of the residues of a mode over its standard deviation.
    pub(super) fn significance(&self, index: usize) -> f64 {
        let mode = &self.fit.modes[index];
        let width = 2 + 2 * (mode.right.len() + mode.left.len());
        let at = index * width + 2;
        let variance = |from: usize, count: usize| -> f64 {
            (from..from + 2 * count)
                .map(|i| self.covariance[(i, i)].max(0.0))
                .sum()
        };
        let norm = |shape: &[Complex64]| shape.iter().map(|entry| entry.norm_sqr()).sum::<f64>();
        let (right, left) = (norm(&mode.right), norm(&mode.left));
        let of_right = variance(at, mode.right.len());
        let of_left = variance(at + 2 * mode.right.len(), mode.left.len());
        // δ(right·leftᵀ)² = right²·δleft² + left²·δright².
        let deviation = (right * of_left + left * of_right).sqrt();
        if deviation > 0.0 {
            (right * left).sqrt() / deviation
        } else {
            f64::INFINITY
        }
    }

    /// A mode with the deviations of its numbers.
    pub(super) fn mode(&self, index: usize) -> IdentifiedMode {
        let shaped = &self.fit.modes[index];
        let width = 2 + 2 * (shaped.right.len() + shaped.left.len());
        let at = index * width;
        let pole = shaped.pole;
        let omega = pole.norm();
        let damping_ratio = -pole.re / omega;
        let by = |gradient: [f64; 2]| -> f64 {
            let covariance = |i: usize, j: usize| self.covariance[(at + i, at + j)];
            let variance = gradient[0] * gradient[0] * covariance(0, 0)
                + 2.0 * gradient[0] * gradient[1] * covariance(0, 1)
                + gradient[1] * gradient[1] * covariance(1, 1);
            variance.max(0.0).sqrt()
        };
        let deviations = |from: usize, count: usize| -> Vec<[f64; 2]> {
            let of = |i: usize| self.covariance[(i, i)].max(0.0).sqrt();
            (0..count)
                .map(|entry| [of(from + 2 * entry), of(from + 2 * entry + 1)])
                .collect()
        };
        IdentifiedMode {
            mode: Mode {
                frequency_hz: omega / TAU,
                damping_ratio,
                left: shaped.left.clone(),
                right: shaped.right.clone(),
            },
            // ω = |λ|, ζ = −Re λ/|λ|.
            frequency_std_hz: by([pole.re / omega / TAU, pole.im / omega / TAU]),
            damping_ratio_std: by([
                -pole.im * pole.im / omega.powi(3),
                pole.re * pole.im / omega.powi(3),
            ]),
            left_std: deviations(at + 2 + 2 * shaped.right.len(), shaped.left.len()),
            right_std: deviations(at + 2, shaped.right.len()),
        }
    }
}
