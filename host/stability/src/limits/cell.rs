//! The dominant Floquet multiplier (characteristic multiplier) of one cell of a chart.

use super::point::CutStability;
use crate::criteria::LEAST_ERROR;
use crate::spectrum::verdict::Verdict;

/// Dominant Floquet multiplier at one spindle speed and axial depth.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cell {
    /// Absolute value |μ| of the dominant multiplier of the cut.
    pub multiplier_abs: f64,
    /// Error estimate of |μ|.
    pub error: f64,
    /// Verdict on the cut from |μ| and its error.
    pub verdict: Verdict,
}

impl Cell {
    pub(super) fn new(multiplier_abs: f64, error: f64) -> Self {
        Self {
            multiplier_abs,
            error,
            verdict: Verdict::of(multiplier_abs, error),
        }
    }

    /// Cell from a multiplier that Newton's method on the characteristic matrix confirmed, with the error
    /// [`LEAST_ERROR`] × max(1, |μ|).
    pub(super) fn exact(multiplier_abs: f64) -> Self {
        Self::new(multiplier_abs, LEAST_ERROR * multiplier_abs.max(1.0))
    }
}

impl From<&CutStability> for Cell {
    fn from(point: &CutStability) -> Self {
        Self {
            multiplier_abs: point.multiplier_abs,
            error: point.error,
            verdict: point.verdict,
        }
    }
}
