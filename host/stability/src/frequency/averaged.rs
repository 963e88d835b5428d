//! Loop of cut and structure with directional coefficients averaged over a tooth period: one frequency, no dependence
//! on the immersion angle (thesis eqs 3.8–3.12).

use nalgebra::{DMatrix, Matrix3, Vector3};
use num_complex::Complex64;

use super::open_loop::{OpenLoop, RealEnd, around, ascending};
use super::problem::FrequencyProblem;
use crate::error::{Breakdown, NOT_FINITE, StabilityError};
use crate::spectrum::stability_loss::StabilityLoss;
use quietcut_numerics::eigenvalues;

/// Open loop of the averaged cut: u = H (κ α₀ − β₀) u, with the averages α₀ (times K_tc) and β₀ = β_e + β_f over a
/// tooth period.
///
/// β₀ does not depend on the depth. With H̃ = (I + H β₀)⁻¹ H, u = κ H̃ α₀ u, and the eigenvalues of H̃ α₀ determine the
/// limits. Only displacements that change the chip thickness enter the eigenvalue problem.
pub(crate) struct AveragedLoop<'a> {
    problem: &'a FrequencyProblem,
    /// Regenerative delay, s; `None` if the displacement one tooth period ago is neglected.
    delay_s: Option<f64>,
    /// Averaged directional coefficients K_tc α₀ of the cut, Pa.
    directional: Matrix3<f64>,
    /// Axial (z) column of β₀, the averaged coefficients of edge and feed forces, N/m; zero without axial-depth
    /// modulation.
    forced: Vector3<f64>,
    /// Indices of the directions (0 feed, 1 normal, 2 axial) in which the tool moves and changes the chip thickness,
    /// ascending.
    axes: Vec<usize>,
}

impl<'a> AveragedLoop<'a> {
    /// Open loop with averaged coefficients at a spindle speed in rev/min; without regeneration if the speed is `None`.
    pub(crate) fn new(problem: &'a FrequencyProblem, rpm: Option<f64>) -> Self {
        let process = &problem.process;
        let averaged = process
            .force
            .averaged(&process.engagement, process.feed_per_tooth_m);
        let moves = problem.moves();
        let is_seen =
            |axis: usize| averaged.directional.column(axis).amax() > 1e-14 * averaged.directional.amax();
        Self {
            problem,
            delay_s: rpm.map(|rpm| problem.tooth_period_s(rpm)),
            directional: averaged.directional,
            forced: if process.axial_depth_modulation {
                averaged.forced
            } else {
                Vector3::zeros()
            },
            axes: (0..3).filter(|&axis| moves[axis] && is_seen(axis)).collect(),
        }
    }

    /// Refuses depths at which a table of receptances ends while the loop gain is still 1 or more.
    ///
    /// Beyond its last line a table is extrapolated as inertia. Instability there can be excluded only if the loop gain
    /// is already below 1 at the last line. A mode above the table remains undetected, however small the gain.
    ///
    /// # Errors
    /// The gain at the last line, with the displacement and its past in opposite phase, is 1 or more at that depth, or
    /// cannot be computed.
    pub(crate) fn check_reach(
        problem: &FrequencyProblem,
        rpm: f64,
        depth_mm: f64,
    ) -> Result<(), StabilityError> {
        let Some((_, last_hz)) = problem.band_hz() else {
            return Ok(());
        };
        let last = Complex64::new(0.0, std::f64::consts::TAU * last_hz);
        let loci = AveragedLoop::new(problem, None)
            .eigenvalues(last, 0.0)
            .map_err(|cause| cause.at(rpm, depth_mm, NOT_FINITE))?;
        let largest = loci.iter().map(|locus| locus.norm()).fold(0.0, f64::max);
        let deepest_mm = 1e3 / (2.0 * largest);
        if depth_mm < deepest_mm {
            return Ok(());
        }
        Err(StabilityError::EndsEarly {
            depth_mm,
            deepest_mm,
            last_hz,
        })
    }

    /// Determinant det(I + Hβ₀) of receptances H and averaged edge and feed coefficients β₀. It is 1 + (Hβ₀)_zz, since
    /// only the axial column of β₀ differs from zero.
    fn modulation(&self, h: &Matrix3<Complex64>) -> Complex64 {
        Complex64::ONE + (h.row(2) * self.forced.map(Complex64::from))[0]
    }

    /// Loop matrix H̃ α₀ at a complex exponent s, with H̃ = (I + H β₀)⁻¹ H from the Sherman–Morrison formula; `None` if
    /// s is a pole of the modelled structure.
    fn matrix(&self, s: Complex64) -> Option<Matrix3<Complex64>> {
        let h = self.problem.transfer(s)?;
        let change = h * self.forced.map(Complex64::from) * h.row(2);
        let folded = h - change / self.modulation(&h);
        Some(folded * self.directional.map(Complex64::from))
    }
}

impl OpenLoop for AveragedLoop<'_> {
    fn problem(&self) -> &FrequencyProblem {
        self.problem
    }

    fn regeneration(&self, s: Complex64) -> Complex64 {
        self.delay_s
            .map_or(Complex64::ONE, |delay_s| Complex64::ONE - (-s * delay_s).exp())
    }

    fn folded(&self, s: Complex64) -> Complex64 {
        s
    }

    fn eigenvalues(&self, s: Complex64, _floor: f64) -> Result<Vec<Complex64>, Breakdown> {
        let matrix = self.matrix(s).ok_or(Breakdown::NoSolution)?;
        let seen = DMatrix::from_fn(self.axes.len(), self.axes.len(), |i, j| {
            matrix[(self.axes[i], self.axes[j])]
        });
        Ok(eigenvalues::of_complex(seen)?)
    }

    fn determinant(&self, s: Complex64, kappa: Complex64) -> Option<Complex64> {
        let mut cut = self.directional.map(|entry| kappa * entry);
        for axis in 0..3 {
            cut[(axis, 2)] -= self.forced[axis];
        }
        let determinant = (Matrix3::identity() - cut * self.problem.transfer(s)?).determinant();
        determinant.is_finite().then_some(determinant)
    }

    fn real_end(&self) -> Result<Option<RealEnd>, Breakdown> {
        // At ω = 0 the characteristic loci with regeneration are 0. Without regeneration they are the eigenvalues of H̃
        // α₀ at ω = 0, a real matrix: real, or in conjugate pairs that belong to no fold.
        if self.delay_s.is_some() {
            return Ok(None);
        }
        let loci = self.eigenvalues(Complex64::ZERO, 0.0)?;
        let real = loci.iter().filter(|locus| locus.im.abs() <= 1e-9 * locus.norm());
        Ok(Some(RealEnd {
            omega: 0.0,
            loci: real.map(|locus| locus.re).collect(),
            kind: StabilityLoss::Fold,
        }))
    }

    fn grid(&self, floor: f64) -> Result<Vec<f64>, Breakdown> {
        let resonances = self.problem.resonances();
        let fastest = resonances
            .iter()
            .map(|resonance| resonance.omega.hypot(resonance.width))
            .fold(0.0, f64::max);
        let lines = self.problem.lines();
        let mut end = lines.last().copied().unwrap_or(0.0).max(1.5 * fastest);
        let size = |omega: f64| -> Result<f64, Breakdown> {
            let matrix = self.matrix(Complex64::new(0.0, omega));
            Ok(2.0 * matrix.ok_or(Breakdown::NoSolution)?.norm())
        };
        // Above all resonances the characteristic loci decrease with the frequency: the grid ends where they fall below
        // the floor.
        while end > 0.0 && size(end)? >= floor {
            end *= 1.4;
        }
        let mut grid = around(&resonances, end);
        grid.extend(lines.into_iter().filter(|&line| line < end));
        if let Some(delay_s) = self.delay_s {
            // The regeneration factor rotates the characteristic locus by ωτ/2: the grid has at least six steps for
            // each revolution of it.
            let steps = (end * delay_s * 3.0 / std::f64::consts::TAU).ceil();
            grid.extend((1..steps as usize).map(|i| end * i as f64 / steps));
        }
        Ok(ascending(grid))
    }
}
