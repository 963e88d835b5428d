//! The zeroth-order approximation (Altintas & Budak 1995): averaged coefficients, and limits in closed form.

use std::f64::consts::{PI, TAU};

use num_complex::Complex64;
use rayon::prelude::*;

use crate::criteria::ZOA_BEND;
use crate::error::{Breakdown, NOT_FINITE, StabilityError};
use crate::frequency::averaged::AveragedLoop;
use crate::frequency::limits::{AxisCrossing, hertz, speed_line};
use crate::frequency::loci::{LocusPoint, Sample, Step, solve_steps, trace, zero};
use crate::frequency::open_loop::OpenLoop;
use crate::frequency::problem::FrequencyProblem;
use crate::frequency::root;
use crate::limits::bounds::{check_depth, check_speed};
use crate::limits::method::Method;
use crate::limits::point::CutStability;
use crate::limits::speed_line::SpeedLine;
use crate::spectrum::stability_loss::StabilityLoss;

/// Tolerance, rad, to which the phase condition ωτ = π − 2 arg(1/λ) + 2πk is solved; depths have about the same
/// relative error.
const CLOSED: f64 = 1e-11;

/// Zeroth-order approximation on modelled or measured receptances.
///
/// At a chatter frequency ω each eigenvalue λ of H̃ α₀ with Re(1/λ) > 0 gives one depth, w = |1/λ|²/(2 Re(1/λ)), and
/// one speed for every lobe k: ωτ = π − 2 arg(1/λ) + 2πk. All eigenvalues are used, in two directions or three; edge
/// and feed terms (thesis eqs 3.6–3.12) are in H̃. At a given speed the chatter frequencies are those that fulfil the
/// phase condition for some k. The eigenvalues do not depend on the speed and are traced along the frequency once per
/// chart.
///
/// The approximation is exact for the averaged cut; for the periodic one it neglects the harmonics of the coefficients,
/// and with them flips.
#[derive(Clone, Debug)]
pub struct Zoa {
    /// Receptances and cutting process.
    pub problem: FrequencyProblem,
}

impl Zoa {
    /// Eigenvalues of H̃ α₀ at all frequencies at which a limit may lie, up to an axial depth in m.
    fn samples(&self, depth_m: f64) -> Result<Vec<Sample>, Breakdown> {
        let open_loop = AveragedLoop::new(&self.problem, None);
        // |1 − e^{−iωτ}| is at most 2, so that a limit requires |λ| ≥ 1/(2 w).
        let floor = 0.5 / depth_m;
        let grid = open_loop.grid(2.0 * floor)?;
        trace(
            &|omega| open_loop.eigenvalues(Complex64::new(0.0, omega), floor),
            &grid,
            floor,
            ZOA_BEND,
        )
    }

    /// The same method with every second line of its table of receptances and the last one only; `None` for a modelled
    /// structure, or if too few lines remain.
    fn thinned(&self) -> Option<Self> {
        let problem = self.problem.thinned()?;
        Some(Self { problem })
    }

    /// Limits at one spindle speed. `samples` are eigenvalues of this method, `others` thinned tables with their
    /// eigenvalues, from which errors are estimated.
    fn line_of(
        &self,
        samples: &[Sample],
        others: &[(Self, Vec<Sample>)],
        rpm: f64,
        depth_mm: f64,
    ) -> Result<SpeedLine, StabilityError> {
        check_speed(rpm)?;
        let delay_s = self.problem.tooth_period_s(rpm);
        let find = |zoa: &Self, samples: &[Sample]| {
            zoa.limits(samples, delay_s, depth_mm * 1e-3)
                .map_err(|cause| cause.at(rpm, depth_mm, NOT_FINITE))
        };
        let others: Vec<Vec<AxisCrossing>> = others
            .iter()
            .map(|(zoa, samples)| find(zoa, samples))
            .collect::<Result<_, _>>()?;
        let open_loop = AveragedLoop::new(&self.problem, Some(rpm));
        speed_line(&open_loop, rpm, depth_mm, &find(self, samples)?, &others, hertz)
    }

    /// All limits of the averaged cut with a tooth period `delay_s` (s), up to an axial depth in m.
    fn limits(&self, samples: &[Sample], delay_s: f64, depth_m: f64) -> Result<Vec<AxisCrossing>, Breakdown> {
        let open_loop = AveragedLoop::new(&self.problem, None);
        let loci = |omega: f64| open_loop.eigenvalues(Complex64::new(0.0, omega), 0.0);
        let mut limits = solve_steps(&loci, samples, &|[(low, from), (high, to)]: Step| {
            let mut limits = Vec::new();
            // A limit requires Re λ > 0, and a limit within the depth w requires |λ| ≥ 1/(2 w); the factor 0.45 leaves
            // a margin.
            if from.re.max(to.re) <= 0.0 || from.norm().max(to.norm()) < 0.45 / depth_m {
                return Some(limits);
            }
            let start = phase(low, from, delay_s);
            // The phase mismatch is continuous along the locus of the eigenvalue, independent of the branch of the
            // argument.
            let end = start + (high - low) * delay_s + 2.0 * (from / to).arg();
            let (least, most) = (start.min(end), start.max(end));
            let mut lobe = (least / TAU).ceil() * TAU;
            while lobe < most {
                let mark = |omega, value, phase: f64| LocusPoint {
                    omega,
                    value,
                    miss: phase - lobe,
                };
                let (omega, value) = zero(mark(low, from, start), mark(high, to, end), CLOSED, |omega| {
                    let with_miss = loci(omega).ok()?.into_iter().map(|value| {
                        let miss = phase(omega, value, delay_s) - lobe;
                        (value, miss - (miss / TAU).round() * TAU)
                    });
                    Some(with_miss.collect())
                })?;
                lobe += TAU;
                let inverse = value.inv();
                let limit_m = inverse.norm_sqr() / (2.0 * inverse.re);
                if inverse.re > 0.0 && limit_m <= depth_m {
                    limits.push(AxisCrossing {
                        depth_m: limit_m,
                        omega,
                        kind: StabilityLoss::Hopf,
                        outward: end > start,
                    });
                }
            }
            Some(limits)
        })?;
        limits.sort_by(|a, b| a.depth_m.total_cmp(&b.depth_m));
        Ok(limits)
    }
}

/// Phase mismatch ωτ − π + 2 arg(1/λ), rad: a multiple of 2π at a limit.
fn phase(omega: f64, eigenvalue: Complex64, delay_s: f64) -> f64 {
    omega * delay_s - PI + 2.0 * eigenvalue.inv().arg()
}

impl Method for Zoa {
    fn name(&self) -> &'static str {
        "zoa"
    }

    fn blind_to(&self) -> Option<&'static str> {
        Some("flips: averaged coefficients")
    }

    fn point(&self, rpm: f64, depth_mm: f64) -> Result<CutStability, StabilityError> {
        check_speed(rpm)?;
        check_depth(depth_mm)?;
        AveragedLoop::check_reach(&self.problem, rpm, depth_mm)?;
        root::averaged_point(&self.problem, rpm, depth_mm, |problem| {
            AveragedLoop::new(problem, Some(rpm))
        })
    }

    fn line(&self, rpm: f64, depth_mm: f64, samples: usize) -> Result<SpeedLine, StabilityError> {
        let mut lines = self.lines(&[rpm], depth_mm, samples)?;
        lines.pop().ok_or(StabilityError::BrokeDown {
            rpm,
            depth_mm,
            what: "no line came out",
        })
    }

    fn lines(
        &self,
        speeds_rpm: &[f64],
        depth_mm: f64,
        _samples: usize,
    ) -> Result<Vec<SpeedLine>, StabilityError> {
        check_depth(depth_mm)?;
        let rpm = speeds_rpm.first().copied().unwrap_or_default();
        AveragedLoop::check_reach(&self.problem, rpm, depth_mm)?;
        let find = |zoa: &Self| {
            let samples = zoa.samples(depth_mm * 1e-3);
            samples.map_err(|cause| cause.at(rpm, depth_mm, NOT_FINITE))
        };
        let samples = find(self)?;
        let others = self.thinned().map(|zoa| {
            let samples = find(&zoa)?;
            Ok((zoa, samples))
        });
        let others: Vec<(Self, Vec<Sample>)> = others.into_iter().collect::<Result<_, StabilityError>>()?;
        let lines: Vec<Result<SpeedLine, StabilityError>> = speeds_rpm
            .par_iter()
            .map(|&rpm| self.line_of(&samples, &others, rpm, depth_mm))
            .collect();
        lines.into_iter().collect()
    }
}
