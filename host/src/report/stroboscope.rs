//! Stroboscopic picture, one sample per tooth passing: one line is a stable cut, two lines are a period doubling, waves are a Hopf
//! bifurcation.

use std::ops::Range;

use plotters::prelude::{Circle, PathElement};
use plotters::style::{Color, RGBColor};

use super::picture::{BLUE, Labels, ORANGE, PictureError, axes, draw, legend, span};

/// Size of the picture in pixels.
const SIZE: (u32, u32) = (470, 330);

/// Draws samples over the number of the tooth passing as SVG, in two colours for even and odd numbers; `range` is that of the
/// vertical axis, by default that of the samples.
///
/// # Errors
/// There are no samples, or the drawing library fails.
pub fn samples_per_tooth(
    title: &str,
    quantity: &str,
    samples: &[(u32, f64)],
    range: Option<Range<f64>>,
) -> Result<String, PictureError> {
    let (Some(&(first, _)), Some(&(last, _))) = (samples.first(), samples.last()) else {
        return Err(PictureError::nothing("a stroboscopic picture needs samples"));
    };
    let labels = Labels {
        title,
        x: "tooth passing number",
        y: quantity,
    };
    let passings = |tooth: u32| f64::from(tooth.wrapping_sub(first));
    let mut y = range.unwrap_or_else(|| span(samples.iter().map(|&(_, value)| value)));
    // Space for the legend above the samples.
    y.end += 0.25 * (y.end - y.start);
    draw(SIZE, |canvas| {
        let mut chart = axes(canvas, &labels, 0.0..passings(last) + 1.0, y)?;
        let kinds: [(u32, RGBColor, &str); 2] = [
            (0, BLUE, "even tooth passings"),
            (1, ORANGE, "odd tooth passings"),
        ];
        for (parity, color, name) in kinds {
            let own = samples.iter().filter(|(tooth, _)| tooth % 2 == parity);
            chart
                .draw_series(
                    own.map(|&(tooth, value)| Circle::new((passings(tooth), value), 2, color.filled())),
                )?
                .label(name)
                .legend(move |(x, y)| PathElement::new([(x + 4, y), (x + 14, y)], color.stroke_width(4)));
        }
        legend(&mut chart)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_colour_follows_the_tooth() {
        // One tooth passing is missing: the colour must follow the passing number, not the index in the list.
        let samples: Vec<(u32, f64)> = (0..41)
            .filter(|tooth| *tooth != 20)
            .map(|tooth| (tooth, if tooth % 2 == 0 { 1.0 } else { -1.0 }))
            .collect();
        let svg = samples_per_tooth("s", "a [m/s²]", &samples, None).unwrap();
        let circles = |color: RGBColor| {
            let fill = format!("#{:02X}{:02X}{:02X}", color.0, color.1, color.2);
            svg.lines()
                .filter(|line| line.starts_with("<circle") && line.contains(&fill))
                .count()
        };
        assert_eq!((circles(BLUE), circles(ORANGE)), (20, 20));
        assert!(samples_per_tooth("s", "a", &[], None).is_err());
    }
}
