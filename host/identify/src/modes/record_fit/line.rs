//! One frequency line of a record: residual of the responses, its covariance, and the maximum likelihood estimate of
//! the forces.

use nalgebra::{Cholesky, Matrix3, Vector3};
use num_complex::Complex64;

use super::data::Data;
use super::unknowns::{SMOOTH, Unknowns};
use super::variances::Variances;
use crate::modes::shape;

/// Residual of the responses and estimated forces of a record at one frequency line. Missing responses are zero with
/// unit variance, missing forces zero without noise.
pub(super) struct Line {
    pub(super) s: Complex64,
    /// FRF matrix sⁿ H, with the number n of time derivatives that each response measures; rows responses, columns
    /// forces of the record.
    pub(super) gain: Matrix3<Complex64>,
    /// Residual e = X − sⁿ H F − T of the measured responses X under the measured forces F, with the transient T.
    pub(super) left: Vector3<Complex64>,
    /// Weighted residual C⁻¹ e.
    pub(super) weighted: Vector3<Complex64>,
    /// Weighted square eᴴ C⁻¹ e of the residual e with the covariance C.
    pub(super) square: f64,
    /// Whitening matrix L⁻¹ of the residual, from its covariance C = L Lᴴ.
    pub(super) whitening: Matrix3<Complex64>,
    /// Maximum likelihood estimate of the forces, F + V_f Hᴴ s̄ⁿ C⁻¹ e; the gradient of the cost equals that of a fit
    /// with these forces.
    pub(super) force: Vector3<Complex64>,
}

impl Line {
    /// Evaluates the residual of a record at line `k`; `None` if its covariance is not positive definite.
    pub(super) fn of(
        data: &Data<'_>,
        record: usize,
        unknowns: &Unknowns,
        variances: &Variances,
        k: usize,
    ) -> Option<Self> {
        let spectra = &data.records[record];
        let s = spectra.s(k);
        let gain = gain(data, record, unknowns, s);
        let mut force = Vector3::zeros();
        for (force, channel) in force.iter_mut().zip(&spectra.forces) {
            *force = channel.lines[k];
        }
        let mut left = -(gain * force);
        for (p, channel) in spectra.responses.iter().enumerate() {
            left[p] += channel.lines[k] - transient(data, record, unknowns, p, s);
        }
        let noise = of_forces(variances);
        let mut covariance = gain * Matrix3::from_diagonal(&noise) * gain.adjoint();
        covariance += variances.disturbance[k];
        for p in 0..3 {
            let own = variances.responses.get(p).copied().unwrap_or(1.0);
            covariance[(p, p)] += own;
        }
        let lower = Cholesky::new(covariance)?.l();
        let whitening = lower.solve_lower_triangular(&Matrix3::identity())?;
        let white = whitening * left;
        let weighted = whitening.adjoint() * white;
        let correction = gain.adjoint() * weighted;
        Some(Self {
            s,
            gain,
            left,
            weighted,
            square: white.norm_squared(),
            whitening,
            force: force + noise.component_mul(&correction),
        })
    }
}

/// Variances V_f of the measurement noise of the forces as complex numbers; zero for directions without a force
/// channel.
pub(super) fn of_forces(variances: &Variances) -> Vector3<Complex64> {
    Vector3::from_fn(|q, _| Complex64::from(variances.measured.get(q).copied().unwrap_or(0.0)))
}

/// FRF matrix sⁿ H between forces and measured responses of a record at s, with the number n of time derivatives that
/// each response measures.
pub(super) fn gain(data: &Data<'_>, record: usize, unknowns: &Unknowns, s: Complex64) -> Matrix3<Complex64> {
    let (responses, forces) = &data.axes[record];
    let mut gain = Matrix3::zeros();
    for mode in &unknowns.structure.modes {
        for (i, &p) in responses.iter().enumerate() {
            for (j, &q) in forces.iter().enumerate() {
                gain[(i, j)] += shape::pair(mode.right[p] * mode.left[q], s, mode.pole);
            }
        }
    }
    for (&(p, q), [above, below]) in data.places.iter().zip(&unknowns.structure.outside) {
        let at = (
            responses.iter().position(|&index| index == p),
            forces.iter().position(|&index| index == q),
        );
        if let (Some(i), Some(j)) = at {
            gain[(i, j)] += above + below / (s * s);
        }
    }
    for (i, channel) in data.records[record].responses.iter().enumerate() {
        let derivative = s.powi(channel.derivatives);
        for j in 0..forces.len() {
            gain[(i, j)] *= derivative;
        }
    }
    gain
}

/// Powers (s/ω₀)ʲ that make up the polynomial of the transient, with the mean angular frequency ω₀ of the lines. They
/// are alternately real and imaginary, as the transform of a real signal requires.
pub(super) fn powers(data: &Data<'_>, s: Complex64) -> [Complex64; SMOOTH] {
    std::array::from_fn(|j| (s / data.omega).powi(j as i32))
}

fn transient(data: &Data<'_>, record: usize, unknowns: &Unknowns, p: usize, s: Complex64) -> Complex64 {
    let transient = &unknowns.transients[record];
    let modes: Complex64 = unknowns
        .structure
        .modes
        .iter()
        .zip(&transient.residues[p])
        .map(|(mode, residue)| shape::pair(*residue, s, mode.pole))
        .sum();
    let smooth: Complex64 = powers(data, s)
        .iter()
        .zip(transient.smooth[p])
        .map(|(power, factor)| power * factor)
        .sum();
    modes + smooth
}
