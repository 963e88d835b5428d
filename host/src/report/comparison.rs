//! Chart of several lines over one axis: measured signal, residuals, noise level.

use std::ops::Range;

use plotters::prelude::{Circle, LineSeries, PathElement, RGBColor};
use plotters::style::Color;

use super::picture::{
    BLUE, CHATTER, INK, Labels, ORANGE, PictureError, QUIET, VIOLET, axes, draw, legend, span,
};

/// One line or one set of points of a comparison chart.
#[derive(Clone, Debug, PartialEq)]
pub struct Line {
    /// Name in the legend.
    pub name: String,
    /// Points (x, y).
    pub points: Vec<(f64, f64)>,
    /// Meaning of the line in the chart, which sets colour and shape of the line.
    pub role: LineRole,
}

/// Meaning of a line, which sets colour and shape of the line.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LineRole {
    /// Measured signal.
    Measured,
    /// Residual of the baseline model.
    BaselineResidual,
    /// Residual of the extended model.
    ExtendedResidual,
    /// Horizontal line at a constant level, such as the noise level.
    Level,
    /// Points instead of a line.
    Points,
    /// Points of a second quantity in the same chart, in another colour.
    OtherPoints,
}

impl LineRole {
    fn color(self) -> RGBColor {
        match self {
            Self::Measured => INK,
            Self::BaselineResidual => CHATTER,
            Self::ExtendedResidual => QUIET,
            Self::Level => ORANGE,
            Self::Points => BLUE,
            Self::OtherPoints => VIOLET,
        }
    }
}

/// Draws lines over a common axis as SVG of `size` pixels, with the `y_range` of the vertical axis; `None` chooses a
/// range that contains all points.
///
/// # Errors
/// There are fewer than two points, or the drawing library fails.
pub fn comparison(
    size: (u32, u32),
    [title, x, y]: [&str; 3],
    lines: &[Line],
    y_range: Option<Range<f64>>,
) -> Result<String, PictureError> {
    let points = || lines.iter().flat_map(|line| &line.points);
    if points().count() < 2 {
        return Err(PictureError::nothing("a comparison needs points"));
    }
    let (low, high) = points()
        .filter(|point| point.0.is_finite())
        .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), point| {
            (low.min(point.0), high.max(point.0))
        });
    let y_range = y_range.unwrap_or_else(|| span(points().map(|point| point.1)));
    draw(size, |canvas| {
        let mut chart = axes(canvas, &Labels { title, x, y }, low..high, y_range.clone())?;
        for line in lines.iter().filter(|line| !line.points.is_empty()) {
            let color = line.role.color();
            let drawn = if matches!(line.role, LineRole::Points | LineRole::OtherPoints) {
                let dots = line
                    .points
                    .iter()
                    .map(|point| Circle::new(*point, 1, color.mix(0.5).filled()));
                chart.draw_series(dots)?
            } else {
                let style = color.stroke_width(if line.role == LineRole::Level { 2 } else { 1 });
                chart.draw_series(LineSeries::new(line.points.iter().copied(), style))?
            };
            drawn
                .label(line.name.clone())
                .legend(move |(x, y)| PathElement::new([(x, y), (x + 18, y)], color.stroke_width(2)));
        }
        legend(&mut chart)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_line_is_named_and_nothing_is_refused() {
        let line = |name: &str, role| Line {
            name: name.into(),
            points: vec![(0.0, 1.0), (1.0, 2.0)],
            role,
        };
        let lines = [
            line("measured", LineRole::Measured),
            line("missed", LineRole::Points),
        ];
        let svg = comparison((400, 300), ["t", "x", "y"], &lines, None).unwrap();
        assert!(svg.contains("measured") && svg.contains("missed"));
        assert!(comparison((400, 300), ["t", "x", "y"], &[], None).is_err());
    }
}
