//! Chart of receptances: magnitude, phase and coherence over frequency.

use plotters::chart::SeriesLabelPosition;
use plotters::prelude::{LineSeries, PathElement, RGBColor, WHITE};
use plotters::style::Color;

use super::picture::{
    BLUE, CHATTER, Canvas, GRID, INK, Labels, ORANGE, PictureError, QUIET, VIOLET, axes, draw, span, text,
};
use crate::frf::{Frf, FrfTable};

/// Width and height in pixels of the chart of receptances.
const SIZE: (u32, u32) = (900, 860);

/// Colours of the receptances in the chart, used cyclically.
const COLORS: [RGBColor; 6] = [BLUE, ORANGE, QUIET, CHATTER, VIOLET, INK];

/// Draws magnitude in µm/N, phase in degrees and, where known, coherence of all receptances of a table as SVG.
///
/// # Errors
/// The table has fewer than two frequencies, or the drawing library fails.
pub fn frf_chart(title: &str, table: &FrfTable) -> Result<String, PictureError> {
    let frequency_hz = table.frequency_hz();
    let (Some(&first), Some(&last)) = (frequency_hz.first(), frequency_hz.last()) else {
        return Err(PictureError::nothing("a chart of FRFs needs two frequencies"));
    };
    if first >= last {
        return Err(PictureError::nothing("a chart of FRFs needs two frequencies"));
    }
    let has_coherence = table.entries().iter().any(|entry| entry.coherence.is_some());
    draw(SIZE, |canvas| {
        let panels = canvas.split_evenly((if has_coherence { 3 } else { 2 }, 1));
        let panel = |index: usize, labels: Labels<'_>, range, value: &dyn Fn(&Frf) -> Vec<f64>| {
            lines(&panels[index], table, &labels, range, value, index == 0)
        };
        let magnitude = |entry: &Frf| entry.receptance.iter().map(|h| 1e6 * h.norm()).collect();
        let top = span(table.entries().iter().flat_map(magnitude)).end;
        let labels = |title, y| Labels {
            title,
            x: "frequency [Hz]",
            y,
        };
        panel(0, labels(title, "receptance [µm/N]"), 0.0..top, &magnitude)?;
        let phase = |entry: &Frf| entry.receptance.iter().map(|h| h.arg().to_degrees()).collect();
        panel(1, labels("", "phase [°]"), -185.0..185.0, &phase)?;
        if has_coherence {
            let coherence = |entry: &Frf| entry.coherence.clone().unwrap_or_default();
            panel(2, labels("", "coherence"), 0.0..1.03, &coherence)?;
        }
        Ok(())
    })
}

/// Draws one panel of the chart: magnitude, phase or coherence of every receptance over frequency.
fn lines(
    canvas: &Canvas<'_>,
    table: &FrfTable,
    labels: &Labels<'_>,
    range: std::ops::Range<f64>,
    value: &dyn Fn(&Frf) -> Vec<f64>,
    with_names: bool,
) -> Result<(), PictureError> {
    let frequency_hz = table.frequency_hz();
    let (first, last) = (frequency_hz[0], frequency_hz[frequency_hz.len() - 1]);
    let mut chart = axes(canvas, labels, first..last, range)?;
    for (entry, color) in table.entries().iter().zip(COLORS.into_iter().cycle()) {
        let points = frequency_hz.iter().copied().zip(value(entry));
        let series = chart.draw_series(LineSeries::new(points, color.stroke_width(2)))?;
        if with_names {
            series
                .label(format!("H{}", entry.name()))
                .legend(move |(x, y)| PathElement::new([(x, y), (x + 18, y)], color.stroke_width(2)));
        }
    }
    if with_names {
        chart
            .configure_series_labels()
            .position(SeriesLabelPosition::UpperRight)
            .background_style(WHITE.mix(0.8))
            .border_style(GRID)
            .label_font(text(12, INK))
            .draw()?;
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use num_complex::Complex64;

    use super::*;
    use crate::structure::Direction;

    #[test]
    fn every_receptance_is_named_and_coherence_drawn_where_it_is_known() {
        let entry = |response, coherence: Option<Vec<f64>>| Frf {
            response,
            force: Direction::X,
            receptance: vec![Complex64::new(1e-6, 0.0), Complex64::new(0.0, -2e-6)],
            coherence,
            folding: None,
        };
        let table = |coherence: Option<Vec<f64>>| {
            let entries = vec![entry(Direction::X, coherence), entry(Direction::Y, None)];
            FrfTable::new(Path::new("a.csv"), vec![10.0, 20.0], entries).unwrap()
        };
        let svg = frf_chart("FRF", &table(Some(vec![1.0, 0.5]))).unwrap();
        for words in ["Hxx", "Hyx", "receptance [µm/N]", "phase", "coherence"] {
            assert!(svg.contains(words), "{words}");
        }
        assert!(!frf_chart("FRF", &table(None)).unwrap().contains("coherence"));
        let point = FrfTable::new(
            Path::new("a.csv"),
            vec![1.0],
            vec![Frf {
                receptance: vec![Complex64::ONE],
                ..entry(Direction::X, None)
            }],
        );
        assert!(frf_chart("FRF", &point.unwrap()).is_err());
    }
}
