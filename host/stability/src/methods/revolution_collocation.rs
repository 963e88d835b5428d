//! The default method for tools with variable pitch: collocation of the map over one revolution.

use std::rc::Rc;

use num_complex::Complex64;

use crate::criteria::{LEAST_ERROR, MESH_ROOM};
use crate::error::{Breakdown, NO_DOMINANT, NO_FINER, StabilityError};
use crate::limits::bounds::{check_depth, check_speed};
use crate::limits::line::line_of;
use crate::limits::method::Method;
use crate::limits::point::CutStability;
use crate::limits::speed_line::SpeedLine;
use crate::problem::pitched::Pitched;
use crate::problem::revolution::Revolution;
use crate::problem::revolution_mesh::Fineness;
use crate::spectrum::krylov::Dominant;
use crate::spectrum::map_spectrum::{self, MapSpectrum, PeriodMap};
use crate::spectrum::revolution_map::RevolutionMap;

/// Collocation over the period of `pitched`: the revolution for unequal pitch.
///
/// Floquet multipliers are those over this period. If it is the revolution of N teeth with equal pitch, they are the
/// N-th powers of those over the tooth period; Hopf, flip and fold then refer to the revolution.
#[derive(Clone, Debug, PartialEq)]
pub struct RevolutionCollocation {
    /// Milling problem of the method, with equal or unequal pitch.
    pub pitched: Pitched,
}

impl RevolutionCollocation {
    /// Error of the multiplier at a limit: the [`error`] from its change to the nearest multiplier on the finer mesh.
    fn limit_error(&self, rpm: f64, depth_m: f64, multiplier: Complex64) -> Result<f64, StabilityError> {
        let depth_mm = depth_m * 1e3;
        let broke_down = |cause: Breakdown| cause.at(rpm, depth_mm, NO_DOMINANT);
        let finer = Revolution::new(&self.pitched, rpm, depth_m, Fineness::FINE)
            .and_then(|finer| RevolutionMap::new(Rc::new(finer), depth_m))
            .ok_or_else(|| broke_down(Breakdown::NoSolution))?;
        let finer = Dominant::any(&finer).map_err(broke_down)?;
        let nearest =
            map_spectrum::nearest(&finer.eigenvalues, multiplier).ok_or(StabilityError::BrokeDown {
                rpm,
                depth_mm,
                what: NO_FINER,
            })?;
        Ok(error(multiplier, nearest))
    }
}

impl Method for RevolutionCollocation {
    fn name(&self) -> &'static str {
        "collocation over the revolution"
    }

    fn point(&self, rpm: f64, depth_mm: f64) -> Result<CutStability, StabilityError> {
        check_speed(rpm)?;
        check_depth(depth_mm)?;
        let depth_m = depth_mm * 1e-3;
        let broke_down = |cause: Breakdown| cause.at(rpm, depth_mm, NO_DOMINANT);
        let no_solution = || broke_down(Breakdown::NoSolution);
        let map = |fineness| {
            let revolution = Revolution::new(&self.pitched, rpm, depth_m, fineness)?;
            RevolutionMap::new(Rc::new(revolution), depth_m)
        };
        let coarse = map(Fineness::WORKING).ok_or_else(no_solution)?;
        let coarse = Dominant::any(&coarse).map_err(broke_down)?;
        let coarse = *coarse.eigenvalues.first().ok_or_else(no_solution)?;
        let fine = map(Fineness::FINE).ok_or_else(no_solution)?;
        let dominant = Dominant::any(&fine).map_err(broke_down)?;
        let distance = |value: &Complex64| (value - coarse).norm();
        let values = dominant.eigenvalues.iter().copied();
        let multiplier = values
            .min_by(|p, q| distance(p).total_cmp(&distance(q)))
            .ok_or_else(no_solution)?;
        let chatter_hz = dominant
            .vector(multiplier)
            .and_then(|vector| fine.chatter_hz(multiplier, &vector));
        let error = error(coarse, multiplier);
        Ok(CutStability::new(rpm, depth_mm, multiplier, error, chatter_hz))
    }

    fn line(&self, rpm: f64, depth_mm: f64, samples: usize) -> Result<SpeedLine, StabilityError> {
        line_of(rpm, depth_mm, samples, |deepest_m| {
            let revolution = Revolution::new(&self.pitched, rpm, deepest_m, Fineness::WORKING).map(Rc::new);
            MapSpectrum::new(
                deepest_m,
                move |depth_m| RevolutionMap::new(revolution.clone()?, depth_m),
                |multiplier, depth_m| self.limit_error(rpm, depth_m, multiplier),
            )
        })
    }
}

/// Error estimate of a multiplier on either mesh: [`MESH_ROOM`] times the change from the coarse to the fine mesh, and
/// at least [`LEAST_ERROR`] × max(1, |μ|). The coarse mesh errs by far more than the fine one, so that the change is
/// about its error and bounds that of the fine one.
fn error(coarse: Complex64, fine: Complex64) -> f64 {
    (MESH_ROOM * (coarse - fine).norm()).max(LEAST_ERROR * fine.norm().max(1.0))
}
