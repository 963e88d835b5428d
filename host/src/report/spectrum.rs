//! Amplitude spectrum with marks at the harmonics of the tooth-passing frequency and at the chatter frequency.

use plotters::prelude::{LineSeries, PathElement, Polygon};
use plotters::style::Color;

use super::picture::{BLUE, CHATTER, Labels, ORANGE, PictureError, axes, draw, label, legend, span};

/// Width and height in pixels of the picture of a spectrum.
const SIZE: (u32, u32) = (470, 330);

/// Frequencies that are marked in the picture of a spectrum, Hz.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct SpectrumMarks {
    /// Tooth-passing frequency, Hz; thin lines mark it and its harmonics. `None` for no lines.
    pub tooth_passing_hz: Option<f64>,
    /// Chatter frequency, Hz; `None` for no mark.
    pub chatter_hz: Option<f64>,
}

/// Draws amplitudes in m/s² over the ascending frequencies `frequency_hz` (equally many) up to `last_hz` as SVG.
///
/// # Errors
/// There are fewer than two frequencies up to `last_hz`, or the drawing library fails.
pub fn spectrum(
    title: &str,
    frequency_hz: &[f64],
    amplitude: &[f64],
    last_hz: f64,
    marks: SpectrumMarks,
) -> Result<String, PictureError> {
    let line: Vec<(f64, f64)> = frequency_hz
        .iter()
        .copied()
        .zip(amplitude.iter().copied())
        .take_while(|&(hertz, _)| hertz <= last_hz)
        .collect();
    if line.len() < 2 {
        return Err(PictureError::nothing("a spectrum needs at least two frequencies"));
    }
    let top = 1.12 * span(line.iter().map(|&(_, value)| value)).end.max(0.0);
    let labels = Labels {
        title,
        x: "frequency [Hz]",
        y: "acceleration [m/s²]",
    };
    draw(SIZE, |canvas| {
        let mut chart = axes(canvas, &labels, 0.0..last_hz, 0.0..top)?;
        if let Some(tooth_hz) = marks.tooth_passing_hz.filter(|hertz| *hertz > 0.0) {
            let harmonics = (1..)
                .map(|k| f64::from(k) * tooth_hz)
                .take_while(|&hertz| hertz <= last_hz);
            chart
                .draw_series(harmonics.map(|hertz| {
                    PathElement::new([(hertz, 0.0), (hertz, top)], ORANGE.mix(0.7).stroke_width(1))
                }))?
                .label("tooth passing and harmonics")
                .legend(|(x, y)| PathElement::new([(x, y), (x + 18, y)], ORANGE.stroke_width(2)));
        }
        chart.draw_series(LineSeries::new(line.iter().copied(), BLUE.stroke_width(2)))?;
        if let Some(chatter_hz) = marks.chatter_hz.filter(|hertz| (0.0..=last_hz).contains(hertz)) {
            let near = |a: &f64, b: &f64| (a - chatter_hz).abs().total_cmp(&(b - chatter_hz).abs());
            let nearest = line.iter().min_by(|a, b| near(&a.0, &b.0));
            let height = nearest.map_or(top, |&(_, value)| value);
            let (x, y) = chart.backend_coord(&(chatter_hz, height));
            canvas.draw(&Polygon::new(
                [(x, y - 3), (x - 5, y - 13), (x + 5, y - 13)],
                CHATTER,
            ))?;
            label(
                canvas,
                (x + 9, y - 16),
                &format!("chatter {chatter_hz:.1} Hz"),
                CHATTER,
            )?;
        }
        if marks.tooth_passing_hz.is_some() {
            legend(&mut chart)?;
        }
        Ok(())
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_chatter_frequency_is_named() {
        let frequency_hz: Vec<f64> = (0..100).map(f64::from).collect();
        let amplitude: Vec<f64> = frequency_hz
            .iter()
            .map(|f| 1.0 / (1.0 + (f - 17.0).powi(2)))
            .collect();
        let marks = SpectrumMarks {
            tooth_passing_hz: Some(30.0),
            chatter_hz: Some(17.4),
        };
        let svg = spectrum("s", &frequency_hz, &amplitude, 80.0, marks).unwrap();
        assert!(svg.contains("chatter 17.4 Hz") && svg.contains("tooth passing"));
        assert!(spectrum("s", &[1.0], &[1.0], 80.0, SpectrumMarks::default()).is_err());
    }
}
