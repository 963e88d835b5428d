//! Weights of the receptances in a modal fit.
//!
//! Receptances from nearly dependent forces have large common errors. The residual of a first fit gives the correlation
//! between the receptances of a line, and the next fit is weighted with it (feasible GLS).

use nalgebra::{Cholesky, DMatrix, DVector};
use num_complex::Complex64;

use super::pole_residue::PoleResidue;
use super::receptances::Receptances;
use crate::criteria::LINES_PER_RECEPTANCE;

/// Ridge on the unit diagonal of the correlation matrix between the residuals of receptances. A choice: it bounds the
/// weight of combinations of receptances with almost no residual.
const CORRELATION_RIDGE: f64 = 1e-5;

/// Lower bound of the RMS residual of a receptance in the weights of a modal fit, relative to the RMS of the
/// receptance; it bounds the weight of an exact fit. A choice, above the rounding error.
const LEAST_LEFT: f64 = 1e-6;

/// Weights of the residual between measured and fitted receptances.
#[derive(Clone)]
pub(super) struct Weights {
    /// Standard deviations of the real part, equal to those of the imaginary part, by receptance and line, m/N.
    pub(super) deviation: Vec<Vec<f64>>,
    /// Whitening matrix between the residuals of the receptances of one line; `None` if they are taken as uncorrelated.
    whitening: Option<DMatrix<Complex64>>,
}

impl Weights {
    /// Weighted residuals of all receptances, measured minus fitted.
    pub(super) fn left(&self, fit: &PoleResidue, data: &Receptances) -> Vec<DVector<Complex64>> {
        let plain: Vec<DVector<Complex64>> = (0..data.values.len())
            .map(|k| DVector::from_vec(fit.left_of(data, &self.deviation, k)))
            .collect();
        self.mixed(plain)
    }

    /// Sum of squares of the weighted residuals of all receptances.
    pub(super) fn squares(&self, fit: &PoleResidue, data: &Receptances) -> f64 {
        self.left(fit, data).iter().map(DVector::norm_squared).sum()
    }

    pub(super) fn of(deviation: &[Vec<f64>]) -> Self {
        Self {
            deviation: deviation.to_vec(),
            whitening: None,
        }
    }

    /// Multiplies residuals or derivatives of all receptances by the whitening matrix, which is lower triangular, at
    /// every line.
    pub(super) fn mixed<C: nalgebra::Dim>(
        &self,
        plain: Vec<nalgebra::OMatrix<Complex64, nalgebra::Dyn, C>>,
    ) -> Vec<nalgebra::OMatrix<Complex64, nalgebra::Dyn, C>>
    where
        nalgebra::DefaultAllocator: nalgebra::allocator::Allocator<nalgebra::Dyn, C>,
    {
        let Some(whitening) = &self.whitening else {
            return plain;
        };
        (0..plain.len())
            .map(|k| {
                let mut sum = &plain[0] * whitening[(k, 0)];
                for (j, of) in plain.iter().enumerate().take(k + 1).skip(1) {
                    sum += of * whitening[(k, j)];
                }
                sum
            })
            .collect()
    }

    /// Updates the standard deviations and the whitening matrix from the residual of a modal fit.
    pub(super) fn update(&mut self, data: &Receptances, fit: &PoleResidue) {
        let mut left = Vec::with_capacity(data.values.len());
        for k in 0..data.values.len() {
            let values = fit.left_of(data, &self.deviation, k);
            let least = LEAST_LEFT * root_mean_square(&data.values[k]) / mean(&self.deviation[k]);
            // The standard deviation is that of the real and of the imaginary part of a receptance; each has half of
            // the variance of the complex value.
            let scale = (root_mean_square(&values) / 2.0_f64.sqrt()).max(least);
            for value in &mut self.deviation[k] {
                *value *= scale;
            }
            left.push(DVector::from_vec(values) / Complex64::from(scale));
        }
        self.whitening = whitening(&left);
    }
}

/// Root mean square of the magnitudes of complex values.
pub(super) fn root_mean_square(values: &[Complex64]) -> f64 {
    (values.iter().map(|value| value.norm_sqr()).sum::<f64>() / values.len().max(1) as f64).sqrt()
}

fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len().max(1) as f64
}

/// Whitening matrix L⁻¹ from the Cholesky factor of the correlation L Lᴴ between the residuals of the receptances, with
/// unit variance of real and of imaginary part; `None` with too few lines, or if the correlation matrix is not positive
/// definite.
fn whitening(left: &[DVector<Complex64>]) -> Option<DMatrix<Complex64>> {
    let (count, lines) = (left.len(), left.first().map_or(0, |left| left.len()));
    if lines < LINES_PER_RECEPTANCE * count {
        return None;
    }
    let mut correlation =
        DMatrix::from_fn(count, count, |k, j| left[j].dotc(&left[k]) / (2.0 * lines as f64));
    for k in 0..count {
        correlation[(k, k)] += CORRELATION_RIDGE;
    }
    let lower = Cholesky::new(correlation)?.unpack();
    lower.solve_lower_triangular(&DMatrix::identity(count, count))
}
