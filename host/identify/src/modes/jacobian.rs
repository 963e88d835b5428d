//! Derivatives of receptances by the parameters of their pole–residue form.

use nalgebra::DMatrix;
use num_complex::Complex64;
use std::f64::consts::TAU;

use super::pole_residue::PoleResidue;
use super::receptances::Receptances;
use super::weights::Weights;

/// Jacobian of the weighted receptances by the parameters of the modal fit: one matrix per receptance, with a row per
/// parameter and a column per line.
pub(super) fn jacobian(data: &Receptances, fit: &PoleResidue, weights: &Weights) -> Vec<DMatrix<Complex64>> {
    let unknowns = fit.parameters().len();
    let mut row = vec![Complex64::ZERO; unknowns];
    let plain = (0..data.values.len())
        .map(|k| {
            // The transposed Jacobian has one column per line, because derivatives are computed line by line.
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

/// Normal matrix Re(Jᴴ J) of a modal fit with the Jacobian J, summed over all receptances.
pub(super) fn normal(jacobian: &[DMatrix<Complex64>]) -> DMatrix<f64> {
    let size = jacobian.first().map_or(0, DMatrix::nrows);
    jacobian.iter().fold(DMatrix::zeros(size, size), |sum, of| {
        let (re, im) = (of.map(|z| z.re), of.map(|z| z.im));
        sum + &re * re.transpose() + &im * im.transpose()
    })
}
