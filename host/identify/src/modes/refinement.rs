//! Refines modes in pole–residue form by weighted nonlinear least squares (Levenberg–Marquardt with exact derivatives).

use nalgebra::{Cholesky, DMatrix, DVector};
use num_complex::Complex64;
use std::f64::consts::TAU;

use super::covariance::covariance;
use super::jacobian::{jacobian, normal};
use super::mode::IdentifiedMode;
use super::pole_residue::{PoleResidue, shared};
use super::receptances::Receptances;
use super::shape;
use super::weights::{Weights, root_mean_square};
use quietcut_model::structure::Mode;

/// A refined modal fit with covariance and residual.
pub(super) struct Refined {
    pub(super) fit: PoleResidue,
    /// Covariance of the parameters in the order of [`PoleResidue::parameters`].
    pub(super) covariance: DMatrix<f64>,
    pub(super) relative_error: f64,
    pub(super) misfit: f64,
}

/// Number of Levenberg–Marquardt steps after which the fit counts as not converged. A choice.
const STEPS_MAX: usize = 200;

const DAMPING_MAX: f64 = 1e12;

/// Relative decrease of the sum of squares below which the iteration has converged. A choice.
const SETTLED: f64 = 1e-10;

/// Number of times that the weights are updated from the residual. A choice.
const ROUNDS: usize = 3;

/// Weighted least-squares fit from `start`, with updated weights; `None` if it does not converge.
pub(super) fn refine(data: &Receptances, start: PoleResidue) -> Option<Refined> {
    let mut weights = Weights::of(&data.deviation);
    let mut fit = least_squares(data, &weights, start)?;
    for _ in 0..ROUNDS {
        weights.update(data, &fit);
        fit = least_squares(data, &weights, fit)?;
    }
    for mode in &mut fit.modes {
        shape::normalize(&mut mode.right, &mut mode.left, &shared(data));
    }
    let unknowns = fit.parameters().len();
    let values = 2 * data.values.len() * data.frequency_hz.len();
    let freedom = values.checked_sub(unknowns).filter(|freedom| *freedom > 0)?;
    let misfit = Weights::of(&data.deviation).squares(&fit, data) / freedom as f64;
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
    (Weights::of(&plain).squares(fit, data) / values as f64).sqrt()
}

fn least_squares(data: &Receptances, weights: &Weights, mut fit: PoleResidue) -> Option<PoleResidue> {
    let mut squares = weights.squares(&fit, data);
    let mut damping = 1e-3;
    for _ in 0..STEPS_MAX {
        let jacobian = jacobian(data, &fit, weights);
        let normal = normal(&jacobian);
        let mut gradient = DVector::zeros(normal.nrows());
        for (of, left) in jacobian.iter().zip(weights.left(&fit, data)) {
            gradient += of.map(|z| z.re) * left.map(|z| z.re) + of.map(|z| z.im) * left.map(|z| z.im);
        }
        let before = squares;
        while damping < DAMPING_MAX {
            if let Some(step) = step(&normal, &gradient, damping) {
                let next = fit.moved(step.as_slice());
                let then = weights.squares(&next, data);
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

/// Levenberg–Marquardt step: solution of (N + μ diag N) step = gradient, with N scaled to a unit diagonal.
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
    /// Norm of the residue matrix of a mode divided by its standard deviation.
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
        // Variance of the residue matrix: |right|²·var(left) + |left|²·var(right).
        let deviation = (right * of_left + left * of_right).sqrt();
        if deviation > 0.0 {
            (right * left).sqrt() / deviation
        } else {
            f64::INFINITY
        }
    }

    /// A mode of the fit with its standard deviations.
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
            // Propagated from the pole: ω = |λ|, ζ = −Re λ/|λ|.
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
