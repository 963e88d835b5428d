//! Chart of natural frequency and damping ratio over the amplitude.

use plotters::prelude::{Circle, LineSeries, PathElement};
use plotters::style::Color;

use super::picture::{BLUE, CHATTER, Labels, ORANGE, PictureError, QUIET, VIOLET, axes, draw, legend, span};

/// A curve over the amplitude, or the points of several force levels.
#[derive(Clone, Debug, PartialEq)]
pub struct BackboneLine {
    /// Name in the legend.
    pub name: String,
    /// The points, in the order in which they are joined.
    pub points: Vec<BackbonePoint>,
}

/// A mode at one amplitude, with the ends of its 90 % intervals.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BackbonePoint {
    /// Amplitude of the displacement, m.
    pub amplitude_m: f64,
    /// Interval of the natural frequency, Hz.
    pub frequency_hz: [f64; 2],
    /// Interval of the damping ratio.
    pub damping_ratio: [f64; 2],
}

/// Width of the chart and height of each of its two panels in pixels.
const SIZE: (u32, u32) = (900, 320);

/// Draws natural frequency and damping ratio over the amplitude, in µm on a logarithmic axis, as SVG; a vertical line at each point is its
/// interval.
///
/// # Errors
/// There is no point, or the drawing library fails.
pub fn backbone_chart(lines: &[BackboneLine]) -> Result<String, PictureError> {
    if lines.iter().all(|line| line.points.is_empty()) {
        return Err(PictureError::nothing(
            "a curve over the amplitude needs an amplitude",
        ));
    }
    type Interval = fn(&BackbonePoint) -> [f64; 2];
    let panels: [(&str, Interval); 2] = [
        ("natural frequency [Hz]", |point| point.frequency_hz),
        ("damping ratio [%]", |point| {
            point.damping_ratio.map(|ratio| 100.0 * ratio)
        }),
    ];
    let at = |point: &BackbonePoint| (1e6 * point.amplitude_m).log10();
    draw((SIZE.0, 2 * SIZE.1), |canvas| {
        for (panel, (name, interval)) in canvas.split_evenly((2, 1)).iter().zip(panels) {
            let all = || lines.iter().flat_map(|line| &line.points);
            let labels = Labels {
                title: "",
                x: "log10 of the amplitude in µm",
                y: name,
            };
            let mut chart = axes(
                panel,
                &labels,
                span(all().map(at)),
                span(all().flat_map(interval)),
            )?;
            for (line, color) in lines
                .iter()
                .zip([BLUE, ORANGE, VIOLET, QUIET, CHATTER].into_iter().cycle())
            {
                let middle = |point: &BackbonePoint| {
                    let [low, high] = interval(point);
                    (at(point), 0.5 * (low + high))
                };
                chart
                    .draw_series(LineSeries::new(
                        line.points.iter().map(middle),
                        color.stroke_width(1),
                    ))?
                    .label(line.name.clone())
                    .legend(move |(x, y)| PathElement::new([(x, y), (x + 18, y)], color.stroke_width(2)));
                chart.draw_series(
                    line.points
                        .iter()
                        .map(|point| Circle::new(middle(point), 3, color.filled())),
                )?;
                chart.draw_series(line.points.iter().map(|point| {
                    let [low, high] = interval(point);
                    PathElement::new([(at(point), low), (at(point), high)], color.stroke_width(2))
                }))?;
            }
            legend(&mut chart)?;
        }
        Ok(())
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_are_drawn_and_none_is_refused() {
        let line = BackboneLine {
            name: "decay.csv".into(),
            points: [1e-6, 1e-5]
                .map(|amplitude_m| BackbonePoint {
                    amplitude_m,
                    frequency_hz: [19.9, 20.1],
                    damping_ratio: [0.01, 0.011],
                })
                .to_vec(),
        };
        let svg = backbone_chart(&[line]).unwrap();
        for words in [
            "decay.csv",
            "natural frequency [Hz]",
            "damping ratio [%]",
            "log10 of the amplitude in µm",
        ] {
            assert!(svg.contains(words), "{words}");
        }
        assert!(backbone_chart(&[]).is_err());
    }
}
