//! SVG pictures with common fonts, colours, axes and legends.

use plotters::chart::{ChartBuilder, ChartContext, SeriesLabelPosition};
use plotters::coord::Shift;
use plotters::coord::types::RangedCoordf64;
use plotters::drawing::{DrawingArea, DrawingAreaErrorKind, IntoDrawingArea};
use plotters::prelude::{Cartesian2d, RGBColor, Rectangle, SVGBackend, Text, WHITE};
use plotters::style::{Color, IntoFont, TextStyle};

/// Failure to draw a picture.
#[derive(Debug, thiserror::Error)]
#[error("cannot draw the picture: {0}")]
pub struct PictureError(String);

impl<E: std::error::Error + Send + Sync> From<DrawingAreaErrorKind<E>> for PictureError {
    fn from(error: DrawingAreaErrorKind<E>) -> Self {
        Self(error.to_string())
    }
}

impl PictureError {
    /// Error of a picture for which data are missing; `what` states the needed data.
    pub(super) fn nothing(what: &str) -> Self {
        Self(what.into())
    }
}

/// Drawing area of an SVG picture.
pub(super) type Canvas<'a> = DrawingArea<SVGBackend<'a>, Shift>;
/// Pair of Cartesian axes on a canvas.
pub(super) type Axes<'a, 'c> = ChartContext<'c, SVGBackend<'a>, Cartesian2d<RangedCoordf64, RangedCoordf64>>;

pub(super) const INK: RGBColor = RGBColor(0x26, 0x2b, 0x33);
pub(super) const GRID: RGBColor = RGBColor(0xdd, 0xe0, 0xe4);
pub(super) const QUIET: RGBColor = RGBColor(0x1b, 0x86, 0x4e);
pub(super) const CHATTER: RGBColor = RGBColor(0xc2, 0x2f, 0x2f);
pub(super) const BLUE: RGBColor = RGBColor(0x1f, 0x5f, 0xa8);
pub(super) const ORANGE: RGBColor = RGBColor(0xd9, 0x7a, 0x12);
pub(super) const VIOLET: RGBColor = RGBColor(0x7a, 0x3f, 0xa0);

/// Text style of labels with a font size in pixels.
pub(super) fn text(size: u32, color: RGBColor) -> TextStyle<'static> {
    let mut style = TextStyle::from(("sans-serif", size).into_font());
    style.color = color.to_backend_color();
    style
}

/// Draws the legend in the upper right corner of the axes.
pub(super) fn legend<'a: 'c, 'c>(chart: &mut Axes<'a, 'c>) -> Result<(), PictureError> {
    legend_at(chart, SeriesLabelPosition::UpperRight)
}

/// Draws the legend at a position of the axes.
pub(super) fn legend_at<'a: 'c, 'c>(
    chart: &mut Axes<'a, 'c>,
    position: SeriesLabelPosition,
) -> Result<(), PictureError> {
    chart
        .configure_series_labels()
        .position(position)
        .background_style(WHITE.mix(0.8))
        .border_style(GRID)
        .label_font(text(12, INK))
        .draw()?;
    Ok(())
}

/// Draws on a white canvas of width and height `size`, in pixels, and returns the SVG text.
pub(super) fn draw(
    size: (u32, u32),
    paint: impl FnOnce(&Canvas<'_>) -> Result<(), PictureError>,
) -> Result<String, PictureError> {
    let mut svg = String::new();
    {
        let canvas = SVGBackend::with_string(&mut svg, size).into_drawing_area();
        canvas.fill(&WHITE)?;
        paint(&canvas)?;
        canvas.present()?;
    }
    Ok(svg)
}

/// Title and axis labels of a chart.
pub(super) struct Labels<'a> {
    /// Title above the chart; empty for none.
    pub(super) title: &'a str,
    /// Quantity and unit of the horizontal axis.
    pub(super) x: &'a str,
    /// Quantity and unit of the vertical axis.
    pub(super) y: &'a str,
}

/// Draws axes over the ranges `x` and `y` with grid and labels.
pub(super) fn axes<'a, 'c>(
    canvas: &'c Canvas<'a>,
    labels: &Labels<'_>,
    x: std::ops::Range<f64>,
    y: std::ops::Range<f64>,
) -> Result<Axes<'a, 'c>, PictureError> {
    let mut builder = ChartBuilder::on(canvas);
    builder
        .margin(10)
        .margin_right(22)
        .x_label_area_size(44)
        .y_label_area_size(62);
    if !labels.title.is_empty() {
        builder.caption(labels.title, text(17, INK));
    }
    let mut chart = builder.build_cartesian_2d(x, y)?;
    chart
        .configure_mesh()
        .axis_style(INK.mix(0.7))
        .bold_line_style(GRID)
        .light_line_style(WHITE.mix(0.0))
        .label_style(text(13, INK))
        .axis_desc_style(text(14, INK))
        .x_desc(labels.x)
        .y_desc(labels.y)
        .x_label_formatter(&tick)
        .y_label_formatter(&tick)
        .draw()?;
    Ok(chart)
}

/// Draws a word on a white background of 80 % opacity, so that lines below it are faint; `at` is the upper left corner
/// of the word in pixels.
pub(super) fn label(
    canvas: &Canvas<'_>,
    at: (i32, i32),
    word: &str,
    color: RGBColor,
) -> Result<(), PictureError> {
    let style = text(13, color);
    let (width, height) = canvas.estimate_text_size(word, &style)?;
    let background = [
        (at.0 - 2, at.1 - 1),
        (at.0 + width as i32 + 3, at.1 + height as i32 + 2),
    ];
    canvas.draw(&Rectangle::new(background, WHITE.mix(0.8).filled()))?;
    canvas.draw(&Text::new(word, at, style))?;
    Ok(())
}

/// Formats a number at a tick of an axis: rounded to four decimals; with an exponent and two significant digits below
/// 0.001 and from a million on; as 0 below 1e-12. The bounds are those of its absolute value.
fn tick(value: &f64) -> String {
    let size = value.abs();
    if size < 1e-12 {
        "0".into()
    } else if (1e-3..1e6).contains(&size) {
        format!("{}", (value * 1e4).round() / 1e4)
    } else {
        format!("{value:.1e}")
    }
}

/// Range of an axis: all finite values plus a margin of 6 % of their range at both ends. If all values are equal, the
/// margin is half their absolute value, at least 5e-7; without finite values the range is −1 to 1.
pub(super) fn span(values: impl Iterator<Item = f64>) -> std::ops::Range<f64> {
    let (low, high) = values
        .filter(|value| value.is_finite())
        .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), value| {
            (low.min(value), high.max(value))
        });
    if low > high {
        return -1.0..1.0;
    }
    let margin = if high > low {
        0.06 * (high - low)
    } else {
        0.5 * high.abs().max(1e-6)
    };
    low - margin..high + margin
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ticks_have_no_rounding_digits_and_ranges_have_a_margin() {
        assert_eq!(tick(&0.30000000000000004), "0.3");
        assert_eq!(tick(&-0.0), "0");
        assert_eq!(tick(&-1.1e-16), "0");
        assert_eq!(tick(&2.5e-5), "2.5e-5");
        assert_eq!(span([1.0, f64::NAN, 3.0].into_iter()), 0.88..3.12);
        assert_eq!(span(std::iter::empty()), -1.0..1.0);
        let flat = span([2.0].into_iter());
        assert!(flat.start < 2.0 && flat.end > 2.0);
    }

    #[test]
    fn a_picture_is_one_svg_element() {
        let svg = draw((400, 300), |canvas| {
            axes(
                canvas,
                &Labels {
                    title: "t",
                    x: "x",
                    y: "y",
                },
                0.0..1.0,
                0.0..1.0,
            )
            .map(|_| ())
        })
        .unwrap();
        assert_eq!(svg.matches("<svg").count(), 1);
        assert!(svg.trim_end().ends_with("</svg>"));
    }
}
