//! Cell charts: the dominant Floquet multiplier (characteristic multiplier) over a grid of speeds and depths, by any
//! method.

use rayon::prelude::*;
use serde::Serialize;

use super::method::{Label, Method};
use crate::error::StabilityError;
use crate::spectrum::verdict::Verdict;

/// Cells of a chart at one spindle speed, in the order of the depths of the chart.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct CellLine {
    /// Spindle speed, rev/min.
    pub rpm: f64,
    /// Absolute value |μ| of the dominant Floquet multiplier at each depth.
    pub multiplier_abs: Vec<f64>,
    /// Error estimate of |μ| of the dominant Floquet multiplier at each depth.
    pub error: Vec<f64>,
    /// Verdict at each depth.
    pub verdict: Vec<Verdict>,
}

/// Grid of cells over spindle speed and axial depth.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct CellChart {
    /// Label of the method that computed the cell chart.
    #[serde(flatten)]
    pub label: Label,
    /// Axial depths of the cells, mm, in the requested order.
    pub depths_mm: Vec<f64>,
    /// Cells of the chart at each spindle speed, in the requested order.
    pub speeds: Vec<CellLine>,
}

/// Computes a cell chart: the dominant Floquet multiplier at every spindle speed and axial depth, in parallel over
/// speeds.
///
/// The result does not depend on the number of threads.
///
/// # Errors
/// As [`Method::cells`], for the first speed that fails.
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
