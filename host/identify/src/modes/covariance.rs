//! Covariance of the parameters of a modal fit to receptances.
//!
//! It is the sandwich covariance N⁻¹ M N⁻¹ with the normal matrix N. M contains the correlation of the residual between
//! receptances of one line, which share the noise of a response, and between neighbouring lines, which the window
//! causes (thesis chapter 7 uses Welch's method). Correlations are averaged over all lines.

use nalgebra::{DMatrix, DVector};
use num_complex::Complex64;

use super::jacobian::{jacobian, normal};
use super::pole_residue::{PoleResidue, shared};
use super::receptances::Receptances;
use super::weights::Weights;

/// Number of neighbouring frequency lines on each side with which the residual of a receptance is correlated: a Hann
/// window couples two.
const LAGS: usize = 2;

/// Covariance of the parameters of a modal fit under the constraints of [`shape::normalize`] on the mode shapes; `None`
/// as for [`constrained_inverse`].
pub(super) fn covariance(data: &Receptances, fit: &PoleResidue, weights: &Weights) -> Option<DMatrix<f64>> {
    let jacobian = jacobian(data, fit, weights);
    let normal = normal(&jacobian);
    let bread = constrained_inverse(fit, &shared(data), &normal)?;
    let left = weights.left(fit, data);
    let same_line = &bread * meat(&jacobian, &left, 0) * &bread;
    let all = &bread * meat(&jacobian, &left, LAGS) * &bread;
    // Correlations between lines, estimated from few lines, may make the variance of a parameter too small; the
    // variance is kept at least as large as without correlation between lines.
    let is_more = |i: usize| all[(i, i)] >= same_line[(i, i)];
    let scale = DVector::from_fn(all.nrows(), |i, _| {
        if is_more(i) || all[(i, i)] <= 0.0 {
            1.0
        } else {
            (same_line[(i, i)] / all[(i, i)]).sqrt()
        }
    });
    let scaled = DMatrix::from_fn(all.nrows(), all.ncols(), |i, j| {
        if all[(i, i)] <= 0.0 || all[(j, j)] <= 0.0 {
            same_line[(i, j)]
        } else {
            all[(i, j)] * scale[i] * scale[j]
        }
    });
    Some(scaled)
}

/// Middle matrix M of the sandwich covariance: ½ Σ Re(J(f)ᴴ C_l J(f + l)) over lines f and lags −`lags` … `lags`, with
/// the Jacobian J of the weighted receptances, and with C_l the mean of left(f) left(f + l)ᴴ over all lines f, where
/// left is the weighted residual of all receptances.
fn meat(jacobian: &[DMatrix<Complex64>], left: &[DVector<Complex64>], lags: usize) -> DMatrix<f64> {
    let size = jacobian.first().map_or(0, DMatrix::nrows);
    let lines = left.first().map_or(0, |left| left.len());
    let mut meat = DMatrix::<f64>::zeros(size, size);
    for lag in 0..=lags.min(lines.saturating_sub(1)) {
        let count = lines - lag;
        for (k, first) in left.iter().enumerate() {
            // Σ_k' C_l[k, k'] J_k'(f + l) over the receptances k'; it is then multiplied by the conjugate of J_k(f).
            let mut other = DMatrix::<Complex64>::zeros(size, count);
            for (j, second) in left.iter().enumerate() {
                let sum: Complex64 = (0..count)
                    .map(|line| first[line] * second[line + lag].conj())
                    .sum();
                other += jacobian[j].columns(lag, count) * (sum / lines as f64);
            }
            let own = jacobian[k].columns(0, count);
            let (a, b) = (own.map(|z| z.re), own.map(|z| z.im));
            let product = &a * other.map(|z| z.re).transpose() + &b * other.map(|z| z.im).transpose();
            // The summands of the lags l and −l are transposes of each other.
            let part = if lag == 0 {
                0.5 * (&product + product.transpose())
            } else {
                &product + product.transpose()
            };
            meat += 0.5 * part;
        }
    }
    meat
}

/// Covariance block of a modal fit: the upper left block of [N Gᵀ; G 0]⁻¹, with the normal matrix N and the gradients G
/// of the constraints on the mode shapes. The right shape of a mode can be multiplied by any complex factor if the left
/// one is divided by it. The data do not determine this factor; the constraints fix it. `None` if the matrix is
/// singular.
pub(super) fn constrained_inverse(
    fit: &PoleResidue,
    shared: &[(usize, usize)],
    normal: &DMatrix<f64>,
) -> Option<DMatrix<f64>> {
    let size = normal.nrows();
    let scale = normal
        .diagonal()
        .map(|entry| if entry > 0.0 { entry.sqrt().recip() } else { 1.0 });
    let mut bordered = DMatrix::<f64>::zeros(size + 2 * fit.modes.len(), size + 2 * fit.modes.len());
    for i in 0..size {
        for j in 0..size {
            bordered[(i, j)] = normal[(i, j)] * scale[i] * scale[j];
        }
    }
    let gradients = constraints(fit, shared, size);
    for (c, gradient) in gradients.iter().enumerate() {
        let scaled = gradient.component_mul(&scale);
        let norm = scaled.norm();
        for i in 0..size {
            bordered[(size + c, i)] = scaled[i] / norm;
            bordered[(i, size + c)] = scaled[i] / norm;
        }
    }
    let inverse = bordered.try_inverse()?;
    Some(DMatrix::from_fn(size, size, |i, j| {
        inverse[(i, j)] * scale[i] * scale[j]
    }))
}

fn constraints(fit: &PoleResidue, both: &[(usize, usize)], size: usize) -> Vec<DVector<f64>> {
    let mut gradients = Vec::new();
    for (r, mode) in fit.modes.iter().enumerate() {
        let (width, rights) = (mode.width(), mode.right.len());
        let mut norms = DVector::zeros(size);
        let mut phase = DVector::zeros(size);
        let right_at = |p: usize| r * width + 2 + 2 * p;
        let left_at = |q: usize| r * width + 2 + 2 * (rights + q);
        let mut of_norm = |at: usize, z: Complex64, sign: f64| {
            norms[at] = sign * z.re;
            norms[at + 1] = sign * z.im;
        };
        if both.is_empty() {
            (0..rights).for_each(|p| of_norm(right_at(p), mode.right[p], 1.0));
            (0..mode.left.len()).for_each(|q| of_norm(left_at(q), mode.left[q], -1.0));
            // If no direction is both excited and measured, the phase of the largest entry of the right shape is fixed.
            let p = (0..rights)
                .max_by(|&a, &b| mode.right[a].norm().total_cmp(&mode.right[b].norm()))
                .unwrap_or(0);
            phase[right_at(p)] = -mode.right[p].im;
            phase[right_at(p) + 1] = mode.right[p].re;
        }
        for &(p, q) in both {
            let (right, left) = (mode.right[p], mode.left[q]);
            of_norm(right_at(p), right, 1.0);
            of_norm(left_at(q), left, -1.0);
            // Constraint on the phase of the shapes: Σ Im(right·conj(left)) = 0 over the directions that are both
            // excited and measured.
            phase[right_at(p)] = -left.im;
            phase[right_at(p) + 1] = left.re;
            phase[left_at(q)] = right.im;
            phase[left_at(q) + 1] = -right.re;
        }
        gradients.push(norms);
        gradients.push(phase);
    }
    gradients
}
