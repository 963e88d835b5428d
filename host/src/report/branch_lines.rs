//! Lines of a bifurcation diagram: a branch in parts with the same stability, over a quantity of its orbits.

use plotters::prelude::{DashedLineSeries, LineSeries, PathElement};
use plotters::style::{Color, RGBColor};

use super::picture::{Axes, PictureError};
use crate::orbit::{Branch, BranchPoint, Event};

/// Directions of the tool in the order of results.
const DIRECTIONS: [&str; 3] = ["feed", "normal", "axial"];

/// Quantity over which a bifurcation diagram shows a branch, in one direction of the tool.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Ordinate {
    /// True for the displacement when a tooth enters, false for the amplitude.
    pub(super) is_displacement: bool,
    pub(super) direction: usize,
}

impl Ordinate {
    pub(super) fn of_point(self, at: &BranchPoint) -> (f64, f64) {
        (at.value, self.of(at.amplitude_mm, at.displacement_mm))
    }

    pub(super) fn of_event(self, at: &Event) -> (f64, f64) {
        (at.value, self.of(at.amplitude_mm, at.displacement_mm))
    }

    fn of(self, amplitude_mm: [f64; 3], displacement_mm: [f64; 3]) -> f64 {
        if self.is_displacement {
            displacement_mm[self.direction]
        } else {
            amplitude_mm[self.direction]
        }
    }

    pub(super) fn label(self) -> String {
        let direction = DIRECTIONS[self.direction];
        if self.is_displacement {
            format!("displacement when a tooth enters, {direction} [mm]")
        } else {
            format!("amplitude in {direction} direction [mm]")
        }
    }
}

/// Part of a branch with the same stability.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Run {
    is_stable: bool,
    points: Vec<(f64, f64)>,
}

/// The branch in parts, which meet at its bifurcations, with its points by index and its bifurcations at given places of
/// the diagram.
pub(super) fn runs(
    branch: &Branch,
    of_point: impl Fn(usize, &BranchPoint) -> (f64, f64),
    of_event: impl Fn(&Event) -> (f64, f64),
) -> Vec<Run> {
    let mut runs: Vec<Run> = Vec::new();
    let mut add = |at: (f64, f64), is_stable: bool| match runs.last_mut() {
        Some(run) if run.is_stable == is_stable => run.points.push(at),
        Some(run) => {
            run.points.push(at);
            runs.push(Run {
                is_stable,
                points: vec![at],
            });
        }
        None => runs.push(Run {
            is_stable,
            points: vec![at],
        }),
    };
    for (index, point) in branch.points.iter().enumerate() {
        let mut outside = match index.checked_sub(1).and_then(|before| branch.points.get(before)) {
            Some(before) => before.outside,
            None => point.outside,
        };
        for event in branch.events.iter().filter(|event| event.after == index) {
            let count = event.kind.count();
            outside += if event.gain { -count } else { count };
            add(of_event(event), outside <= 0);
        }
        add(of_point(index, point), point.outside <= 0);
    }
    runs
}

pub(super) fn draw_runs(
    chart: &mut Axes<'_, '_>,
    runs: &[Run],
    color: RGBColor,
    names: [&str; 2],
) -> Result<(), PictureError> {
    let mut named = [false; 2];
    for run in runs {
        let points = run.points.iter().copied();
        let drawn = if run.is_stable {
            chart.draw_series(LineSeries::new(points, color.stroke_width(3)))?
        } else {
            chart.draw_series(DashedLineSeries::new(points, 6, 5, color.stroke_width(2)))?
        };
        let is_named = &mut named[usize::from(run.is_stable)];
        if *is_named {
            continue;
        }
        *is_named = true;
        if run.is_stable {
            drawn
                .label(names[0])
                .legend(move |(x, y)| PathElement::new([(x, y), (x + 18, y)], color.stroke_width(3)));
        } else {
            drawn
                .label(names[1])
                .legend(move |(x, y)| PathElement::new([(x, y), (x + 6, y)], color.stroke_width(2)));
        }
    }
    Ok(())
}
