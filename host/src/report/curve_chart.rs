//! Curves of torus, flip and fold in the plane of two parameters.

use plotters::prelude::{Circle, DashedLineSeries, LineSeries, PathElement};
use plotters::style::{Color, RGBColor};

use super::branch_chart::look;
use super::picture::{Axes, Canvas, INK, Labels, PictureError, axes, draw, label, legend};
use crate::orbit::Parameter;
use crate::orbit::curve::{Curve, CurvePoint};
use crate::stability::StabilityLoss;

/// Width and height in pixels of the chart.
const SIZE: (u32, u32) = (960, 480);

/// Axis of a chart of curves.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CurveAxis {
    /// Parameter along the axis.
    pub parameter: Parameter,
    /// Its first and last value.
    pub range: [f64; 2],
}

impl CurveAxis {
    fn span(&self) -> std::ops::Range<f64> {
        self.range[0].min(self.range[1])..self.range[0].max(self.range[1])
    }
}

/// Draws curves in the plane of two axes, the horizontal and the vertical one: solid where they bound stable orbits,
/// dashed where the orbits are unstable on both sides.
///
/// # Errors
/// A range has no length, or the drawing library fails.
pub fn curve_chart(title: &str, curves: &[Curve], plane: [CurveAxis; 2]) -> Result<String, PictureError> {
    let [horizontal, vertical] = plane;
    if horizontal.span().is_empty() || vertical.span().is_empty() {
        return Err(PictureError::nothing("a chart of curves needs two ranges"));
    }
    let labels = Labels {
        title,
        x: horizontal.parameter.label(),
        y: vertical.parameter.label(),
    };
    let at = |point: &CurvePoint| {
        let setting = &point.setting;
        (setting.get(horizontal.parameter), setting.get(vertical.parameter))
    };
    draw(SIZE, |canvas| {
        let mut chart = axes(canvas, &labels, horizontal.span(), vertical.span())?;
        let mut named = Vec::new();
        for curve in curves {
            let (color, name) = look(curve.kind);
            for (is_bound, points) in parts(curve, at) {
                draw_part(&mut chart, (is_bound, color), points)?;
            }
            if !named.contains(&curve.kind) {
                named.push(curve.kind);
                name_kind(&mut chart, curve.kind, name)?;
            }
        }
        name_dashes(&mut chart, curves)?;
        for curve in curves {
            draw_resonances(canvas, &mut chart, curve, at)?;
        }
        legend(&mut chart)
    })
}

/// Parts of a curve: true and its points where it bounds stable orbits, otherwise false. Neighbouring parts share a
/// point.
fn parts(curve: &Curve, at: impl Fn(&CurvePoint) -> (f64, f64)) -> Vec<(bool, Vec<(f64, f64)>)> {
    let mut parts: Vec<(bool, Vec<(f64, f64)>)> = Vec::new();
    for point in &curve.points {
        let (is_bound, here) = (point.outside == 0, at(point));
        match parts.last_mut() {
            Some((last, points)) if *last == is_bound => points.push(here),
            Some((_, points)) => {
                points.push(here);
                parts.push((is_bound, vec![here]));
            }
            None => parts.push((is_bound, vec![here])),
        }
    }
    parts
}

fn draw_part(
    chart: &mut Axes<'_, '_>,
    (is_bound, color): (bool, RGBColor),
    points: Vec<(f64, f64)>,
) -> Result<(), PictureError> {
    if is_bound {
        chart.draw_series(LineSeries::new(points, color.stroke_width(3)))?;
    } else {
        chart.draw_series(DashedLineSeries::new(points, 6, 5, color.stroke_width(2)))?;
    }
    Ok(())
}

fn name_kind(chart: &mut Axes<'_, '_>, kind: StabilityLoss, name: &str) -> Result<(), PictureError> {
    let (color, _) = look(kind);
    let nothing: [(f64, f64); 0] = [];
    chart
        .draw_series(LineSeries::new(nothing, color.stroke_width(3)))?
        .label(name)
        .legend(move |(x, y)| PathElement::new([(x, y), (x + 18, y)], color.stroke_width(3)));
    Ok(())
}

/// Explains dashes in the legend, if a part of a curve is dashed.
fn name_dashes(chart: &mut Axes<'_, '_>, curves: &[Curve]) -> Result<(), PictureError> {
    let is_dashed = curves
        .iter()
        .flat_map(|curve| &curve.points)
        .any(|point| point.outside != 0);
    if is_dashed {
        let nothing: [(f64, f64); 0] = [];
        chart
            .draw_series(LineSeries::new(nothing, INK.stroke_width(2)))?
            .label("dashed: of unstable orbits")
            .legend(|(x, y)| PathElement::new([(x, y), (x + 6, y)], INK.stroke_width(2)));
    }
    Ok(())
}

/// Marks the strong resonances 1:3 and 1:4 on a torus curve.
fn draw_resonances(
    canvas: &Canvas<'_>,
    chart: &mut Axes<'_, '_>,
    curve: &Curve,
    at: impl Fn(&CurvePoint) -> (f64, f64),
) -> Result<(), PictureError> {
    let (color, _) = look(curve.kind);
    for resonance in &curve.resonances {
        let here = at(&resonance.point);
        chart.draw_series([Circle::new(here, 4, color.filled())])?;
        let (x, y) = chart.backend_coord(&here);
        let origin = canvas.get_base_pixel();
        let words = format!("1:{}", resonance.q);
        label(canvas, (x - origin.0 + 8, y - origin.1 - 16), &words, color)?;
    }
    Ok(())
}
