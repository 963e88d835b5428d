//! Common interface of the loops with averaged and with periodic directional coefficients.

use num_complex::Complex64;

use super::problem::{FrequencyProblem, Resonance};
use crate::error::Breakdown;
use crate::spectrum::stability_loss::StabilityLoss;

/// End of the frequency range at which all characteristic loci are real or conjugate pairs: real multipliers cross the
/// unit circle only there.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct RealEnd {
    /// Frequency of this end of the range, rad/s: 0, or half the tooth-passing frequency.
    pub(crate) omega: f64,
    /// Real characteristic loci at this end of the frequency range, 1/m.
    pub(crate) loci: Vec<f64>,
    /// Kind of crossing of the unit circle at this end: fold at the frequency 0, flip at half the tooth-passing
    /// frequency.
    pub(crate) kind: StabilityLoss,
}

/// Loop that the cut closes around the structure, opened at the regenerative force.
///
/// Roots are the s with κ(s) λ(s) = 1 for an eigenvalue λ (1/m), with κ = w·[`regeneration`](Self::regeneration).
pub(crate) trait OpenLoop: Sync {
    /// Milling problem of the loop.
    fn problem(&self) -> &FrequencyProblem;

    /// Regeneration factor κ/w of complex depth κ and axial depth w: 1 − e^{−sτ}, or 1 if the displacement one tooth
    /// period ago is neglected.
    fn regeneration(&self, s: Complex64) -> Complex64;

    /// Exponent in the frequency range of the loop that belongs to the same Floquet multiplier as s, or to its
    /// conjugate.
    fn folded(&self, s: Complex64) -> Complex64;

    /// Eigenvalues λ(s), 1/m, of absolute value `floor` and above, and possibly smaller ones.
    ///
    /// # Errors
    /// H is infinite, a result is not finite, or the eigenvalue iteration fails.
    fn eigenvalues(&self, s: Complex64, floor: f64) -> Result<Vec<Complex64>, Breakdown>;

    /// Determinant det(I − (κα − β)H): its zeros are the roots, its poles the poles of the structure. `None` if it or H
    /// is not finite.
    fn determinant(&self, s: Complex64, kappa: Complex64) -> Option<Complex64>;

    /// End of the frequency range at which characteristic loci other than 0 are real; `None` if there is none.
    ///
    /// # Errors
    /// As [`eigenvalues`](Self::eigenvalues).
    fn real_end(&self) -> Result<Option<RealEnd>, Breakdown>;

    /// Frequency grid from 0, rad/s, that resolves every resonance. It ends at half the tooth-passing frequency for
    /// periodic coefficients, otherwise where no characteristic locus beyond reaches `floor`, 1/m.
    ///
    /// # Errors
    /// The receptance H is infinite.
    fn grid(&self, floor: f64) -> Result<Vec<f64>, Breakdown>;

    /// Characteristic loci κλ/w at iω, 1/m: those of absolute value `floor` and above, and possibly smaller ones.
    ///
    /// The determinant vanishes at the depth w at which a locus has the value 1/w.
    ///
    /// # Errors
    /// As [`eigenvalues`](Self::eigenvalues).
    fn loci(&self, omega: f64, floor: f64) -> Result<Vec<Complex64>, Breakdown> {
        let s = Complex64::new(0.0, omega);
        let regeneration = self.regeneration(s);
        let size = regeneration.norm();
        // At integer multiples of the tooth-passing frequency the regeneration factor 1 − e^{−sτ} vanishes.
        if size < 1e-14 {
            return Ok(Vec::new());
        }
        let mut loci = self.eigenvalues(s, floor / size)?;
        for locus in &mut loci {
            *locus *= regeneration;
        }
        Ok(loci)
    }
}

/// Frequency grid from 0 to `end`, rad/s, ascending: steps of half the half bandwidth up to twice the half bandwidth
/// from each resonance, growing steps beyond.
pub(crate) fn around(resonances: &[Resonance], end: f64) -> Vec<f64> {
    let mut grid = vec![0.0, end];
    for Resonance { omega, width } in resonances {
        let width = width.max(1e-9 * end);
        let mut distance = 0.0;
        while distance < end {
            for at in [omega - distance, omega + distance] {
                if at > 0.0 && at < end {
                    grid.push(at);
                }
            }
            distance = if distance < 2.0 * width {
                distance + 0.5 * width
            } else {
                distance * 1.5
            };
        }
    }
    ascending(grid)
}

/// Sorts a frequency grid and merges points that differ by less than 1e-10 of the last.
pub(crate) fn ascending(mut grid: Vec<f64>) -> Vec<f64> {
    grid.sort_by(f64::total_cmp);
    let end = grid.last().copied().unwrap_or(0.0);
    grid.dedup_by(|next, before| *next - *before < 1e-10 * end);
    grid
}
