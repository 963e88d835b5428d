//! What the spindle can reach in a stability lobe diagram: its ranges of speed, and the depth that it can drive.

use plotters::prelude::{LineSeries, PathElement, Rectangle};
use plotters::style::{Color, RGBColor};

use super::picture::{Axes, INK, PictureError};

/// Fill of speeds and depths that the spindle cannot reach.
const UNREACHED: RGBColor = RGBColor(0x77, 0x7c, 0x85);

/// Opacity of this fill: the limits below it stay visible.
const OPACITY: f64 = 0.35;

/// Speeds and depths that the spindle can reach.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct SpindleArea {
    /// Ranges of spindle speed in which the spindle may run, rev/min, ascending.
    pub allowed_rpm: Vec<[f64; 2]>,
    /// Axial depth that the spindle can drive, mm, at ascending speeds, rev/min; empty if power and torque are not
    /// limited.
    pub driven: Vec<(f64, f64)>,
}

impl SpindleArea {
    /// Gaps between the allowed ranges of speed, within the axis from `first` to `last`, rev/min.
    fn gaps(&self, [first, last]: [f64; 2]) -> Vec<[f64; 2]> {
        let ends = std::iter::once(first).chain(self.allowed_rpm.iter().map(|range| range[1]));
        let begins = self.allowed_rpm.iter().map(|range| range[0]).chain([last]);
        ends.zip(begins)
            .map(|(from, to)| [from.max(first), to.min(last)])
            .filter(|[from, to]| from < to)
            .collect()
    }

    /// Lines along the greatest depth that the spindle can drive, without their parts above the picture.
    fn visible(&self, depth_max_mm: f64) -> impl Iterator<Item = &[(f64, f64)]> {
        let lines = self.driven.split(move |(_, depth)| *depth > depth_max_mm);
        lines.filter(|line| line.len() > 1)
    }
}

/// Shades the speeds at which the spindle must not run and the depths that it cannot drive, with a line along the
/// greatest depth that it can drive.
pub(super) fn draw_spindle(
    chart: &mut Axes<'_, '_>,
    area: &SpindleArea,
    [first, last]: [f64; 2],
    depth_max_mm: f64,
) -> Result<(), PictureError> {
    let fill = UNREACHED.mix(OPACITY).filled();
    let mut shaded: Vec<[(f64, f64); 2]> = area
        .gaps([first, last])
        .into_iter()
        .map(|[from, to]| [(from, 0.0), (to, depth_max_mm)])
        .collect();
    // Strips between two speeds stand at the mean of both depths; the line shows the depths themselves.
    for pair in area.driven.windows(2) {
        let [(from, a), (to, b)] = [pair[0], pair[1]];
        let middle_mm = 0.5 * (a + b);
        if middle_mm < depth_max_mm {
            shaded.push([(from, middle_mm), (to, depth_max_mm)]);
        }
    }
    if !shaded.is_empty() {
        chart
            .draw_series(shaded.into_iter().map(|corners| Rectangle::new(corners, fill)))?
            .label("beyond the spindle")
            .legend(move |(x, y)| Rectangle::new([(x, y - 4), (x + 18, y + 4)], fill));
    }
    let mut is_labelled = false;
    for line in area.visible(depth_max_mm) {
        let drawn = chart.draw_series(LineSeries::new(line.iter().copied(), INK.stroke_width(2)))?;
        if !is_labelled {
            drawn
                .label("power or torque of the spindle")
                .legend(|(x, y)| PathElement::new([(x, y), (x + 18, y)], INK.stroke_width(2)));
            is_labelled = true;
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_depth_above_the_picture_divides_the_line() {
        let area = SpindleArea {
            allowed_rpm: Vec::new(),
            driven: [1.0, 2.0, 5.0, 7.0, 2.0, 1.0, 6.0, 1.0]
                .into_iter()
                .zip(1..)
                .map(|(depth_mm, index)| (100.0 * f64::from(index), depth_mm))
                .collect(),
        };
        let lines: Vec<Vec<f64>> = area
            .visible(4.0)
            .map(|line| line.iter().map(|(rpm, _)| *rpm).collect())
            .collect();
        assert_eq!(lines, [[100.0, 200.0], [500.0, 600.0]]);
    }

    #[test]
    fn gaps_are_the_speeds_outside_the_ranges() {
        let area = SpindleArea {
            allowed_rpm: vec![[100.0, 1500.0], [1800.0, 6000.0]],
            driven: Vec::new(),
        };
        assert_eq!(
            area.gaps([50.0, 7000.0]),
            [[50.0, 100.0], [1500.0, 1800.0], [6000.0, 7000.0]]
        );
        assert_eq!(area.gaps([2000.0, 3000.0]), Vec::<[f64; 2]>::new());
        assert_eq!(area.gaps([1600.0, 1700.0]), [[1600.0, 1700.0]]);
    }
}
