//! A structure that is fitted to a table of receptances, in its cut, and how the table deviates from it.

use std::f64::consts::TAU;

use nalgebra::{Matrix3, Vector3};
use num_complex::Complex64;

use super::fitted_structure::FittedStructure;
use super::problem::FrequencyProblem;
use crate::problem::linear::Problem;

/// A problem with a table of receptances, and the structure that is fitted to it.
#[derive(Clone, Copy)]
pub(crate) struct FittedCut<'a> {
    pub(crate) problem: &'a FrequencyProblem,
    pub(crate) fitted: &'a FittedStructure,
}

impl FittedCut<'_> {
    /// The fitted structure with the cut of the problem.
    pub(crate) fn model(&self) -> Problem {
        Problem {
            structure: self.fitted.structure.clone(),
            process: self.problem.process,
            teeth: self.problem.teeth,
        }
    }

    /// Deviation of the table from the fitted receptances, m/N, at the imaginary part of s: a table holds real
    /// frequencies.
    pub(crate) fn deviation(&self, s: Complex64) -> Matrix3<Complex64> {
        let s = Complex64::new(0.0, s.im);
        self.problem.table_at(s / Complex64::new(0.0, TAU)) - self.fitted.transfer(s)
    }

    /// For each mode the largest deviation of the table from the fitted receptances within half a bandwidth of its
    /// frequency, as a share of its own receptance R/(s − p) there: as far as the table tells, its residue may be off by
    /// this share, and its pole by this share of its distance from the imaginary axis.
    pub(crate) fn shares_of_modes(&self) -> Vec<f64> {
        let share_at = |(pole, residue): &(Complex64, Matrix3<Complex64>), step: i32| {
            let s = Complex64::new(0.0, pole.im + 0.25 * pole.re.abs() * f64::from(step));
            self.deviation(s).norm() * (s - pole).norm() / residue.norm()
        };
        self.fitted
            .modes
            .iter()
            .map(|mode| (-4..=4).map(|step| share_at(mode, step)).fold(0.0, f64::max))
            .collect()
    }

    /// Largest |gᵀ δH(s) f| if the modes are off by the shares of [`Self::shares_of_modes`]: |gᵀR f| of each times its
    /// share of 1/|s − p| for the residue and of |Re p|/|s − p|² for the pole.
    pub(crate) fn change_by_modes(
        &self,
        shares: &[f64],
        s: Complex64,
        force: &Vector3<Complex64>,
        adjoint: &Vector3<Complex64>,
    ) -> f64 {
        let part = |pole: Complex64, residue: &Matrix3<Complex64>| {
            let size = (adjoint.transpose() * residue * force)[(0, 0)].norm();
            let distance = (s - pole).norm();
            size * (1.0 + pole.re.abs() / distance) / distance
        };
        let parts = self
            .fitted
            .modes
            .iter()
            .zip(shares)
            .map(|((pole, residue), share)| {
                share * (part(*pole, residue) + part(pole.conj(), &residue.conjugate()))
            });
        parts.sum()
    }
}
