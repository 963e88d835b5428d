//! Bifurcation diagram: the amplitude of forced orbits over one parameter, with their stability and bifurcations.

use plotters::chart::SeriesLabelPosition;
use plotters::prelude::Circle;
use plotters::style::{Color, RGBColor};

use super::branch_lines::{Ordinate, draw_runs, runs};
use super::doubled_lines::{draw_bistable, draw_doubled, heights_of};
use super::picture::{
    Axes, BLUE, CHATTER, Canvas, INK, Labels, ORANGE, PictureError, VIOLET, axes, draw, label, legend_at,
    span,
};
use crate::orbit::{Branch, BranchPoint, DoubledBranch, Event};
use crate::stability::StabilityLoss;

/// Width and height in pixels of the diagram.
const SIZE: (u32, u32) = (960, 480);

/// Displacements of a simulated cut, once per tooth passing.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Strobe<'a> {
    /// Value of the varied parameter.
    pub value: f64,
    /// Displacement when a tooth enters, in feed, normal and axial direction, mm.
    pub displacement_mm: &'a [[f64; 3]],
}

/// Draws the amplitude of the orbits of a branch over the varied parameter within `range`, in the direction in which it
/// is largest: stable orbits as a solid line, unstable ones dashed. With simulated cuts it draws their displacement when
/// a tooth enters as dots, and that of the orbits. Period-doubled orbits are drawn beside them, and the intervals with two
/// stable vibrations shaded.
///
/// # Errors
/// The branch has no orbit or the range no length, or the drawing library fails.
pub fn branch_chart(
    title: &str,
    branch: &Branch,
    doubled: &[DoubledBranch],
    range: [f64; 2],
    strobe: &[Strobe<'_>],
) -> Result<String, PictureError> {
    let [low, high] = [range[0].min(range[1]), range[0].max(range[1])];
    if branch.points.is_empty() || high <= low {
        return Err(PictureError::nothing(
            "a bifurcation diagram needs an orbit and a range",
        ));
    }
    let ordinate = Ordinate {
        is_displacement: !strobe.is_empty(),
        direction: largest_direction(branch),
    };
    let dots = dots(strobe, ordinate.direction);
    let orbits = branch.points.iter().map(|at| ordinate.of_point(at).1);
    let beside = heights_of(doubled, ordinate);
    let heights = span(orbits.chain(dots.iter().map(|dot| dot.1)).chain(beside));
    let heights = if ordinate.is_displacement {
        heights
    } else {
        0.0..heights.end
    };
    let y = ordinate.label();
    let labels = Labels {
        title,
        x: branch.parameter.label(),
        y: &y,
    };
    draw(SIZE, |canvas| {
        let mut chart = axes(canvas, &labels, low..high, heights.clone())?;
        draw_bistable(&mut chart, branch, doubled, heights)?;
        draw_strobe(&mut chart, &dots)?;
        draw_doubled(&mut chart, doubled, ordinate)?;
        let of_point = |_: usize, at: &BranchPoint| ordinate.of_point(at);
        let forced = runs(branch, of_point, |at| ordinate.of_event(at));
        draw_runs(&mut chart, &forced, INK, ["stable orbit", "unstable orbit"])?;
        let falls = falls(branch, ordinate);
        draw_events(canvas, &mut chart, (branch, falls), ordinate)?;
        // In the corner from which the branch bends away.
        let corner = if falls {
            SeriesLabelPosition::LowerLeft
        } else {
            SeriesLabelPosition::UpperLeft
        };
        legend_at(&mut chart, corner)
    })
}

/// Dots of simulated cuts in one direction of the tool.
fn dots(strobe: &[Strobe<'_>], direction: usize) -> Vec<(f64, f64)> {
    let of_set = |set: &Strobe<'_>| -> Vec<(f64, f64)> {
        let displacements = set.displacement_mm.iter();
        displacements.map(|at| (set.value, at[direction])).collect()
    };
    strobe.iter().flat_map(of_set).collect()
}

fn draw_strobe(chart: &mut Axes<'_, '_>, dots: &[(f64, f64)]) -> Result<(), PictureError> {
    if dots.is_empty() {
        return Ok(());
    }
    let color = CHATTER.mix(0.35);
    chart
        .draw_series(dots.iter().map(|&dot| Circle::new(dot, 3, color.filled())))?
        .label("simulated cuts, once per tooth")
        .legend(move |(x, y)| Circle::new((x + 9, y), 3, color.filled()));
    Ok(())
}

/// True if a diagram of a branch falls from its first orbit to its last.
fn falls(branch: &Branch, ordinate: Ordinate) -> bool {
    let height = |at: Option<&BranchPoint>| at.map_or(0.0, |at| ordinate.of_point(at).1);
    height(branch.points.last()) < height(branch.points.first())
}

/// Direction in which the orbits of a branch are largest.
fn largest_direction(branch: &Branch) -> usize {
    let largest = |direction: usize| {
        let sizes = branch.points.iter().map(|at| at.amplitude_mm[direction]);
        sizes.fold(0.0, f64::max)
    };
    (0..3)
        .max_by(|a, b| largest(*a).total_cmp(&largest(*b)))
        .unwrap_or(0)
}

/// Colour and name of a kind of bifurcation.
pub(super) fn look(kind: StabilityLoss) -> (RGBColor, &'static str) {
    match kind {
        StabilityLoss::Hopf => (BLUE, "torus"),
        StabilityLoss::Flip => (ORANGE, "flip"),
        StabilityLoss::Fold => (VIOLET, "fold"),
    }
}

fn draw_events(
    canvas: &Canvas<'_>,
    chart: &mut Axes<'_, '_>,
    (branch, falls): (&Branch, bool),
    ordinate: Ordinate,
) -> Result<(), PictureError> {
    let begins_stable = branch.points.first().is_some_and(|point| point.outside == 0);
    let first_loss = branch
        .events
        .iter()
        .position(|event| begins_stable && !event.gain);
    let at = |event: &Event| ordinate.of_event(event);
    for kind in [StabilityLoss::Hopf, StabilityLoss::Flip, StabilityLoss::Fold] {
        let (color, name) = look(kind);
        let of_kind: Vec<&Event> = branch.events.iter().filter(|event| event.kind == kind).collect();
        if of_kind.is_empty() {
            continue;
        }
        chart
            .draw_series(
                of_kind
                    .into_iter()
                    .map(|event| Circle::new(at(event), 5, color.filled())),
            )?
            .label(name)
            .legend(move |(x, y)| Circle::new((x + 9, y), 5, color.filled()));
    }
    if let Some(event) = first_loss.and_then(|index| branch.events.get(index)) {
        let (color, name) = look(event.kind);
        let (x, y) = chart.backend_coord(&at(event));
        let origin = canvas.get_base_pixel();
        chart.draw_series([Circle::new(at(event), 9, color.stroke_width(2))])?;
        let words = format!("first loss: {name}");
        // On the side of the branch to which it does not bend.
        let above = if falls { -28 } else { 12 };
        label(canvas, (x - origin.0 + 10, y - origin.1 + above), &words, color)?;
    }
    Ok(())
}
