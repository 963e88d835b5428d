//! Marks of cuts on a stability chart, with arrows to the advised spindle speed and axial depth.

use plotters::prelude::{Circle, Cross, PathElement, Polygon, Rectangle, Text, WHITE};
use plotters::style::text_anchor::{HPos, Pos, VPos};
use plotters::style::{Color, RGBColor};

use super::picture::{Axes, CHATTER, Canvas, INK, ORANGE, PictureError, QUIET, text};
use crate::trial_cuts::{Outcome, TrialCut};

/// Outcome of a marked cut.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum MarkKind {
    /// Cut with chatter.
    Chatter,
    /// Stable cut.
    Quiet,
    /// Marginal cut, neither clearly stable nor chatter.
    Marginal,
}

/// Mark of one cut on the stability chart.
#[derive(Clone, Debug, PartialEq)]
pub struct Mark {
    /// Spindle speed, rev/min.
    pub rpm: f64,
    /// Axial depth, mm.
    pub depth_mm: f64,
    /// Outcome of the marked cut, which sets the symbol.
    pub kind: MarkKind,
    /// Label drawn near the symbol of the cut; empty for none.
    pub label: String,
    /// Spindle speed in rev/min and axial depth in mm that the device advised after the cut, shown by an arrow; `None`
    /// without advice.
    pub advice: Option<(f64, f64)>,
    /// True if the stability chart predicts the opposite outcome of the cut, which a ring shows.
    pub wrong: bool,
}

impl From<&TrialCut> for Mark {
    fn from(cut: &TrialCut) -> Self {
        Self {
            rpm: cut.rpm,
            depth_mm: cut.depth_mm,
            kind: match cut.outcome {
                Outcome::Stable => MarkKind::Quiet,
                Outcome::Chatter => MarkKind::Chatter,
                Outcome::Marginal => MarkKind::Marginal,
            },
            label: String::new(),
            advice: None,
            wrong: false,
        }
    }
}

/// Rectangle on the picture, in pixels from its upper left corner: left, top, right, bottom.
type Area = (i32, i32, i32, i32);

fn overlap(a: Area, b: Area) -> bool {
    a.0 < b.2 && b.0 < a.2 && a.1 < b.3 && b.1 < a.3
}

/// Draws the marks of cuts with their labels and arrows on the stability chart.
pub(super) fn draw_marks(
    canvas: &Canvas<'_>,
    chart: &mut Axes<'_, '_>,
    marks: &[Mark],
) -> Result<(), PictureError> {
    const RADIUS: i32 = 7;
    let mut occupied: Vec<Area> = Vec::new();
    for mark in marks {
        let at = chart.backend_coord(&(mark.rpm, mark.depth_mm));
        if let Some(advice) = mark.advice {
            draw_arrow(canvas, at, chart.backend_coord(&advice))?;
        }
        occupied.push((at.0 - RADIUS, at.1 - RADIUS, at.0 + RADIUS, at.1 + RADIUS));
    }
    for mark in marks {
        let at = chart.backend_coord(&(mark.rpm, mark.depth_mm));
        let color = match mark.kind {
            MarkKind::Chatter => CHATTER,
            MarkKind::Quiet => QUIET,
            MarkKind::Marginal => INK,
        };
        match mark.kind {
            MarkKind::Chatter => canvas.draw(&Cross::new(at, RADIUS, color.stroke_width(4)))?,
            MarkKind::Quiet => {
                canvas.draw(&Circle::new(at, RADIUS, WHITE.filled()))?;
                canvas.draw(&Circle::new(at, RADIUS - 1, color.filled()))?;
            }
            MarkKind::Marginal => {
                let side = RADIUS - 1;
                let corners = [(at.0 - side, at.1 - side), (at.0 + side, at.1 + side)];
                canvas.draw(&Rectangle::new(corners, WHITE.filled()))?;
                canvas.draw(&Rectangle::new(corners, color.stroke_width(2)))?;
            }
        }
        if mark.wrong {
            canvas.draw(&Circle::new(at, RADIUS + 5, ORANGE.stroke_width(3)))?;
        }
        if !mark.label.is_empty() {
            draw_label(canvas, at, &mark.label, color, &mut occupied)?;
        }
    }
    Ok(())
}

/// Draws the label of a cut near the pixel `at` of its mark: above, below, then farther away, at the first place where
/// it covers no mark and no label drawn before; directly above the mark if there is no such place.
fn draw_label(
    canvas: &Canvas<'_>,
    at: (i32, i32),
    label: &str,
    color: RGBColor,
    occupied: &mut Vec<Area>,
) -> Result<(), PictureError> {
    let style = text(13, color);
    let (w, h) = canvas.estimate_text_size(label, &style)?;
    let (w, h) = (w as i32 + 12, h as i32 + 6);
    let width = canvas.dim_in_pixel().0 as i32;
    // The label is shifted sideways so that it starts within the picture and, if it is no wider than that, ends there.
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
        .find(|&area| !occupied.iter().any(|&other| overlap(area, other)));
    let area = area.unwrap_or(areas[0]);
    occupied.push(area);
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

/// Draws an arrow from one pixel to another with a gap of 12 pixels at both ends; draws nothing if the two are less
/// than 35 pixels apart.
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
    use crate::report::picture::draw;

    #[test]
    fn labels_of_near_points_do_not_cover_one_another() {
        let mut occupied = Vec::new();
        draw((400, 300), |canvas| {
            for at in [(100, 100), (110, 100), (120, 102), (130, 98)] {
                draw_label(canvas, at, "a cut", CHATTER, &mut occupied)?;
            }
            Ok(())
        })
        .unwrap();
        for (index, &a) in occupied.iter().enumerate() {
            assert!(
                occupied.iter().skip(index + 1).all(|&b| !overlap(a, b)),
                "{occupied:?}"
            );
        }
    }
}
