//! Samples once per tooth: one line is a quiet cut, two are period doubling, a cloud or a ring is a Hopf.

use plotters::chart::SeriesLabelPosition;
use plotters::prelude::{Circle, PathElement, WHITE};
use plotters::style::{Color, RGBColor};

use super::picture::{BLUE, Canvas, GRID, INK, Labels, ORANGE, PictureError, axes, draw, span, text};

const SIZE: (u32, u32) = (470, 330);

/// Draws samples once per tooth over the count of teeth as SVG; even and odd teeth have their own colour.
///
/// # Errors
/// Where there is nothing to draw, or the drawing library refuses.
pub fn samples_per_tooth(title: &str, quantity: &str, samples: &[f64]) -> Result<String, PictureError> {
    enough(samples)?;
    let labels = Labels {
        title,
        x: "tooth passes",
        y: quantity,
    };
    let points: Vec<(f64, f64)> = samples
        .iter()
        .enumerate()
        .map(|(k, &value)| (k as f64, value))
        .collect();
    draw(SIZE, |canvas| {
        scatter(canvas, &labels, &points, 0.0..samples.len() as f64)
    })
}

/// Draws each sample over the one before (the stroboscopic map) as SVG.
///
/// # Errors
/// Where there is nothing to draw, or the drawing library refuses.
pub fn stroboscopic_map(title: &str, quantity: &str, samples: &[f64]) -> Result<String, PictureError> {
    enough(samples)?;
    let x = format!("{quantity}, one tooth before");
    let labels = Labels {
        title,
        x: &x,
        y: quantity,
    };
    let points: Vec<(f64, f64)> = samples.windows(2).map(|pair| (pair[0], pair[1])).collect();
    let range = span(samples.iter().copied());
    draw(SIZE, |canvas| scatter(canvas, &labels, &points, range))
}

fn enough(samples: &[f64]) -> Result<(), PictureError> {
    if samples.len() < 2 {
        return Err(PictureError::nothing(
            "a stroboscopic picture needs at least two samples",
        ));
    }
    Ok(())
}

fn scatter(
    canvas: &Canvas<'_>,
    labels: &Labels<'_>,
    points: &[(f64, f64)],
    x: std::ops::Range<f64>,
) -> Result<(), PictureError> {
    let mut y = span(points.iter().map(|&(_, value)| value));
    // Room for the legend above the samples.
    y.end += 0.25 * (y.end - y.start);
    let mut chart = axes(canvas, labels, x, y)?;
    let kinds: [(usize, RGBColor, &str); 2] = [(0, BLUE, "even teeth"), (1, ORANGE, "odd teeth")];
    for (parity, color, name) in kinds {
        let own = points.iter().skip(parity).step_by(2);
        chart
            .draw_series(own.map(|&at| Circle::new(at, 2, color.filled())))?
            .label(name)
            .legend(move |(x, y)| PathElement::new([(x + 4, y), (x + 14, y)], color.stroke_width(4)));
    }
    chart
        .configure_series_labels()
        .position(SeriesLabelPosition::UpperRight)
        .background_style(WHITE.mix(0.8))
        .border_style(GRID)
        .label_font(text(12, INK))
        .draw()?;
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_sample_is_drawn_once() {
        let samples: Vec<f64> = (0..40).map(|k| if k % 2 == 0 { 1.0 } else { -1.0 }).collect();
        let over_time = samples_per_tooth("s", "a [m/s²]", &samples).unwrap();
        assert_eq!(over_time.matches("<circle").count(), 40);
        let map = stroboscopic_map("s", "a [m/s²]", &samples).unwrap();
        assert_eq!(map.matches("<circle").count(), 39);
        assert!(samples_per_tooth("s", "a", &[1.0]).is_err());
    }
}
