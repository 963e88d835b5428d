//! The default method: collocation of the map over one tooth period.

use crate::error::StabilityError;
use crate::limits::cell::Cell;
use crate::limits::cells::cells_of;
use crate::limits::line::line;
use crate::limits::method::Method;
use crate::limits::point::{CutStability, point};
use crate::limits::speed_line::SpeedLine;
use crate::problem::linear::Problem;
use crate::problem::period::check_length;
use crate::spectrum::collocated::Collocated;

/// Collocation over one tooth period; limits and Floquet multipliers (characteristic multipliers) are refined with the
/// characteristic matrix. The default method.
#[derive(Clone, Debug, PartialEq)]
pub struct Collocation {
    /// Milling problem with equal pitch.
    pub problem: Problem,
}

impl Method for Collocation {
    fn name(&self) -> &'static str {
        "collocation"
    }

    fn point(&self, rpm: f64, depth_mm: f64) -> Result<CutStability, StabilityError> {
        point(&self.problem, rpm, depth_mm)
    }

    fn line(&self, rpm: f64, depth_mm: f64, samples: usize) -> Result<SpeedLine, StabilityError> {
        line(&self.problem, rpm, depth_mm, samples)
    }

    fn cells(&self, rpm: f64, depths_mm: &[f64]) -> Result<Vec<Cell>, StabilityError> {
        let deepest_mm = depths_mm.iter().copied().fold(0.0, f64::max);
        check_length(&self.problem, rpm, deepest_mm)?;
        cells_of(rpm, depths_mm, |deepest_m| {
            Collocated::new(&self.problem, rpm, deepest_m)
        })
    }
}
