//! The receptance of a linear structure as a sum over its poles, fast at many frequencies.

use nalgebra::{DMatrix, Matrix3};
use num_complex::Complex64;
use rayon::prelude::*;

use crate::criteria::LEAST_INVERSE_MASS_SHARE;
use crate::signal::grid::Grid;
use quietcut_model::structure::FirstOrder;

/// Largest relative difference |λ₁ − λ₂|/|λ₂| of two poles of the structure that count as one pole.
const SAME: f64 = 1e-9;

/// Receptance H(s) = Σ_r R_r/(s − λ_r) of a structure in first-order form, m/N, along x, y and z; rows displacement,
/// columns force.
#[derive(Clone, Debug)]
pub(crate) struct Receptance {
    terms: Vec<(Complex64, Matrix3<Complex64>)>,
    /// The first-order form of the structure, if the sum over poles misses the receptance: see [`new()`](Self::new);
    /// otherwise `None`.
    whole: Option<FirstOrder>,
}

impl Receptance {
    /// Computes the residues with the projectors P_r = Π_{j≠r} (A − λ_j)/(λ_r − λ_j) (Lagrange–Sylvester). Poles that
    /// coincide within `SAME` count once. If the sum misses the receptance by more than a relative 1e-8 at one of three
    /// test frequencies, the first-order form is kept instead.
    pub(crate) fn new(first_order: &FirstOrder) -> Self {
        let mut poles: Vec<Complex64> = Vec::new();
        for pole in first_order.poles() {
            if !poles
                .iter()
                .any(|known| (known - pole).norm() <= SAME * pole.norm())
            {
                poles.push(pole);
            }
        }
        let a = first_order.a.map(Complex64::from);
        let b = first_order.b.map(Complex64::from);
        let c = first_order.c.map(Complex64::from);
        let terms = poles
            .iter()
            .map(|&pole| {
                let mut projected = DMatrix::from_column_slice(b.nrows(), 3, b.as_slice());
                for other in poles.iter().filter(|other| **other != pole) {
                    projected = (&a * &projected - &projected * *other) / (pole - other);
                }
                let residue = &c * projected;
                (pole, Matrix3::from_fn(|i, j| residue[(i, j)]))
            })
            .collect();
        let sum = Self { terms, whole: None };
        let size = first_order.poles().iter().map(|p| p.norm()).fold(0.0, f64::max);
        let fits = [0.31, 0.83, 1.7].into_iter().all(|share| {
            let omega = share * size;
            let exact = first_order.receptance(omega).unwrap_or_else(Matrix3::zeros);
            (exact - sum.at(omega)).norm() <= 1e-8 * exact.norm()
        });
        if fits {
            sum
        } else {
            Self {
                terms: Vec::new(),
                whole: Some(first_order.clone()),
            }
        }
    }

    /// Receptance H(iω) of the structure, m/N, at ω, rad/s. The sum leaves out the term of a pole that lies at iω. If
    /// there is no sum over poles, H is zero where the first-order form has no receptance.
    pub(crate) fn at(&self, omega: f64) -> Matrix3<Complex64> {
        if let Some(whole) = &self.whole {
            return whole.receptance(omega).unwrap_or_else(Matrix3::zeros);
        }
        let s = Complex64::new(0.0, omega);
        let mut sum = Matrix3::zeros();
        for (pole, residue) in &self.terms {
            let distance = s - pole;
            if distance != Complex64::ZERO {
                sum += residue * distance.inv();
            }
        }
        sum
    }

    /// Poles λ in the upper half plane, each with the inverse modal mass 2·Im(λ)·|R| along `axis`, 1/kg, if that
    /// exceeds `LEAST_INVERSE_MASS_SHARE` times the largest one. Empty if the receptance has no sum over poles.
    pub(crate) fn modes_along(&self, axis: usize) -> impl Iterator<Item = (Complex64, f64)> {
        let per_mass = move |(pole, residue): &(Complex64, Matrix3<Complex64>)| {
            2.0 * pole.im * residue[(axis, axis)].norm()
        };
        let largest = self.terms.iter().map(per_mass).fold(0.0, f64::max);
        self.terms
            .iter()
            .map(move |term| (term.0, per_mass(term)))
            .filter(move |(pole, per_mass)| pole.im > 0.0 && *per_mass > LEAST_INVERSE_MASS_SHARE * largest)
    }

    /// √(Σ |R_r/(iω − λ_r)|²) over the poles, with the residues' diagonal entries of `axis`, m/N: the root sum of
    /// squares of the contributions of the poles to the receptance along `axis`. 0 if the receptance has no sum over
    /// poles.
    pub(crate) fn size_at(&self, omega: f64, axis: usize) -> f64 {
        let s = Complex64::new(0.0, omega);
        self.terms
            .iter()
            .map(|(pole, residue)| (residue[(axis, axis)] / (s - pole)).norm_sqr())
            .sum::<f64>()
            .sqrt()
    }
}

/// Receptance H(iω), m/N, at the bins of the upsampled spectrum of `grid`.
pub(crate) fn response(receptance: &Receptance, grid: &Grid) -> Vec<Matrix3<Complex64>> {
    (0..grid.fine_bins())
        .into_par_iter()
        .map(|bin| receptance.at(grid.omega(bin)))
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use quietcut_model::case::Case;

    #[test]
    fn the_sum_over_poles_is_the_receptance() {
        for name in [
            "kuka-kr90-acetal",
            "kuka-kr90-full",
            "staubli-tx200",
            "insperger-2dof-ad1",
        ] {
            let path = format!("{}/../../tests/cases/{name}.toml", env!("CARGO_MANIFEST_DIR"));
            let case = Case::read(path).unwrap();
            let first_order = case.structure().unwrap().first_order().unwrap();
            let sum = Receptance::new(&first_order);
            assert!(sum.whole.is_none(), "{name}");
            for omega in [0.0, 20.0, 107.0, 5800.0] {
                let exact = first_order.receptance(omega).unwrap();
                assert!((sum.at(omega) - exact).norm() < 1e-9 * exact.norm(), "{name}");
            }
        }
    }
}
