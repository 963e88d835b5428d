//! Rate of decay and frequency of a mode as smooth functions of its amplitude.

use nalgebra::{DMatrix, DVector};
use num_complex::Complex64;
use quietcut_numerics::least_squares::{Idle, NormalEquations};

use super::decay_window::AmplitudeLaw;

/// Powers of u = A/A₀ of the terms of the frequency; those of the decline dA/dt are one higher.
const POWERS: [i32; 4] = [-1, 0, 1, 2];

/// Fewest points with which a law has all terms: two more than terms. A choice.
const LEAST_POINTS_OF_ALL: usize = 6;

/// A·σ(A) and ω(A) as sums of powers of u = A/A₀.
pub(super) struct SmoothLaw {
    /// Number of terms of the rate of decay, and likewise of the frequency.
    pub(super) terms: usize,
    /// Largest and smallest amplitude that was measured.
    range: [f64; 2],
    /// Coefficients of σ, 1/s, for [`POWERS`].
    rate: [f64; 4],
    /// Coefficients of ω, rad/s, for [`POWERS`].
    omega: [f64; 4],
}

impl SmoothLaw {
    /// The law through the poles at the amplitudes, by least squares with the standard deviations `deviations`: all terms
    /// from six points on, else a constant with the one of friction and cubic terms that fits better.
    pub(super) fn fitted(amplitudes: &[f64], poles: &[Complex64], deviations: &[f64]) -> Self {
        let with = |terms: &[usize]| Self::of_terms(terms, amplitudes, poles, deviations);
        if amplitudes.len() >= LEAST_POINTS_OF_ALL {
            return with(&[0, 1, 2, 3]);
        }
        let misfit = |law: &Self| -> f64 {
            amplitudes
                .iter()
                .zip(poles)
                .zip(deviations)
                .map(|((amplitude, pole), deviation)| {
                    (pole - law.pole(*amplitude)).norm_sqr() / deviation.powi(2)
                })
                .sum()
        };
        let (dry, cubic) = (with(&[0, 1]), with(&[1, 3]));
        if misfit(&dry) < misfit(&cubic) { dry } else { cubic }
    }

    fn of_terms(terms: &[usize], amplitudes: &[f64], poles: &[Complex64], deviations: &[f64]) -> Self {
        let largest = amplitudes.iter().copied().fold(0.0, f64::max);
        let smallest = amplitudes.iter().copied().fold(f64::INFINITY, f64::min);
        let row = |amplitude: f64| {
            DVector::from_iterator(
                terms.len(),
                terms.iter().map(|term| (amplitude / largest).powi(POWERS[*term])),
            )
        };
        let mut normal = DMatrix::zeros(terms.len(), terms.len());
        let mut right = DMatrix::zeros(terms.len(), 2);
        for ((amplitude, pole), deviation) in amplitudes.iter().zip(poles).zip(deviations) {
            let row = row(*amplitude);
            let weight = 1.0 / (deviation * deviation);
            normal.ger(weight, &row, &row, 1.0);
            right.column_mut(0).axpy(-weight * pole.re, &row, 1.0);
            right.column_mut(1).axpy(weight * pole.im, &row, 1.0);
        }
        let (mut rate, mut omega) = ([0.0; 4], [0.0; 4]);
        // The ridge only keeps the equations regular where the amplitudes hardly differ.
        if let Some(equations) = NormalEquations::new(&normal, 1e-10, Idle::Refuse) {
            let found = equations.solve_columns(&right);
            for (at, term) in terms.iter().enumerate() {
                rate[*term] = found[(at, 0)];
                omega[*term] = found[(at, 1)];
            }
        }
        Self {
            terms: terms.len(),
            range: [largest, smallest],
            rate,
            omega,
        }
    }

    pub(super) fn pole(&self, amplitude: f64) -> Complex64 {
        Complex64::new(-self.decline(amplitude) / amplitude, self.omega(amplitude))
    }
}

impl AmplitudeLaw for SmoothLaw {
    fn decline(&self, amplitude: f64) -> f64 {
        let u = amplitude / self.range[0];
        self.range[0] * self.rate.iter().rev().fold(0.0, |sum, term| sum * u + term)
    }

    fn omega(&self, amplitude: f64) -> f64 {
        let u = amplitude.max(self.range[1]) / self.range[0];
        self.omega.iter().rev().fold(0.0, |sum, term| sum * u + term) / u
    }
}
