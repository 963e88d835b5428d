//! Leakage of receptances that are averages over windowed segments, and the error of the modes that it causes.
//!
//! A window w of length T with the transform W, ∫|W|² dν = 1, smooths the cross spectrum: the expected receptance is
//! ∫|W(ν)|² H(f − ν) dν ≈ H + ½ μ H″, with the mean square bandwidth μ = ∫|w′|² dt/(4π² ∫w² dt) of the window, 1/(3T²)
//! for a Hann window (Bendat and Piersol, Random Data, 4th ed. 2010, section 8.5, with the window's bandwidth). The
//! part of the response that the smoothed receptance does not explain has the power μ Σ|H′|² per power of the force,
//! with the sum over the forces, and lowers the coherence. So coherence bounds μ: a hammer test whose response dies
//! within the window has neither leakage nor a coherence that it lowers.

use nalgebra::{DMatrix, DVector};
use num_complex::Complex64;
use std::f64::consts::TAU;

use super::covariance::constrained_inverse;
use super::jacobian::{jacobian, normal};
use super::pole_residue::{PoleResidue, shared};
use super::receptances::Receptances;
use super::weights::Weights;

/// Step of the numerical derivatives of the fitted receptance, relative to the distance of the lines. A choice: the
/// fitted receptance is smooth over many lines.
const STEP: f64 = 0.25;

/// Error of the parameters of a modal fit by leakage, in the order of [`PoleResidue::parameters`]: the linearized
/// change of the parameters that the expected error ½ μ H″ of every receptance causes. Zero if the standard deviations
/// of the data do not follow from coherence. `None` as for [`constrained_inverse`].
///
/// The bandwidth μ is that of [`explaining_bandwidth`], but at most that of a Hann window of length T = 1/(distance of
/// the lines).
pub(super) fn error(data: &Receptances, fit: &PoleResidue, weights: &Weights) -> Option<DVector<f64>> {
    let unknowns = fit.parameters().len();
    if !data.has_coherence {
        return Some(DVector::zeros(unknowns));
    }
    let bandwidth = data.spacing_hz().powi(2) / 3.0;
    let leaking = bandwidth.min(explaining_bandwidth(data, fit));
    let mut shifted = data.clone();
    for (k, values) in shifted.values.iter_mut().enumerate() {
        for (value, hertz) in values.iter_mut().zip(&data.frequency_hz) {
            let [at, _, second] = derivatives(data, fit, k, *hertz);
            *value = at + 0.5 * leaking * second;
        }
    }
    let jacobian = jacobian(data, fit, weights);
    let mut gradient = DVector::zeros(unknowns);
    for (of, change) in jacobian.iter().zip(weights.left(fit, &shifted)) {
        gradient += of.map(|z| z.re) * change.map(|z| z.re) + of.map(|z| z.im) * change.map(|z| z.im);
    }
    let inverse: DMatrix<f64> = constrained_inverse(fit, &shared(data), &normal(&jacobian))?;
    Some(inverse * gradient)
}

/// Bandwidth μ, Hz², for which μ Σ|H′|², with the sum over the forces of a response, fits the squared standard
/// deviations from coherence best, by least squares over the lines of all receptances; 0 if all H′ are 0.
fn explaining_bandwidth(data: &Receptances, fit: &PoleResidue) -> f64 {
    let (mut explained, mut all) = (0.0, 0.0);
    for (k, deviation) in data.deviation.iter().enumerate() {
        let response = data.places[k].0;
        for (line, hertz) in data.frequency_hz.iter().enumerate() {
            let slopes: f64 = (0..data.places.len())
                .filter(|&other| data.places[other].0 == response)
                .map(|other| derivatives(data, fit, other, *hertz)[1].norm_sqr())
                .sum();
            explained += slopes * deviation[line] * deviation[line];
            all += slopes * slopes;
        }
    }
    if all > 0.0 { explained / all } else { 0.0 }
}

/// Fitted receptance `k` at a frequency in Hz, and its first and second numerical derivative by that frequency.
fn derivatives(data: &Receptances, fit: &PoleResidue, k: usize, hertz: f64) -> [Complex64; 3] {
    let step = STEP * data.spacing_hz();
    let at = |hertz: f64| fit.value(data.places[k], k, Complex64::new(0.0, TAU * hertz));
    let [before, here, after] = [at(hertz - step), at(hertz), at(hertz + step)];
    [
        here,
        (after - before) / (2.0 * step),
        (after - 2.0 * here + before) / (step * step),
    ]
}
