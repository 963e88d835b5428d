//! What all loops have in common, whatever coefficients they are made of.

use num_complex::Complex64;

use super::problem::{FrequencyProblem, Resonance};
use crate::spectrum::stability_loss::StabilityLoss;

/// Where all loci are real or in conjugate pairs: multipliers cross there alone.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct RealEnd {
    /// Frequency, rad/s: 0, or half the tooth-passing frequency.
    pub(crate) omega: f64,
    /// The real loci there, 1/m.
    pub(crate) loci: Vec<f64>,
    /// What crosses: fold at 0, flip at the other.
    pub(crate) kind: StabilityLoss,
}

/// The loop that the cut closes around the structure, opened at the regenerative force.
///
/// Roots are the s with κ(s) λ(s) = 1 for an eigenvalue λ, 1/m, where κ = w·[`regeneration`](Self::regeneration).
pub(crate) trait OpenLoop: Sync {
    /// The problem it is made of.
    fn problem(&self) -> &FrequencyProblem;

    /// κ/w: 1 − e^{−sτ}, or 1 where the displacement one tooth period ago is neglected.
    fn regeneration(&self, s: Complex64) -> Complex64;

    /// The same motion in the frequencies that the loop is made for.
    fn folded(&self, s: Complex64) -> Complex64;

    /// The eigenvalues λ(s), 1/m, of absolute value `floor` and above, and possibly smaller ones.
    ///
    /// `None` where H is infinite, or nothing finite comes out.
    fn eigenvalues(&self, s: Complex64, floor: f64) -> Option<Vec<Complex64>>;

    /// det(I − (κα − β)H), which is zero at roots and infinite at poles of the structure only.
    fn determinant(&self, s: Complex64, kappa: Complex64) -> Option<Complex64>;

    /// The end of the frequencies where loci are real, if they are at one of the ends.
    fn real_end(&self) -> Option<RealEnd>;

    /// Frequencies from 0 up, rad/s, that leave no resonance between them unseen and beyond which no locus is as large as
    /// `floor`, 1/m.
    fn grid(&self, floor: f64) -> Option<Vec<f64>>;

    /// The characteristic loci κλ/w at iω, 1/m: those of absolute value `floor` and above, and possibly smaller ones.
    ///
    /// The determinant vanishes at the depth w where a locus has the value 1/w.
    fn loci(&self, omega: f64, floor: f64) -> Option<Vec<Complex64>> {
        let s = Complex64::new(0.0, omega);
        let regeneration = self.regeneration(s);
        let size = regeneration.norm();
        // Nothing regenerates at whole multiples of the tooth-passing frequency.
        if size < 1e-14 {
            return Some(Vec::new());
        }
        let mut loci = self.eigenvalues(s, floor / size)?;
        for locus in &mut loci {
            *locus *= regeneration;
        }
        Some(loci)
    }
}

/// Points about resonances up to `end`, ascending, with 0 and `end`: dense within the width, then ever wider apart.
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

/// Sorted, without points that rounding alone tells apart.
pub(crate) fn ascending(mut grid: Vec<f64>) -> Vec<f64> {
    grid.sort_by(f64::total_cmp);
    let end = grid.last().copied().unwrap_or(0.0);
    grid.dedup_by(|next, before| *next - *before < 1e-10 * end);
    grid
}
