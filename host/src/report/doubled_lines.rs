//! Period-doubled orbits in a bifurcation diagram, and the intervals with two stable vibrations.

use std::ops::Range;

use plotters::prelude::Rectangle;
use plotters::style::Color;

use super::branch_lines::{Ordinate, Run, draw_runs, runs};
use super::picture::{Axes, ORANGE, PictureError};
use crate::orbit::{Branch, BranchPoint, DoubledBranch, Event};

/// Displacements when a tooth enters of both tooth periods of a doubled orbit; the amplitude is one height.
fn lines(ordinate: Ordinate) -> Range<usize> {
    if ordinate.is_displacement { 0..2 } else { 0..1 }
}

/// Height of a doubled orbit, given by its index, on one of its lines.
fn height(
    doubled: &DoubledBranch,
    index: usize,
    at: &BranchPoint,
    (ordinate, line): (Ordinate, usize),
) -> f64 {
    let displacement = doubled
        .points
        .get(index)
        .and_then(|point| point.displacements_mm.get(line));
    match displacement.filter(|_| ordinate.is_displacement) {
        Some(displacement) => displacement[ordinate.direction],
        None => ordinate.of_point(at).1,
    }
}

/// Height of a bifurcation of doubled orbits on one of their lines; on the second line, where it is not known, the mean of
/// the orbits beside it.
fn height_of_event(doubled: &DoubledBranch, event: &Event, (ordinate, line): (Ordinate, usize)) -> f64 {
    let points = &doubled.branch.points;
    let beside = event
        .after
        .checked_sub(1)
        .and_then(|before| Some([before, points.get(event.after).map(|_| event.after)?]));
    match beside.filter(|_| line > 0) {
        Some(beside) => beside
            .iter()
            .map(|&index| 0.5 * height(doubled, index, &points[index], (ordinate, line)))
            .sum(),
        None => ordinate.of_event(event).1,
    }
}

/// Heights of all doubled orbits in a diagram.
pub(super) fn heights_of(doubled: &[DoubledBranch], ordinate: Ordinate) -> Vec<f64> {
    let of_branch = |doubled: &DoubledBranch| -> Vec<f64> {
        let points = doubled.branch.points.iter().enumerate();
        points
            .flat_map(|(index, at)| {
                lines(ordinate).map(move |line| height(doubled, index, at, (ordinate, line)))
            })
            .collect()
    };
    doubled.iter().flat_map(of_branch).collect()
}

/// Draws doubled orbits: stable ones as a solid line, unstable ones dashed.
pub(super) fn draw_doubled(
    chart: &mut Axes<'_, '_>,
    doubled: &[DoubledBranch],
    ordinate: Ordinate,
) -> Result<(), PictureError> {
    let mut all: Vec<Run> = Vec::new();
    for branch in doubled {
        for line in lines(ordinate) {
            let shown = (ordinate, line);
            all.extend(runs(
                &branch.branch,
                |index, at| (at.value, height(branch, index, at, shown)),
                |event| (event.value, height_of_event(branch, event, shown)),
            ));
        }
    }
    draw_runs(
        chart,
        &all,
        ORANGE,
        ["stable doubled orbit", "unstable doubled orbit"],
    )
}

/// Shades the intervals in which a doubled orbit is stable beside a forced one.
pub(super) fn draw_bistable(
    chart: &mut Axes<'_, '_>,
    branch: &Branch,
    doubled: &[DoubledBranch],
    heights: Range<f64>,
) -> Result<(), PictureError> {
    let zones: Vec<[f64; 2]> = doubled
        .iter()
        .flat_map(|doubled| doubled.bistable(branch))
        .collect();
    if zones.is_empty() {
        return Ok(());
    }
    let color = ORANGE.mix(0.15);
    chart
        .draw_series(
            zones.iter().map(|&[from, to]| {
                Rectangle::new([(from, heights.start), (to, heights.end)], color.filled())
            }),
        )?
        .label("bistable")
        .legend(move |(x, y)| Rectangle::new([(x, y - 5), (x + 18, y + 5)], color.filled()));
    Ok(())
}
