//! Cell charts: the dominant multiplier over a grid of speeds and depths, by any method.

use rayon::prelude::*;
use serde::Serialize;

use super::method::{Label, Method};
use crate::error::StabilityError;
use crate::spectrum::verdict::Verdict;

/// The cells at one speed, by depth.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct CellLine {
    /// Spindle speed, rev/min.
    pub rpm: f64,
    /// Absolute value of the dominant multiplier.
    pub multiplier_abs: Vec<f64>,
    /// An estimate of the error of the multiplier.
    pub error: Vec<f64>,
    /// What follows.
    pub verdict: Vec<Verdict>,
}

/// A grid of cells.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct CellChart {
    /// The method that computed it.
    #[serde(flatten)]
    pub label: Label,
    /// The axial depths, mm, in the order asked for.
    pub depths_mm: Vec<f64>,
    /// The cells at each speed, in the order asked for.
    pub speeds: Vec<CellLine>,
}

/// The dominant multiplier at every speed and depth, in parallel over speeds.
///
/// The result does not depend on the number of threads.
///
/// # Errors
/// Those of [`Method::cells`], of the first speed that fails.
pub fn cell_chart<M: Method + ?Sized>(
    method: &M,
    speeds_rpm: &[f64],
    depths_mm: &[f64],
) -> Result<CellChart, StabilityError> {
    let lines: Vec<Result<CellLine, StabilityError>> = speeds_rpm
        .par_iter()
        .map(|&rpm| {
            let cells = method.cells(rpm, depths_mm)?;
            Ok(CellLine {
                rpm,
                multiplier_abs: cells.iter().map(|cell| cell.multiplier_abs).collect(),
                error: cells.iter().map(|cell| cell.error).collect(),
                verdict: cells.iter().map(|cell| cell.verdict).collect(),
            })
        })
        .collect();
    Ok(CellChart {
        label: Label::of(method),
        depths_mm: depths_mm.to_vec(),
        speeds: lines.into_iter().collect::<Result<_, _>>()?,
    })
}
