//! The dominant multiplier of one cell of a chart.

use super::point::CutStability;
use crate::criteria::LEAST_ERROR;
use crate::spectrum::verdict::Verdict;

/// The dominant multiplier at one speed and depth.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cell {
    /// Its absolute value.
    pub multiplier_abs: f64,
    /// An estimate of its error.
    pub error: f64,
    /// What follows.
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

    /// A multiplier from the characteristic matrix.
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
