//! Methods that divide the period into a given number of time steps. The error of a Floquet multiplier
//! (characteristic multiplier) is estimated from finer steps.

use num_complex::Complex64;

use super::step_error::step_error;
use super::stepped::{Mesh, Stepped};
use crate::criteria::STEP_ROUNDING;
use crate::error::{Breakdown, StabilityError};
use crate::limits::bounds::{check_depth, check_speed};
use crate::limits::line::line_of;
use crate::limits::method::Method;
use crate::limits::point::CutStability;
use crate::limits::speed_line::SpeedLine;
use crate::problem::pitched::Pitched;
use crate::spectrum::krylov::Dominant;
use crate::spectrum::map_spectrum::{MapSpectrum, PeriodMap};

/// Scheme of one time step, such as semi-discretization.
pub(crate) trait Discretization: Sync {
    /// Name of the method that uses this scheme, as stated in results.
    fn name(&self) -> &'static str;

    /// Order p of convergence: the error of multipliers falls with the p-th power of the step.
    fn order(&self) -> u32;

    /// Map of the delayed state over one period at an axial depth, m; `None` if the equations of a step are singular.
    fn map<'a>(&self, pitched: &'a Pitched, mesh: &'a Mesh, depth_m: f64) -> Option<Stepped<'a>>;
}

/// Stability method that steps through the period with a given number of time steps, applied to a problem.
#[derive(Clone, Debug, PartialEq)]
pub struct Discretized<D> {
    /// Milling problem of the method, with equal or unequal pitch.
    pub pitched: Pitched,
    /// Scheme of one time step.
    pub discretization: D,
    /// Number of time steps per tooth period; 0 counts as 1. Entries and exits of teeth, and a delay shorter than a
    /// step, make steps shorter.
    pub steps: usize,
}

/// Applies `evaluate` to the dominant Floquet multipliers of the period map with `steps` steps per tooth period.
pub(crate) fn with_dominant<D: Discretization, T>(
    method: &Discretized<D>,
    rpm: f64,
    depth_mm: f64,
    steps: usize,
    evaluate: impl FnOnce(&Dominant, &Stepped) -> Option<T>,
) -> Result<T, StabilityError> {
    let mesh = Mesh::new(&method.pitched, rpm, steps);
    let broke_down =
        |cause: Breakdown| cause.at(rpm, depth_mm, "the steps of the period have no finite solution");
    let no_solution = || broke_down(Breakdown::NoSolution);
    let map = method
        .discretization
        .map(&method.pitched, &mesh, depth_mm * 1e-3)
        .ok_or_else(no_solution)?;
    let dominant = Dominant::any(&map).map_err(broke_down)?;
    evaluate(&dominant, &map).ok_or_else(no_solution)
}

#[expect(private_bounds, reason = "sealed: discretizations are those of this module")]
impl<D: Discretization> Discretized<D> {
    /// Dominant Floquet multiplier with the configured number of steps, without an error estimate; costs about a
    /// seventh of [`point()`](Method::point).
    ///
    /// # Errors
    /// As [`Method::point`].
    pub fn multiplier(&self, rpm: f64, depth_mm: f64) -> Result<Complex64, StabilityError> {
        check_speed(rpm)?;
        check_depth(depth_mm)?;
        with_dominant(self, rpm, depth_mm, self.steps, |dominant, _| {
            dominant.eigenvalues.first().copied()
        })
    }

    /// Error of a multiplier computed with the configured number of steps, from the nearest multipliers with twice and
    /// four times as many steps.
    fn error(&self, rpm: f64, depth_mm: f64, multiplier: Complex64) -> Result<f64, StabilityError> {
        let finer = |times: usize| {
            with_dominant(self, rpm, depth_mm, times * self.steps, |dominant, _| {
                let distance = |value: &Complex64| (value - multiplier).norm();
                let values = dominant.eigenvalues.iter().copied();
                values.min_by(|p, q| distance(p).total_cmp(&distance(q)))
            })
        };
        let order = self.discretization.order();
        Ok(step_error(multiplier, finer(2)?, finer(4)?, order, STEP_ROUNDING))
    }
}

impl<D: Discretization> Method for Discretized<D> {
    fn name(&self) -> &'static str {
        self.discretization.name()
    }

    fn settings(&self) -> Option<String> {
        let order = self.discretization.order();
        Some(format!(
            "{} steps per tooth period, error of order {order} in the step",
            self.steps
        ))
    }

    /// Computes the dominant multiplier with the configured number of steps, and its error from the results with twice
    /// and four times as many.
    fn point(&self, rpm: f64, depth_mm: f64) -> Result<CutStability, StabilityError> {
        check_speed(rpm)?;
        check_depth(depth_mm)?;
        let (multiplier, chatter_hz) = with_dominant(self, rpm, depth_mm, self.steps, |dominant, map| {
            let multiplier = *dominant.eigenvalues.first()?;
            let chatter_hz = dominant
                .vector(multiplier)
                .and_then(|vector| map.chatter_hz(multiplier, &vector));
            Some((multiplier, chatter_hz))
        })?;
        let error = self.error(rpm, depth_mm, multiplier)?;
        Ok(CutStability::new(rpm, depth_mm, multiplier, error, chatter_hz))
    }

    /// Computes limits with the configured number of steps; their errors follow from those of the multipliers.
    fn line(&self, rpm: f64, depth_mm: f64, samples: usize) -> Result<SpeedLine, StabilityError> {
        check_speed(rpm)?;
        let mesh = Mesh::new(&self.pitched, rpm, self.steps);
        line_of(rpm, depth_mm, samples, |deepest_m| {
            MapSpectrum::new(
                deepest_m,
                |depth_m| self.discretization.map(&self.pitched, &mesh, depth_m),
                |multiplier, depth_m| self.error(rpm, depth_m * 1e3, multiplier),
            )
        })
    }
}
