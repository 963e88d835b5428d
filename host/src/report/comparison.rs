//! Several lines over one axis: what was measured beside what was predicted.

use std::ops::Range;

use plotters::prelude::{Circle, LineSeries, PathElement, RGBColor};
use plotters::style::Color;

use super::picture::{
    BLUE, CHATTER, INK, Labels, ORANGE, PictureError, QUIET, VIOLET, axes, draw, legend, span,
};

/// One line, or one cloud of points.
#[derive(Clone, Debug, PartialEq)]
pub struct Line {
    /// What it is.
    pub name: String,
    /// Its points.
    pub points: Vec<(f64, f64)>,
    /// How it is drawn.
    pub look: Look,
}

/// The looks of lines.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Look {
    /// What was measured.
    Measured,
    /// What the model misses.
    Missed,
    /// What is left with the cause.
    Left,
    /// A level.
    Level,
    /// Points of what the model misses.
    Cloud,
    /// Points of something else of the same kind.
    OtherCloud,
}

impl Look {
    fn color(self) -> RGBColor {
        match self {
            Self::Measured => INK,
            Self::Missed => CHATTER,
            Self::Left => QUIET,
            Self::Level => ORANGE,
            Self::Cloud => BLUE,
            Self::OtherCloud => VIOLET,
        }
    }
}

/// Draws lines over a common axis as SVG of `size` pixels.
///
/// # Errors
/// Where there is nothing to draw, or the drawing library refuses.
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
            let color = line.look.color();
            let drawn = if matches!(line.look, Look::Cloud | Look::OtherCloud) {
                let dots = line
                    .points
                    .iter()
                    .map(|point| Circle::new(*point, 1, color.mix(0.5).filled()));
                chart.draw_series(dots)?
            } else {
                let style = color.stroke_width(if line.look == Look::Level { 2 } else { 1 });
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
        let line = |name: &str, look| Line {
            name: name.into(),
            points: vec![(0.0, 1.0), (1.0, 2.0)],
            look,
        };
        let lines = [line("measured", Look::Measured), line("missed", Look::Cloud)];
        let svg = comparison((400, 300), ["t", "x", "y"], &lines, None).unwrap();
        assert!(svg.contains("measured") && svg.contains("missed"));
        assert!(comparison((400, 300), ["t", "x", "y"], &[], None).is_err());
    }
}
