//! The stability chart: stable depths over spindle speed, the kind of each limit, and points of interest.

use plotters::chart::SeriesLabelPosition;
use plotters::prelude::{Circle, Cross, LineSeries, PathElement, Polygon, Rectangle, Text, WHITE};
use plotters::style::text_anchor::{HPos, Pos, VPos};
use plotters::style::{Color, RGBColor};

use super::picture::{
    Axes, BLUE, CHATTER, Canvas, INK, Labels, ORANGE, PictureError, QUIET, VIOLET, axes, draw, text,
};

/// How stability is lost.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LimitKind {
    /// A complex pair of multipliers (secondary Hopf, torus).
    Hopf,
    /// A multiplier through −1 (period doubling).
    Flip,
    /// A multiplier through +1.
    Fold,
}

/// Where stability is first lost over depth at one speed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FirstLimit {
    /// Axial depth of cut.
    pub depth_mm: f64,
    /// How.
    pub kind: LimitKind,
}

/// What is known at one spindle speed.
#[derive(Clone, Debug, PartialEq)]
pub struct Column {
    /// Spindle speed.
    pub rpm: f64,
    /// Depths that are stable, as intervals in order.
    pub stable_mm: Vec<(f64, f64)>,
    /// Where stability is first lost; `None` where nothing is lost up to the last depth.
    pub first_limit: Option<FirstLimit>,
}

/// What a marked point is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum MarkKind {
    /// A cut that chattered.
    Chatter,
    /// A cut that was quiet.
    Quiet,
}

/// A point on the chart.
#[derive(Clone, Debug, PartialEq)]
pub struct Mark {
    /// Spindle speed.
    pub rpm: f64,
    /// Axial depth of cut.
    pub depth_mm: f64,
    /// What it is.
    pub kind: MarkKind,
    /// A word beside it; empty for none.
    pub label: String,
    /// Spindle speed and depth that were advised here: an arrow goes there.
    pub advice: Option<(f64, f64)>,
}

// Paper colours that do not mix where areas lie on one another.
const STABLE: RGBColor = RGBColor(0xd2, 0xea, 0xdc);
const UNSTABLE: RGBColor = RGBColor(0xfa, 0xec, 0xec);

/// Size of the picture in pixels.
const SIZE: (u32, u32) = (960, 480);

/// Draws the chart as SVG. `columns` in order of speed, at least two of different speed; depths from 0 to `depth_max_mm`.
///
/// # Errors
/// Where there is nothing to draw, or the drawing library refuses.
pub fn lobe_chart(
    title: &str,
    columns: &[Column],
    depth_max_mm: f64,
    marks: &[Mark],
) -> Result<String, PictureError> {
    let (Some(first), Some(last)) = (columns.first(), columns.last()) else {
        return Err(PictureError::nothing("a chart needs at least two speeds"));
    };
    if !(last.rpm > first.rpm && depth_max_mm > 0.0) {
        return Err(PictureError::nothing(
            "a chart needs at least two speeds and a depth",
        ));
    }
    let labels = Labels {
        title,
        x: "spindle speed [rev/min]",
        y: "axial depth of cut [mm]",
    };
    draw(SIZE, |canvas| {
        let mut chart = axes(canvas, &labels, first.rpm..last.rpm, 0.0..depth_max_mm)?;
        chart.draw_series([Rectangle::new(
            [(first.rpm, 0.0), (last.rpm, depth_max_mm)],
            UNSTABLE.filled(),
        )])?;
        chart.draw_series(
            stable_areas(columns)
                .into_iter()
                .map(|area| Polygon::new(area, STABLE)),
        )?;
        for kind in [LimitKind::Hopf, LimitKind::Flip, LimitKind::Fold] {
            draw_limits(&mut chart, columns, depth_max_mm, kind)?;
        }
        draw_marks(canvas, &mut chart, marks)?;
        chart
            .configure_series_labels()
            .position(SeriesLabelPosition::UpperRight)
            .background_style(WHITE.mix(0.85))
            .border_style(INK.mix(0.3))
            .label_font(text(13, INK))
            .draw()?;
        Ok(())
    })
}

fn limit_look(kind: LimitKind) -> (RGBColor, &'static str) {
    match kind {
        LimitKind::Hopf => (BLUE, "limit: Hopf"),
        LimitKind::Flip => (ORANGE, "limit: period doubling (flip)"),
        LimitKind::Fold => (VIOLET, "limit: fold"),
    }
}

/// Between two columns with as many stable intervals, trapezoids; else each column's intervals reach half way.
fn stable_areas(columns: &[Column]) -> Vec<Vec<(f64, f64)>> {
    let mut areas = Vec::new();
    for (left, right) in columns.iter().zip(columns.iter().skip(1)) {
        if left.stable_mm.len() == right.stable_mm.len() {
            for (&(a, b), &(c, d)) in left.stable_mm.iter().zip(&right.stable_mm) {
                areas.push(vec![(left.rpm, a), (right.rpm, c), (right.rpm, d), (left.rpm, b)]);
            }
        } else {
            let middle = 0.5 * (left.rpm + right.rpm);
            for (column, from, to) in [(left, left.rpm, middle), (right, middle, right.rpm)] {
                for &(a, b) in &column.stable_mm {
                    areas.push(vec![(from, a), (to, a), (to, b), (from, b)]);
                }
            }
        }
    }
    areas
}

/// The first limits of one kind as lines.
fn draw_limits(
    chart: &mut Axes<'_, '_>,
    columns: &[Column],
    depth_max_mm: f64,
    kind: LimitKind,
) -> Result<(), PictureError> {
    let (color, name) = limit_look(kind);
    for (index, run) in limit_runs(columns, depth_max_mm, kind).into_iter().enumerate() {
        // A kind that leads at a lone speed is still seen.
        chart.draw_series(run.iter().map(|&at| Circle::new(at, 1, color.filled())))?;
        let line = chart.draw_series(LineSeries::new(run, color.stroke_width(3)))?;
        if index == 0 {
            line.label(name)
                .legend(move |(x, y)| PathElement::new([(x, y), (x + 18, y)], color.stroke_width(3)));
        }
    }
    Ok(())
}

/// Runs of neighbouring speeds whose first limit has this kind; each goes half way to a neighbour of another kind.
fn limit_runs(columns: &[Column], depth_max_mm: f64, kind: LimitKind) -> Vec<Vec<(f64, f64)>> {
    let visible = |column: &Column| column.first_limit.filter(|limit| limit.depth_mm <= depth_max_mm);
    let mut runs: Vec<Vec<(f64, f64)>> = Vec::new();
    let mut open = false;
    for (index, column) in columns.iter().enumerate() {
        let Some(limit) = visible(column) else {
            open = false;
            continue;
        };
        let neighbour = index.checked_sub(1).and_then(|before| columns.get(before));
        let half_way = neighbour.and_then(|before| {
            let there = visible(before)?;
            let depth_mm = 0.5 * (limit.depth_mm + there.depth_mm);
            (there.kind != limit.kind).then_some((0.5 * (column.rpm + before.rpm), depth_mm))
        });
        match (limit.kind == kind, runs.last_mut()) {
            (true, Some(run)) if open => run.push((column.rpm, limit.depth_mm)),
            (true, _) => runs.push(
                half_way
                    .into_iter()
                    .chain([(column.rpm, limit.depth_mm)])
                    .collect(),
            ),
            (false, Some(run)) if open => run.extend(half_way),
            (false, _) => {}
        }
        open = limit.kind == kind;
    }
    runs
}

/// A box on the paper: left, top, right, bottom.
type Area = (i32, i32, i32, i32);

fn overlap(a: Area, b: Area) -> bool {
    a.0 < b.2 && b.0 < a.2 && a.1 < b.3 && b.1 < a.3
}

fn draw_marks(canvas: &Canvas<'_>, chart: &mut Axes<'_, '_>, marks: &[Mark]) -> Result<(), PictureError> {
    const RADIUS: i32 = 7;
    let mut taken: Vec<Area> = Vec::new();
    for mark in marks {
        let at = chart.backend_coord(&(mark.rpm, mark.depth_mm));
        if let Some(advice) = mark.advice {
            draw_arrow(canvas, at, chart.backend_coord(&advice))?;
        }
        taken.push((at.0 - RADIUS, at.1 - RADIUS, at.0 + RADIUS, at.1 + RADIUS));
    }
    for mark in marks {
        let at = chart.backend_coord(&(mark.rpm, mark.depth_mm));
        let color = match mark.kind {
            MarkKind::Chatter => CHATTER,
            MarkKind::Quiet => QUIET,
        };
        match mark.kind {
            MarkKind::Chatter => canvas.draw(&Cross::new(at, RADIUS, color.stroke_width(4)))?,
            MarkKind::Quiet => {
                canvas.draw(&Circle::new(at, RADIUS, WHITE.filled()))?;
                canvas.draw(&Circle::new(at, RADIUS - 1, color.filled()))?;
            }
        }
        if !mark.label.is_empty() {
            draw_label(canvas, at, &mark.label, color, &mut taken)?;
        }
    }
    Ok(())
}

/// A label near `at` that covers no other: above, below, then farther away.
fn draw_label(
    canvas: &Canvas<'_>,
    at: (i32, i32),
    label: &str,
    color: RGBColor,
    taken: &mut Vec<Area>,
) -> Result<(), PictureError> {
    let style = text(13, color);
    let (w, h) = canvas.estimate_text_size(label, &style)?;
    let (w, h) = (w as i32 + 12, h as i32 + 6);
    let width = canvas.dim_in_pixel().0 as i32;
    // Moved sideways where it would leave the paper.
    let left = (at.0 - w / 2).clamp(0, (width - w).max(0));
    let tops = [
        at.1 - h - 11,
        at.1 + 11,
        at.1 - 2 * h - 13,
        at.1 + h + 13,
        at.1 - 3 * h - 15,
        at.1 + 2 * h + 15,
    ];
    let areas = tops.map(|top| (left, top, left + w, top + h));
    let area = areas
        .into_iter()
        .find(|&area| !taken.iter().any(|&other| overlap(area, other)));
    let area = area.unwrap_or(areas[0]);
    taken.push(area);
    canvas.draw(&Rectangle::new(
        [(area.0, area.1), (area.2, area.3)],
        WHITE.mix(0.85).filled(),
    ))?;
    let middle = (area.0 + w / 2, area.1 + h / 2);
    canvas.draw(&Text::new(
        label,
        middle,
        style.pos(Pos::new(HPos::Center, VPos::Center)),
    ))?;
    Ok(())
}

/// An arrow that stops a little before the point it shows.
fn draw_arrow(canvas: &Canvas<'_>, from: (i32, i32), to: (i32, i32)) -> Result<(), PictureError> {
    const GAP: f64 = 12.0;
    const HEAD: f64 = 11.0;
    let (dx, dy) = (f64::from(to.0 - from.0), f64::from(to.1 - from.1));
    let length = dx.hypot(dy);
    if length < 2.0 * GAP + HEAD {
        return Ok(());
    }
    let (ux, uy) = (dx / length, dy / length);
    let along = |distance: f64, aside: f64| {
        let x = f64::from(from.0) + ux * distance - uy * aside;
        let y = f64::from(from.1) + uy * distance + ux * aside;
        (x.round() as i32, y.round() as i32)
    };
    let tip = length - GAP;
    canvas.draw(&PathElement::new(
        [along(GAP, 0.0), along(tip - HEAD, 0.0)],
        INK.stroke_width(2),
    ))?;
    let head = [along(tip, 0.0), along(tip - HEAD, 5.0), along(tip - HEAD, -5.0)];
    canvas.draw(&Polygon::new(head, INK))?;
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn column(rpm: f64, stable_mm: &[(f64, f64)], kind: LimitKind) -> Column {
        let first_limit = stable_mm
            .first()
            .map(|&(_, depth_mm)| FirstLimit { depth_mm, kind });
        Column {
            rpm,
            stable_mm: stable_mm.to_vec(),
            first_limit,
        }
    }

    #[test]
    fn areas_follow_the_intervals() {
        let columns = [
            column(1000.0, &[(0.0, 2.0)], LimitKind::Hopf),
            column(1010.0, &[(0.0, 1.6)], LimitKind::Flip),
            column(1020.0, &[(0.0, 1.5), (2.3, 2.7)], LimitKind::Flip),
        ];
        let areas = stable_areas(&columns);
        assert_eq!(
            areas[0],
            [(1000.0, 0.0), (1010.0, 0.0), (1010.0, 1.6), (1000.0, 2.0)]
        );
        // Half way between 1010 and 1020 the island begins: one area on the left, two on the right.
        assert_eq!(areas.len(), 4);
        assert_eq!(
            areas[3],
            [(1015.0, 2.3), (1020.0, 2.3), (1020.0, 2.7), (1015.0, 2.7)]
        );
    }

    #[test]
    fn limits_of_two_kinds_meet_half_way() {
        let columns = [
            column(1000.0, &[(0.0, 2.0)], LimitKind::Hopf),
            column(1010.0, &[(0.0, 1.8)], LimitKind::Hopf),
            column(1020.0, &[(0.0, 1.4)], LimitKind::Flip),
            column(1030.0, &[(0.0, 9.0)], LimitKind::Hopf),
        ];
        let hopf = limit_runs(&columns, 4.0, LimitKind::Hopf);
        assert_eq!(hopf, [vec![(1000.0, 2.0), (1010.0, 1.8), (1015.0, 1.6)]]);
        assert_eq!(
            limit_runs(&columns, 4.0, LimitKind::Flip),
            [vec![(1015.0, 1.6), (1020.0, 1.4)]]
        );
    }

    #[test]
    fn the_chart_names_its_kinds_and_points() {
        let columns = [
            column(600.0, &[(0.0, 3.0)], LimitKind::Hopf),
            column(1045.0, &[(0.0, 1.3)], LimitKind::Flip),
            column(1200.0, &[(0.0, 2.0)], LimitKind::Hopf),
        ];
        let mark = Mark {
            rpm: 1045.0,
            depth_mm: 2.0,
            kind: MarkKind::Chatter,
            label: "first cut".into(),
            advice: Some((1150.0, 2.0)),
        };
        let svg = lobe_chart("robot", &columns, 4.0, &[mark]).unwrap();
        for said in [
            "robot",
            "limit: Hopf",
            "limit: period doubling (flip)",
            "first cut",
            "rev/min",
        ] {
            assert!(svg.contains(said), "{said}");
        }
        assert!(!svg.contains("limit: fold"));
    }

    #[test]
    fn nothing_to_draw_is_said() {
        let one = [column(600.0, &[(0.0, 3.0)], LimitKind::Hopf)];
        assert!(lobe_chart("", &one, 4.0, &[]).is_err());
        assert!(lobe_chart("", &[], 4.0, &[]).is_err());
    }
}
