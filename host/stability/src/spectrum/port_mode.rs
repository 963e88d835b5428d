//! Change of a stability limit or of a multiplier with the receptances, from the Floquet mode and its adjoint at the ports of a period.
//!
//! At a crossing of the unit circle by a multiplier μ = e^{iθ}, with s = ln μ/τ, the cutting forces of the Floquet mode
//! are F(t) = Σ_k F_k e^{s_k t}, s_k = s + 2πik/τ. A change ΔH of the receptances moves the tool by
//!
//!   δu(t) = Σ_k ΔH(s_k) F_k e^{s_k t}.
//!
//! The displacements δp = nᵀδu at the ports of an element change the state at its end by κ T (I − κQ)⁻¹ δp. With the
//! adjoint l at the end of the element the sum over all ports is
//!
//!   lᵀ δΦ r = Σ_k G_kᵀ ΔH(s_k) F_k,   G_k = Σ_ports h n e^{s_k t},   h = κ (I − κQ)⁻ᵀ Tᵀ l,
//!
//! and the depth of the crossing follows as in [`Sensitivity`](crate::Sensitivity).

use std::f64::consts::TAU;

use nalgebra::{DMatrix, Matrix3, Vector3};
use num_complex::Complex64;

use super::crossing::Crossing;
use super::period_parts::PeriodParts;
use crate::problem::linear::Problem;
use crate::problem::period::{Period, Rates};

/// Highest harmonic of the mode that counts, as a multiple of the fastest rate of the structure with cut: the nodes of
/// the mesh resolve it, and the forces and receptances beyond decrease by its third power. A choice.
const TAIL: f64 = 3.0;

/// Floquet mode and adjoint of a crossing at the ports of a tooth period without axial-depth modulation.
pub(crate) struct PortMode {
    crossing: Crossing,
    period_s: f64,
    /// Highest harmonic of the tooth-passing frequency that counts.
    highest: i32,
    ports: Vec<PortOfMode>,
    /// Derivative lᵀΦ_κ r over the complex depth κ, 1/m.
    by_kappa: Complex64,
    /// Inner product lᵀ r of adjoint and mode.
    overlap: Complex64,
}

/// Mode and adjoint at one port.
struct PortOfMode {
    time_s: f64,
    /// Force of the mode times the quadrature weight.
    force: Vector3<Complex64>,
    /// Adjoint h n of a displacement.
    adjoint: Vector3<Complex64>,
}

impl PortMode {
    /// Mode and adjoint of a crossing on the mesh of a tooth period; `None` if an element is singular or they cannot be
    /// computed.
    pub(crate) fn new(problem: &Problem, rpm: f64, period: &Period, crossing: Crossing) -> Option<Self> {
        let Crossing { multiplier, depth_m } = crossing;
        let kappa = (Complex64::ONE - multiplier.inv()) * depth_m;
        let parts = PeriodParts::new(period, multiplier, depth_m)?;
        let (starts, ends) = (parts.starts(multiplier)?, parts.ends(multiplier)?);
        let complex = |matrix: &DMatrix<f64>| matrix.map(Complex64::from);
        let overlap = ends.last()?.dot(starts.first()?);
        let mut adjoint = complex(&period.flight).transpose() * ends.last()?;
        let mut part = ends.len() - 1;
        let (mut ports, mut by_kappa) = (Vec::new(), Complex64::ZERO);
        for (element, of_part) in period.elements.iter().zip(&parts.elements).rev() {
            if of_part.part != part {
                part = of_part.part;
                adjoint.copy_from(&ends[part]);
            }
            let chips = &of_part.chips * &starts[part];
            // The transposed factors solve (I − κQ)ᵀ h = κ Tᵀ l.
            let mut pulled = (complex(&element.drive).transpose() * &adjoint) * kappa;
            let (l, u) = (of_part.implicit.l(), of_part.implicit.u());
            let is_solved =
                u.tr_solve_upper_triangular_mut(&mut pulled) && l.tr_solve_lower_triangular_mut(&mut pulled);
            if !is_solved {
                return None;
            }
            of_part.implicit.p().inv_permute_rows(&mut pulled);
            by_kappa += pulled.dot(&chips) / kappa;
            adjoint = complex(&element.flow).transpose() * &adjoint
                + complex(&element.observe).transpose() * &pulled;
            ports.extend(element.ports.iter().enumerate().map(|(index, port)| PortOfMode {
                time_s: port.time_s,
                force: port.force.map(Complex64::from) * (chips[index] * kappa * port.weight_s),
                adjoint: port.normal.map(Complex64::from) * pulled[index],
            }));
        }
        let period_s = problem.tooth_period_s(rpm);
        let highest = TAIL * Rates::new(problem).at(kappa.norm()) * period_s / TAU;
        Some(Self {
            crossing,
            period_s,
            highest: highest.ceil() as i32 + 1,
            ports,
            by_kappa,
            overlap,
        })
    }

    /// Largest change of the depth of the crossing, m, to first order in a change ΔH(s) of the receptances: the sum of
    /// the absolute changes by each harmonic of the mode. `None` at the tip of an island.
    pub(crate) fn largest_shift_m(&self, change: impl Fn(Complex64) -> Matrix3<Complex64>) -> Option<f64> {
        let sum: f64 = self.shifts_m(change).map(f64::abs).sum();
        sum.is_finite().then_some(sum)
    }

    /// Largest change of the depth of the crossing, m, to first order in changes of the receptances of which only the
    /// sizes |ΔH(s)| are known, m/N: the sum over all harmonics of the mode and all entries, with the phases that add up.
    /// `None` at the tip of an island.
    pub(crate) fn largest_shift_by_sizes_m(&self, sizes: impl Fn(Complex64) -> Matrix3<f64>) -> Option<f64> {
        // The shift is linear in lᵀΦr over the real numbers: that of any phase is at most the root of the squares of those of
        // a real and of an imaginary change.
        let largest = self.shift_m(Complex64::ONE).hypot(self.shift_m(Complex64::I));
        let by_harmonic = self.harmonics().map(|(s, force, adjoint)| {
            let force = force.map(Complex64::norm);
            adjoint.map(Complex64::norm).dot(&(sizes(s) * force))
        });
        let sum = largest * by_harmonic.sum::<f64>();
        sum.is_finite().then_some(sum)
    }

    /// Largest change |δμ| of the multiplier at constant depth, to first order in changes ΔH of the receptances, for which
    /// `change` gives the largest |gᵀΔH(s) f| at s with force f and adjoint g. `None` if the multiplier is not single.
    ///
    /// From Φ_κ r = μ r with κ = (1 − 1/μ) w: δμ = lᵀδΦ r/(lᵀr − w/μ² lᵀΦ_κ' r).
    pub(crate) fn largest_change_of_multiplier(
        &self,
        change: impl Fn(Complex64, &Vector3<Complex64>, &Vector3<Complex64>) -> f64,
    ) -> Option<f64> {
        let Crossing { multiplier, depth_m } = self.crossing;
        let sum: f64 = self
            .harmonics()
            .map(|(s, force, adjoint)| change(s, &force, &adjoint))
            .sum();
        let change = sum / (self.overlap - self.by_kappa * depth_m / (multiplier * multiplier)).norm();
        change.is_finite().then_some(change)
    }

    /// Change of the depth of the crossing, m, to first order in a change ΔH(s) of the receptances at each harmonic of
    /// the mode.
    fn shifts_m(&self, change: impl Fn(Complex64) -> Matrix3<Complex64>) -> impl Iterator<Item = f64> {
        self.harmonics()
            .map(move |(s, force, adjoint)| self.shift_m((adjoint.transpose() * change(s) * force)[(0, 0)]))
    }

    /// For each harmonic of the mode its s, rad/s, and the amplitudes of force and adjoint.
    fn harmonics(&self) -> impl Iterator<Item = (Complex64, Vector3<Complex64>, Vector3<Complex64>)> {
        let growth = self.crossing.multiplier.ln();
        (-self.highest..=self.highest).map(move |k| {
            let s = (growth + Complex64::new(0.0, TAU * f64::from(k))) / self.period_s;
            let (mut force, mut adjoint) = (Vector3::zeros(), Vector3::zeros());
            for port in &self.ports {
                let factor = (s * port.time_s).exp();
                force += port.force * (factor.inv() / self.period_s);
                adjoint += port.adjoint * factor;
            }
            (s, force, adjoint)
        })
    }

    /// Change of the depth of the crossing, m, with a change `by` of lᵀΦr.
    fn shift_m(&self, by: Complex64) -> f64 {
        let Crossing { multiplier, depth_m } = self.crossing;
        let by_depth = self.by_kappa * (Complex64::ONE - multiplier.inv());
        if multiplier.im == 0.0 {
            return -(by / by_depth).re;
        }
        let by_angle = (self.by_kappa * depth_m / multiplier - multiplier * self.overlap) * Complex64::I;
        let determinant = by_depth.re * by_angle.im - by_depth.im * by_angle.re;
        -(by.re * by_angle.im - by.im * by_angle.re) / determinant
    }
}

#[cfg(test)]
mod tests;
