//! Refines modes in pole–residue form by weighted nonlinear least squares (Levenberg–Marquardt with exact derivatives).

use nalgebra::{DMatrix, DVector};
use num_complex::Complex64;
use quietcut_numerics::Stop;
use quietcut_numerics::least_squares::{
    Damping, Idle, LevenbergMarquardt, MinimumNorm, NormalSums, Objective, Tolerance,
};
use std::f64::consts::TAU;

use super::covariance::covariance;
use super::jacobian::{jacobian, normal};
use super::leakage;
use super::mode::IdentifiedMode;
use super::pole_derivatives::pole_derivatives;
use super::pole_residue::{PoleResidue, shared};
use super::receptances::Receptances;
use super::shape;
use super::weights::{Weights, root_mean_square};
use quietcut_model::structure::Mode;

/// Result of a refined modal fit: modes, covariance of the parameters, and size of the residual.
pub(super) struct Refined {
    pub(super) fit: PoleResidue,
    /// Covariance of the parameters in the order of [`PoleResidue::parameters`].
    pub(super) covariance: DMatrix<f64>,
    pub(super) relative_error: f64,
    pub(super) misfit: f64,
}

/// Number of Levenberg–Marquardt steps after which a modal fit to receptances counts as not converged. A choice.
const STEPS_MAX: usize = 200;

/// Relative decrease of the sum of squares in a Levenberg–Marquardt step below which a modal fit to receptances has
/// converged. A choice.
const SETTLED: f64 = 1e-10;

/// Number of times that the weights of the receptances are updated from the residual of the modal fit. A choice.
const ROUNDS: usize = 3;

/// Singular value of the correlation matrix of residues, relative to the largest, up to which it counts as zero. A choice between the
/// rounding error and the correlations of data.
const DEPENDENT: f64 = 1e-9;

/// Number of real numbers in a complex matrix of rank one with so many rows and columns.
pub(super) fn residue_freedom(rights: usize, lefts: usize) -> usize {
    2 * (rights + lefts - 1)
}

/// Weighted least-squares fit of modes to receptances from `start`, with weights updated from the residual; `None` if
/// it does not converge or the data do not determine the parameters.
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
    let leakage = leakage::error(data, &fit, &weights)?;
    let noise = covariance(data, &fit, &weights)? * (values as f64 / freedom as f64);
    let covariance = noise + &leakage * leakage.transpose();
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

/// Weighted sum of squared residuals of the receptances as a function of the modes.
struct ReceptanceFit<'a> {
    data: &'a Receptances,
    weights: &'a Weights,
}

impl Objective for ReceptanceFit<'_> {
    type Point = PoleResidue;
    type Value = f64;

    fn value(&mut self, fit: &PoleResidue) -> Option<f64> {
        let squares = self.weights.squares(fit, self.data);
        squares.is_finite().then_some(squares)
    }

    fn linearize(&mut self, fit: &PoleResidue, _: &f64) -> Option<NormalSums> {
        let jacobian = jacobian(self.data, fit, self.weights);
        let matrix = normal(&jacobian);
        let mut gradient = DVector::zeros(matrix.nrows());
        for (of, left) in jacobian.iter().zip(self.weights.left(fit, self.data)) {
            gradient += of.map(|z| z.re) * left.map(|z| z.re) + of.map(|z| z.im) * left.map(|z| z.im);
        }
        Some(NormalSums { matrix, gradient })
    }

    fn moved(&self, fit: &PoleResidue, step: &DVector<f64>) -> PoleResidue {
        fit.moved(step.as_slice())
    }

    fn is_no_worse(&self, next: &f64, now: &f64) -> bool {
        next <= now
    }

    fn has_converged(&self, _: f64, next: &f64, now: &f64) -> bool {
        next <= now && now - next <= SETTLED * now
    }
}

fn least_squares(data: &Receptances, weights: &Weights, start: PoleResidue) -> Option<PoleResidue> {
    let found = search(STEPS_MAX).minimize(&mut ReceptanceFit { data, weights }, start)?;
    matches!(found.stop, Stop::Converged | Stop::Stagnated).then_some(found.point)
}

/// Levenberg–Marquardt settings of a fit of modes, with at most `iterations_max` linearizations.
///
/// The damping of the steps never falls to zero: scale and phase of the shapes are free, so that the normal matrix is
/// singular.
pub(super) fn search(iterations_max: usize) -> LevenbergMarquardt {
    LevenbergMarquardt {
        damping: Damping {
            first: 1e-3,
            shrink: 0.1,
            growth: 10.0,
            least: 1e-9,
            least_retried: 0.0,
        },
        iterations_max,
        // The trials of one step increase the damping λ tenfold each: 22 of them lead from the least λ, 1e-9, to 1e12.
        trials_max: 22,
        ridge: 0.0,
        idle: Idle::Hold,
    }
}

impl Refined {
    /// χ² of the hypothesis that the residue matrix R of a mode is zero: Rᵀ C⁺ R over the real and imaginary parts of its
    /// entries, with their covariance C. C has the rank of [`residue_freedom`], the number of real numbers that a matrix
    /// of rank one has.
    ///
    /// Where the residual around the mode is larger than elsewhere, by [`Self::local_misfit`], so are the deviations.
    pub(super) fn evidence(&self, data: &Receptances, index: usize) -> f64 {
        let mode = &self.fit.modes[index];
        let misfit = self.local_misfit(data, index);
        let (rights, lefts) = (mode.right.len(), mode.left.len());
        let shapes = 2 * (rights + lefts);
        let at = index * mode.width() + 2;
        let mut residues = DVector::<f64>::zeros(2 * rights * lefts);
        let mut by_shapes = DMatrix::<f64>::zeros(2 * rights * lefts, shapes);
        for p in 0..rights {
            for q in 0..lefts {
                let row = 2 * (p * lefts + q);
                let (right, left) = (mode.right[p], mode.left[q]);
                let residue = right * left;
                residues[row] = residue.re;
                residues[row + 1] = residue.im;
                for (column, factor) in [(2 * p, left), (2 * (rights + q), right)] {
                    by_shapes[(row, column)] = factor.re;
                    by_shapes[(row, column + 1)] = -factor.im;
                    by_shapes[(row + 1, column)] = factor.im;
                    by_shapes[(row + 1, column + 1)] = factor.re;
                }
            }
        }
        let covariance =
            &by_shapes * self.covariance.view((at, at), (shapes, shapes)) * by_shapes.transpose();
        // In standard deviations, since receptances of different directions have noise of different size.
        let mut scale = covariance.diagonal().map(|variance| {
            if variance > 0.0 {
                variance.sqrt().recip()
            } else {
                0.0
            }
        });
        let correlation = DMatrix::from_fn(residues.len(), residues.len(), |i, j| {
            covariance[(i, j)] * scale[i] * scale[j]
        });
        for (&(p, q), misfit) in data.places.iter().zip(&misfit) {
            let row = 2 * (p * lefts + q);
            for entry in [row, row + 1] {
                scale[entry] /= misfit.max(1.0).sqrt();
            }
        }
        let scaled = residues.component_mul(&scale);
        MinimumNorm::new(correlation, Tolerance::Relative(DEPENDENT))
            .map_or(f64::INFINITY, |inverse| scaled.dot(&inverse.solve(&scaled)))
    }

    /// Mean square of the weighted residual of each receptance around a mode, relative to that over the whole band: with weights
    /// |s − λ|⁻²/σ², by which a line determines the residue. The noise of a receptance is larger than its deviation says, for
    /// example, where a force has almost no power.
    fn local_misfit(&self, data: &Receptances, index: usize) -> Vec<f64> {
        let pole = self.fit.modes[index].pole;
        let mut weights = Weights::of(&data.deviation);
        weights.update(data, &self.fit);
        (0..data.values.len())
            .map(|k| {
                let left = self.fit.left_of(data, &weights.deviation, k);
                let (mut sum, mut all) = (0.0, 0.0);
                for ((left, deviation), hertz) in
                    left.iter().zip(&weights.deviation[k]).zip(&data.frequency_hz)
                {
                    let s = Complex64::new(0.0, TAU * hertz);
                    let weight = ((s - pole).norm() * deviation).powi(-2);
                    // Real and imaginary part have unit variance each.
                    sum += 0.5 * weight * left.norm_sqr();
                    all += weight;
                }
                sum / all
            })
            .collect()
    }

    /// A mode of the fit with its standard deviations.
    pub(super) fn mode(&self, index: usize) -> IdentifiedMode {
        let shaped = &self.fit.modes[index];
        let width = 2 + 2 * (shaped.right.len() + shaped.left.len());
        let at = index * width;
        let pole = shaped.pole;
        let omega = pole.norm();
        let damping_ratio = -pole.re / omega;
        let (by_frequency, by_damping) = pole_derivatives(pole);
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
            frequency_std_hz: by(by_frequency),
            damping_ratio_std: by(by_damping),
            left_std: deviations(at + 2 + 2 * shaped.right.len(), shaped.left.len()),
            right_std: deviations(at + 2, shaped.right.len()),
        }
    }
}
