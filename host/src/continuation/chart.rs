//! Charts and points of structures whose limits depend on the forced orbit.

use rayon::prelude::*;

use super::branch::{Extent, follow_depth, multiplier_at};
use super::forced::ForcedProblem;
use super::orbit::OrbitError;
use crate::stability::multiplier::{Kind, Verdict};
use crate::stability::{Chart, LEAST_ERROR, Point, StabilityError};

/// The lines at given speeds, from depth 0 to `depth_mm`, about the forced orbit at the feed of the case.
///
/// The result does not depend on the number of threads.
///
/// # Errors
/// The branch of orbits cannot be followed to the last depth at one of the speeds.
pub fn chart(problem: &ForcedProblem, speeds_rpm: &[f64], depth_mm: f64) -> Result<Chart, StabilityError> {
    let lines: Vec<_> = speeds_rpm
        .par_iter()
        .map(|&rpm| {
            follow_depth(problem, rpm, depth_mm, Extent::Whole)
                .map(|branch| branch.speed_line())
                .map_err(|cause| broke_down(rpm, depth_mm, cause))
        })
        .collect();
    Ok(Chart {
        method: "collocation about the forced orbit",
        speeds: lines.into_iter().collect::<Result<_, _>>()?,
    })
}

/// The dominant multiplier about the forced orbit that is reached when the depth grows from 0.
///
/// The error is that of a mesh twice as fine.
///
/// # Errors
/// The orbit is lost in a fold before the depth is reached, or cannot be followed.
pub fn point(problem: &ForcedProblem, rpm: f64, depth_mm: f64) -> Result<Point, StabilityError> {
    let fail = |cause| broke_down(rpm, depth_mm, cause);
    let [coarse, fine] = multiplier_at(problem, rpm, depth_mm).map_err(fail)?;
    let multiplier_abs = fine.multiplier.norm();
    // The coarse mesh errs by far more than the fine one: their difference is a bound with room to spare.
    let error =
        (10.0 * (coarse.multiplier - fine.multiplier).norm()).max(LEAST_ERROR * multiplier_abs.max(1.0));
    Ok(Point {
        rpm,
        depth_mm,
        multiplier: fine.multiplier,
        multiplier_abs,
        error,
        verdict: Verdict::of(multiplier_abs, error),
        kind: Kind::of(fine.multiplier),
        chatter_hz: fine.chatter_hz,
    })
}

fn broke_down(rpm: f64, depth_mm: f64, cause: OrbitError) -> StabilityError {
    let what = match cause {
        OrbitError::NoConvergence { .. } => "the forced orbit cannot be followed to this depth",
        OrbitError::Singular { .. } => "the equations of the forced orbit are singular",
        OrbitError::Lost { .. } => "the forced orbit is lost in a fold before this depth",
    };
    StabilityError::BrokeDown { rpm, depth_mm, what }
}
