//! Chart of receptances before and after a change, such as of a tool.

use plotters::prelude::{LineSeries, PathElement};
use plotters::style::Color;

use super::picture::{BLUE, Labels, ORANGE, PictureError, axes, draw, legend, span};
use crate::frf::{Frf, FrfTable};

/// Width of the chart and height of each of its panels in pixels.
const SIZE: (u32, u32) = (900, 300);

/// Draws the magnitude, in µm/N, of each receptance that both tables have, as SVG: one panel for each receptance, with
/// one curve from each table.
///
/// # Errors
/// The tables have no receptance in common, or the drawing library fails.
pub fn frf_comparison_chart(before: &FrfTable, after: &FrfTable) -> Result<String, PictureError> {
    let pairs: Vec<(&Frf, &Frf)> = before
        .entries()
        .iter()
        .filter_map(|entry| Some((entry, after.entry(entry.response, entry.force)?)))
        .collect();
    if pairs.is_empty() {
        return Err(PictureError::nothing(
            "a comparison needs a receptance that both tables have",
        ));
    }
    let points = |table: &FrfTable, entry: &Frf| -> Vec<(f64, f64)> {
        let sizes = entry.receptance.iter().map(|h| 1e6 * h.norm());
        table.frequency_hz().iter().copied().zip(sizes).collect()
    };
    draw((SIZE.0, SIZE.1 * pairs.len() as u32), |canvas| {
        let panels = canvas.split_evenly((pairs.len(), 1));
        for (panel, (old, new)) in panels.iter().zip(&pairs) {
            let drawn = [
                ("before", BLUE, points(before, old)),
                ("after", ORANGE, points(after, new)),
            ];
            let all = || drawn.iter().flat_map(|(_, _, points)| points);
            let x = span(all().map(|point| point.0));
            let top = span(all().map(|point| point.1)).end;
            let title = format!("H{}", old.name());
            let labels = Labels {
                title: &title,
                x: "frequency [Hz]",
                y: "receptance [µm/N]",
            };
            let mut chart = axes(panel, &labels, x, 0.0..top)?;
            for (name, color, points) in drawn.clone() {
                chart
                    .draw_series(LineSeries::new(points, color.stroke_width(2)))?
                    .label(name)
                    .legend(move |(x, y)| PathElement::new([(x, y), (x + 18, y)], color.stroke_width(2)));
            }
            legend(&mut chart)?;
        }
        Ok(())
    })
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use num_complex::Complex64;

    use super::*;
    use crate::structure::Direction;

    #[test]
    fn both_tables_are_drawn_and_nothing_in_common_is_refused() {
        let table = |force| {
            let entry = Frf {
                response: Direction::X,
                force,
                receptance: vec![Complex64::new(1e-6, 0.0), Complex64::new(0.0, -2e-6)],
                coherence: None,
                folding: None,
            };
            FrfTable::new(Path::new("a.csv"), vec![10.0, 20.0], vec![entry]).unwrap()
        };
        let svg = frf_comparison_chart(&table(Direction::X), &table(Direction::X)).unwrap();
        for words in ["Hxx", "before", "after", "receptance [µm/N]"] {
            assert!(svg.contains(words), "{words}");
        }
        assert!(frf_comparison_chart(&table(Direction::X), &table(Direction::Y)).is_err());
    }
}
