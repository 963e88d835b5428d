//! Chart of a test plan over the spindle speed: the stability limit of the case, its 90 % intervals before and after
//! the planned tests, and marks for the tests that bracket the limit by trial cuts.

use plotters::chart::SeriesLabelPosition;
use plotters::prelude::{LineSeries, PathElement, Polygon, Rectangle, WHITE};
use plotters::style::{Color, RGBColor};

use super::marks::{Mark, MarkKind, draw_marks};
use super::picture::{Axes, BLUE, INK, Labels, PictureError, axes, draw, text};
use crate::plan::{Plan, Speed, Test};

/// Width and height in pixels of the chart of a test plan.
const SIZE: (u32, u32) = (960, 480);

/// Draws the chart of a test plan as SVG, with axial depths from 0 to `depth_max_mm`; the spindle speeds of the plan
/// may stand in any order.
///
/// # Errors
/// The plan has fewer than two different spindle speeds, or the drawing library fails.
pub fn plan_chart(title: &str, plan: &Plan, depth_max_mm: f64) -> Result<String, PictureError> {
    let mut speeds = plan.chart.clone();
    speeds.sort_by(|a, b| a.rpm.total_cmp(&b.rpm));
    let (Some(first), Some(last)) = (speeds.first(), speeds.last()) else {
        return Err(PictureError::nothing("a chart needs at least two speeds"));
    };
    if last.rpm <= first.rpm {
        return Err(PictureError::nothing("a chart needs at least two speeds"));
    }
    let labels = Labels {
        title,
        x: "spindle speed [rev/min]",
        y: "axial depth of cut [mm]",
    };
    let brackets = plan
        .tests
        .iter()
        .enumerate()
        .filter_map(|(index, step)| match step.test {
            Test::Cuts { rpm, about_mm, .. } => Some(Mark {
                rpm,
                depth_mm: about_mm.min(depth_max_mm),
                kind: MarkKind::Quiet,
                label: format!("test {}: {} cuts", index + 1, step.cuts_or_tests),
                advice: None,
                wrong: false,
            }),
            _ => None,
        });
    let marks: Vec<Mark> = brackets.collect();
    draw(SIZE, |canvas| {
        let mut chart = axes(canvas, &labels, first.rpm..last.rpm, 0.0..depth_max_mm)?;
        let before = Band {
            interval: |speed| speed.before_mm,
            color: INK,
            opacity: 0.14,
            name: "90 % interval before the tests",
        };
        let after = Band {
            interval: |speed| speed.after_mm,
            color: BLUE,
            opacity: 0.45,
            name: "90 % interval after the tests",
        };
        for band in [before, after] {
            draw_band(&mut chart, &speeds, depth_max_mm, &band)?;
        }
        let limits = speeds
            .iter()
            .map(|speed| (speed.rpm, speed.limit_mm.min(depth_max_mm)));
        chart
            .draw_series(LineSeries::new(limits, INK.stroke_width(2)))?
            .label("limit of the case")
            .legend(|(x, y)| PathElement::new([(x, y), (x + 18, y)], INK.stroke_width(2)));
        draw_marks(canvas, &mut chart, &marks)?;
        chart
            .configure_series_labels()
            .position(SeriesLabelPosition::UpperLeft)
            .background_style(WHITE.mix(0.85))
            .border_style(INK.mix(0.3))
            .label_font(text(13, INK))
            .draw()?;
        Ok(())
    })
}

/// Shaded area of the chart between a lower and an upper axial depth at each spindle speed.
struct Band {
    interval: fn(&Speed) -> [f64; 2],
    color: RGBColor,
    opacity: f64,
    name: &'static str,
}

fn draw_band(
    chart: &mut Axes<'_, '_>,
    speeds: &[Speed],
    depth_max_mm: f64,
    band: &Band,
) -> Result<(), PictureError> {
    let end = |index: usize| {
        speeds
            .iter()
            .map(move |speed| (speed.rpm, (band.interval)(speed)[index].clamp(0.0, depth_max_mm)))
    };
    let outline: Vec<(f64, f64)> = end(0).chain(end(1).rev()).collect();
    let fill = band.color.mix(band.opacity);
    chart
        .draw_series([Polygon::new(outline, fill)])?
        .label(band.name)
        .legend(move |(x, y)| Rectangle::new([(x, y - 4), (x + 18, y + 4)], fill.filled()));
    Ok(())
}
