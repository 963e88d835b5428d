//! Map of the modulus |μ| of the dominant Floquet multiplier over spindle speed and axial depth, with the stability
//! limit |μ| = 1.

use plotters::chart::SeriesLabelPosition;
use plotters::prelude::{LineSeries, Rectangle, WHITE};
use plotters::style::{Color, RGBColor};

use super::picture::{Axes, INK, Labels, PictureError, axes, draw, text};
use crate::stability::{CellChart, Verdict};

/// Upper end, colour and name of each band of |μ|: green for stable points (|μ| < 1), red for unstable ones.
const BANDS: [(f64, RGBColor, &str); 9] = [
    (0.7, RGBColor(0x6f, 0xb8, 0x92), "below 0.7"),
    (0.8, RGBColor(0x93, 0xcb, 0xad), "0.7 to 0.8"),
    (0.9, RGBColor(0xb6, 0xdd, 0xc7), "0.8 to 0.9"),
    (1.0, RGBColor(0xdd, 0xf0, 0xe5), "0.9 to 1"),
    (1.1, RGBColor(0xfb, 0xe9, 0xe6), "1 to 1.1"),
    (1.25, RGBColor(0xf5, 0xcf, 0xc9), "1.1 to 1.25"),
    (1.5, RGBColor(0xec, 0xae, 0xa5), "1.25 to 1.5"),
    (2.0, RGBColor(0xde, 0x88, 0x7c), "1.5 to 2"),
    (f64::INFINITY, RGBColor(0xc8, 0x60, 0x53), "above 2"),
];

/// Colour and name of cells of the map whose interval |μ| ± error contains 1, so that stability is undecided.
const UNDECIDED: (RGBColor, &str) = (RGBColor(0x9a, 0xa0, 0xa8), "undecided");

/// Width and height in pixels of the map of Floquet multipliers.
const SIZE: (u32, u32) = (1100, 520);

/// Draws the map of Floquet multipliers as SVG. Speeds and depths must be ascending, at least two of each.
///
/// # Errors
/// Speeds or depths are fewer than two or not ascending, or the drawing library fails.
pub fn cell_map(title: &str, chart: &CellChart) -> Result<String, PictureError> {
    let ascending = |values: &[f64]| values.len() > 1 && values.windows(2).all(|pair| pair[0] < pair[1]);
    let speeds: Vec<f64> = chart.speeds.iter().map(|line| line.rpm).collect();
    if !(ascending(&speeds) && ascending(&chart.depths_mm)) {
        return Err(PictureError::nothing(
            "a map of cells needs at least two speeds and two depths, both ascending",
        ));
    }
    let (columns, rows) = (edges(&speeds), edges(&chart.depths_mm));
    let labels = Labels {
        title,
        x: "spindle speed [rev/min]",
        y: "axial depth of cut [mm]",
    };
    let range = |edges: &[f64]| edges[0]..edges[edges.len() - 1];
    draw(SIZE, |canvas| {
        let mut axes = axes(canvas, &labels, range(&columns), range(&rows))?;
        let looks = BANDS.map(|(_, color, name)| (color, name));
        for (band, (color, name)) in looks.into_iter().chain([UNDECIDED]).enumerate() {
            draw_band(&mut axes, chart, (&columns, &rows), (band, color, name))?;
        }
        for (from, to) in contour(chart, &speeds) {
            axes.draw_series(LineSeries::new([from, to], INK.stroke_width(2)))?;
        }
        axes.configure_series_labels()
            .position(SeriesLabelPosition::UpperRight)
            .background_style(WHITE.mix(0.85))
            .border_style(INK.mix(0.3))
            .label_font(text(12, INK))
            .draw()?;
        Ok(())
    })
}

/// Borders between the cells of the map: midpoints between neighbouring speeds or depths. The outer borders lie half a
/// step outside the first and the last value.
fn edges(values: &[f64]) -> Vec<f64> {
    let count = values.len();
    let mut edges: Vec<f64> = values.windows(2).map(|pair| 0.5 * (pair[0] + pair[1])).collect();
    edges.insert(0, 1.5 * values[0] - 0.5 * values[1]);
    edges.push(1.5 * values[count - 1] - 0.5 * values[count - 2]);
    edges
}

/// Index in [`BANDS`] of the colour band of a cell of the map from its |μ| (modulus of the dominant Floquet
/// multiplier); `BANDS.len()` for undecided cells.
fn band_of(multiplier_abs: f64, verdict: Verdict) -> usize {
    if verdict == Verdict::Undecided {
        return BANDS.len();
    }
    let below = |(end, _, _): &(f64, RGBColor, &str)| multiplier_abs < *end;
    BANDS.iter().position(below).unwrap_or(BANDS.len() - 1)
}

/// Draws the cells of the map whose |μ| lies in one colour band, or the undecided cells; neighbouring cells along the
/// depth become one rectangle.
fn draw_band(
    axes: &mut Axes<'_, '_>,
    chart: &CellChart,
    (columns, rows): (&[f64], &[f64]),
    (band, color, name): (usize, RGBColor, &'static str),
) -> Result<(), PictureError> {
    let mut rectangles = Vec::new();
    for (line, column) in chart.speeds.iter().zip(columns.windows(2)) {
        let bands = line.multiplier_abs.iter().zip(&line.verdict);
        let mut open: Option<f64> = None;
        for ((&size, &verdict), row) in bands.zip(rows.windows(2)) {
            match (band_of(size, verdict) == band, open) {
                (true, None) => open = Some(row[0]),
                (false, Some(from)) => {
                    rectangles.push([(column[0], from), (column[1], row[0])]);
                    open = None;
                }
                _ => {}
            }
        }
        if let (Some(from), Some(last)) = (open, rows.last()) {
            rectangles.push([(column[0], from), (column[1], *last)]);
        }
    }
    if rectangles.is_empty() {
        return Ok(());
    }
    let areas = rectangles
        .into_iter()
        .map(|corners| Rectangle::new(corners, color.filled()));
    axes.draw_series(areas)?
        .label(name)
        .legend(move |(x, y)| Rectangle::new([(x, y - 5), (x + 18, y + 5)], color.filled()));
    Ok(())
}

/// Point of the map: spindle speed in rev/min and axial depth in mm.
type MapPoint = (f64, f64);

/// Contour |μ| = 1 by marching squares: ln |μ| is interpolated linearly between the centres of neighbouring cells.
fn contour(chart: &CellChart, speeds: &[f64]) -> Vec<(MapPoint, MapPoint)> {
    let mut segments = Vec::new();
    let level = |line: usize, depth: usize| {
        let size = chart.speeds.get(line)?.multiplier_abs.get(depth)?;
        Some(((*speeds.get(line)?, *chart.depths_mm.get(depth)?), size.ln()))
    };
    for line in 0..speeds.len() - 1 {
        for depth in 0..chart.depths_mm.len() - 1 {
            let corners = [
                (line, depth),
                (line + 1, depth),
                (line + 1, depth + 1),
                (line, depth + 1),
            ];
            let around: Vec<(MapPoint, f64)> = corners.iter().filter_map(|&(i, j)| level(i, j)).collect();
            let crossings: Vec<MapPoint> = (0..around.len())
                .filter_map(|i| crossing(around[i], around[(i + 1) % around.len()]))
                .collect();
            segments.extend(crossings.chunks_exact(2).map(|pair| (pair[0], pair[1])));
        }
    }
    segments
}

/// Point between two points of the map at which |μ| = 1 (ln |μ| = 0), by linear interpolation; `None` if ln |μ| does
/// not change its sign.
fn crossing((from, a): (MapPoint, f64), (to, b): (MapPoint, f64)) -> Option<MapPoint> {
    let share = ((a > 0.0) != (b > 0.0)).then(|| (a / (a - b)).clamp(0.0, 1.0))?;
    Some((from.0 + (to.0 - from.0) * share, from.1 + (to.1 - from.1) * share))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::stability::{CellLine, Label};

    /// |μ| = depth/2 at every speed.
    fn chart() -> CellChart {
        let depths_mm: Vec<f64> = (0..9).map(|i| 0.5 * f64::from(i)).collect();
        let line = |rpm: f64| CellLine {
            rpm,
            multiplier_abs: depths_mm.iter().map(|depth| 0.5 * depth).collect(),
            error: vec![1e-7; depths_mm.len()],
            verdict: depths_mm
                .iter()
                .map(|depth| Verdict::of(0.5 * depth, 1e-7))
                .collect(),
        };
        CellChart {
            label: Label {
                method: "collocation",
                settings: None,
                blind_to: None,
            },
            speeds: vec![line(1000.0), line(1100.0), line(1200.0)],
            depths_mm,
        }
    }

    #[test]
    fn the_contour_lies_where_the_multiplier_is_1() {
        let chart = chart();
        let segments = contour(&chart, &[1000.0, 1100.0, 1200.0]);
        // The contour lies at a depth of 2 mm, with one segment between each pair of speeds.
        assert_eq!(segments.len(), 2);
        for (from, to) in segments {
            assert!((from.1 - 2.0).abs() < 1e-12 && (to.1 - 2.0).abs() < 1e-12);
            assert!((from.0 - to.0).abs() == 100.0);
        }
    }

    #[test]
    fn the_map_names_its_bands_and_refuses_what_is_no_grid() {
        let mut chart = chart();
        let svg = cell_map("robot", &chart).unwrap();
        for said in ["robot", "below 0.7", "above 2", "undecided", "rev/min"] {
            assert!(svg.contains(said), "{said}");
        }
        // Cells are 0.25 apart in |μ|; the values 1.5 and 1.75 lie in the band from 1.5 to 2.
        assert!(svg.contains("1.5 to 2"));
        chart.speeds.truncate(1);
        assert!(cell_map("robot", &chart).is_err());
    }
}
