//! Chart of mode shapes over points.

use plotters::prelude::{Circle, LineSeries, PathElement};
use plotters::style::Color;

use super::picture::{BLUE, INK, Labels, PictureError, axes, draw, label};

/// A mode shape over places.
#[derive(Clone, Debug, PartialEq)]
pub struct DrawnShape {
    /// Title above the panel, such as the natural frequency.
    pub title: String,
    /// Names of the places.
    pub names: Vec<String>,
    /// 90 % interval of the entry at each place, relative to the largest entry.
    pub intervals: Vec<[f64; 2]>,
}

/// Width of the chart and height of the panel of each mode in pixels.
const SIZE: (u32, u32) = (900, 240);

/// Draws the entries of each shape over the numbers of the places, as SVG, one panel for each mode; the names of the places stand below the line.
///
/// # Errors
/// There is no mode, or the drawing library fails.
pub fn shape_chart(shapes: &[DrawnShape]) -> Result<String, PictureError> {
    if shapes.is_empty() {
        return Err(PictureError::nothing("a picture of mode shapes needs a mode"));
    }
    draw((SIZE.0, SIZE.1 * shapes.len() as u32), |canvas| {
        for (panel, shape) in canvas.split_evenly((shapes.len(), 1)).iter().zip(shapes) {
            let labels = Labels {
                title: &shape.title,
                x: "place",
                y: "shape",
            };
            let count = shape.intervals.len() as f64;
            let mut chart = axes(panel, &labels, 0.5..count + 0.5, -1.25..1.25)?;
            let middle = |(index, [low, high]): (usize, &[f64; 2])| (index as f64 + 1.0, 0.5 * (low + high));
            let points: Vec<(f64, f64)> = shape.intervals.iter().enumerate().map(middle).collect();
            chart.draw_series(LineSeries::new(
                [(0.5, 0.0), (count + 0.5, 0.0)],
                INK.stroke_width(1),
            ))?;
            chart.draw_series(LineSeries::new(points.clone(), BLUE.stroke_width(1)))?;
            chart.draw_series(points.iter().map(|point| Circle::new(*point, 3, BLUE.filled())))?;
            chart.draw_series(shape.intervals.iter().zip(&points).map(|([low, high], (x, _))| {
                PathElement::new([(*x, *low), (*x, *high)], BLUE.stroke_width(2))
            }))?;
            let origin = panel.get_base_pixel();
            for (name, (x, _)) in shape.names.iter().zip(&points) {
                let at = chart.backend_coord(&(*x, -1.0));
                label(panel, (at.0 - origin.0, at.1 - origin.1), name, INK)?;
            }
        }
        Ok(())
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_mode_and_place_is_drawn_and_none_is_refused() {
        let shape = DrawnShape {
            title: "812.0 Hz".into(),
            names: vec!["tip x".into(), "rib x".into()],
            intervals: vec![[0.98, 1.02], [-0.5, -0.4]],
        };
        let svg = shape_chart(&[shape]).unwrap();
        for words in ["812.0 Hz", "tip x", "rib x"] {
            assert!(svg.contains(words), "{words}");
        }
        assert!(shape_chart(&[]).is_err());
    }
}
