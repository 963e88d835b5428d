//! Stability charts: the limits at many spindle speeds, by any method.
//!
//! Two refinements in speed exist, since a lobe table and a drawn chart need different speeds. [`Chart::refined`]
//! serves lobe tables: the device interpolates between the stored speeds, so that each gap is tested at its middle,
//! against one tolerance in depth, until all gaps pass or are too narrow, or the table has its size.
//! [`Chart::with_lines_between`] serves charts that are drawn: its tolerance is relative to the limit, a steep limit
//! may be off in speed instead, and regions within a gap must be found although no limit at its ends shows them. The
//! errors are predicted from neighbouring gaps and from |μ| at every speed, so that a straight gap costs no further
//! speed. For a table, a tolerance relative to the limit would let the smallest limit set the number of speeds; a chart
//! tested only at the middles of gaps would miss regions within a gap.

use rayon::prelude::*;
use serde::Serialize;

use super::method::{Label, Method, each_line};
use super::resolution::Resolution;
use super::speed_line::SpeedLine;
use super::spread::LimitSpread;
use super::uncertainty::Uncertainty;
use crate::criteria::CHART_SAMPLES_MIN;
use crate::error::StabilityError;

/// Stability chart over spindle speed and axial depth.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Chart {
    /// Label of the method that computed the stability chart.
    #[serde(flatten)]
    pub label: Label,
    /// Limits at the requested spindle speeds, in the requested order, and at those that [`Chart::refined`] has
    /// inserted.
    pub speeds: Vec<SpeedLine>,
    /// Limits at spindle speeds between the requested ones, ascending, added by [`Chart::with_lines_between`]; empty if
    /// it added none or was not called.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub refined: Vec<SpeedLine>,
    /// Accuracy of the limits between the speeds of the chart; `None` without a call of [`Chart::with_lines_between`].
    #[serde(skip_serializing_if = "Option::is_none")]
    pub resolution: Option<Resolution>,
    /// Depths of cells, mm, at which the share of stable machines among those drawn is stated for every requested
    /// speed; empty if not requested.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub cells_mm: Vec<f64>,
}

/// Computes a stability chart: the limits at the given spindle speeds (rev/min) from axial depth 0 to `depth_mm`, with
/// `samples` steps in depth, but at least `CHART_SAMPLES_MIN`. Methods that do not scan the depth ignore the steps.
///
/// The result does not depend on the number of threads.
///
/// # Errors
/// As [`Method::line`], for the first speed that fails.
pub fn chart<M: Method + ?Sized>(
    method: &M,
    speeds_rpm: &[f64],
    depth_mm: f64,
    samples: usize,
) -> Result<Chart, StabilityError> {
    let lines = method.lines(speeds_rpm, depth_mm, samples.max(CHART_SAMPLES_MIN))?;
    Ok(Chart::of_lines(method, lines))
}

/// Lines of a chart up to the first limit of each speed, which may take less time than [`chart()`]: depths beyond it may
/// be missing.
///
/// # Errors
/// As [`chart()`].
pub fn first_limits<M: Method + ?Sized>(
    method: &M,
    speeds_rpm: &[f64],
    depth_mm: f64,
) -> Result<Vec<SpeedLine>, StabilityError> {
    method.up_to_first_limits(speeds_rpm, depth_mm, CHART_SAMPLES_MIN)
}

/// Computes a stability chart as [`chart()`] with the limits of each speed on their own, and calls `after_each` after each
/// speed: for a method that needs seconds a speed.
///
/// # Errors
/// As [`chart()`].
pub fn counted_chart<M: Method + ?Sized>(
    method: &M,
    speeds_rpm: &[f64],
    depth_mm: f64,
    samples: usize,
    after_each: impl Fn() + Sync,
) -> Result<Chart, StabilityError> {
    let samples = samples.max(CHART_SAMPLES_MIN);
    let lines = each_line(method, speeds_rpm, depth_mm, samples, after_each)?;
    Ok(Chart::of_lines(method, lines))
}

/// Refinement of a chart in spindle speed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Refinement {
    /// Largest difference between a limit at the middle of a gap between two speeds and the straight line between the
    /// limits at both, as a share of the largest depth, up to which the halves of the gap are not divided.
    pub tolerance: f64,
    /// Least distance of an added speed from its neighbours in the chart, relative to the lower one: a gap no wider
    /// than twice this gets no further speed.
    pub least_step: f64,
    /// Number of speeds of the chart from which no further round of refinement begins.
    pub most_speeds: usize,
}

impl Chart {
    fn of_lines<M: Method + ?Sized>(method: &M, speeds: Vec<SpeedLine>) -> Self {
        Self {
            label: Label::of(method),
            speeds,
            refined: Vec::new(),
            resolution: None,
            cells_mm: Vec::new(),
        }
    }

    /// Adds the spread of the limit over drawn machines at every requested speed: see [`Uncertainty::spread`].
    ///
    /// The result does not depend on the number of threads.
    ///
    /// # Errors
    /// As [`Uncertainty::spread`], for the first speed that fails.
    pub fn with_spread(
        mut self,
        uncertainty: &Uncertainty<'_>,
        depth_mm: f64,
        cells_mm: &[f64],
    ) -> Result<Self, StabilityError> {
        let spreads: Vec<Result<LimitSpread, StabilityError>> = self
            .speeds
            .par_iter()
            .map(|line| uncertainty.spread(line, depth_mm, cells_mm))
            .collect();
        for (line, spread) in self.speeds.iter_mut().zip(spreads) {
            line.spread = Some(spread?);
        }
        self.cells_mm = cells_mm.to_vec();
        Ok(self)
    }

    /// Adds one speed in every gap that is wide enough, and further ones where limits bend, where the kind of the first
    /// stability loss changes, and where the number of stable depth intervals changes. No round begins with
    /// `most_speeds` or more. Speeds must be ascending.
    ///
    /// # Errors
    /// As [`Method::line`].
    pub fn refined<M: Method + ?Sized>(
        mut self,
        method: &M,
        depth_mm: f64,
        refinement: Refinement,
    ) -> Result<Self, StabilityError> {
        let tolerance_mm = refinement.tolerance * depth_mm;
        // The first round halves every gap between two speeds that is wide enough; later rounds halve only the halves
        // of a gap whose middle fails [`is_between`].
        let mut open: Vec<bool> = vec![true; self.speeds.len().saturating_sub(1)];
        while open.iter().any(|&is_open| is_open) && self.speeds.len() < refinement.most_speeds {
            let middles: Vec<f64> = self
                .speeds
                .windows(2)
                .zip(&open)
                .filter(|(pair, is_open)| {
                    **is_open && pair[1].rpm - pair[0].rpm > 2.0 * refinement.least_step * pair[0].rpm
                })
                .map(|(pair, _)| 0.5 * (pair[0].rpm + pair[1].rpm))
                .collect();
            let between = chart(method, &middles, depth_mm, CHART_SAMPLES_MIN)?.speeds;
            let mut between = between.into_iter().peekable();
            let mut speeds = Vec::with_capacity(self.speeds.len() + middles.len());
            let mut next_open = Vec::with_capacity(speeds.capacity());
            let mut old = self.speeds.into_iter().peekable();
            while let Some(left) = old.next() {
                let right = old.peek();
                let middle = right.and_then(|right| between.next_if(|middle| middle.rpm < right.rpm));
                match (right, middle) {
                    (Some(right), Some(middle)) => {
                        let expected = is_between(&left, &middle, right, tolerance_mm);
                        speeds.extend([left, middle]);
                        next_open.extend([!expected, !expected]);
                    }
                    (Some(_), None) => {
                        speeds.push(left);
                        next_open.push(false);
                    }
                    (None, _) => speeds.push(left),
                }
            }
            self.speeds = speeds;
            open = next_open;
        }
        Ok(self)
    }
}

/// True if the middle speed has as many stable intervals and the same kind of first stability loss as both outer
/// speeds, and if each end of a stable interval lies within `tolerance_mm` of the straight line between the outer
/// speeds.
fn is_between(left: &SpeedLine, middle: &SpeedLine, right: &SpeedLine, tolerance_mm: f64) -> bool {
    let share = (middle.rpm - left.rpm) / (right.rpm - left.rpm);
    let (a, m, b) = (&left.stable_mm, &middle.stable_mm, &right.stable_mm);
    let kinds = [left, middle, right].map(|line| line.first_limit.map(|limit| limit.kind));
    a.len() == m.len()
        && m.len() == b.len()
        && kinds[0] == kinds[1]
        && kinds[1] == kinds[2]
        && a.iter().zip(m).zip(b).all(|((a, m), b)| {
            (0..2).all(|end| (a[end] + (b[end] - a[end]) * share - m[end]).abs() <= tolerance_mm)
        })
}
