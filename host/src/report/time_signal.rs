//! Chart of one signal over time, on which events such as the first chatter are marked.

use std::ops::Range;

use plotters::prelude::{LineSeries, PathElement};
use plotters::style::Color;

use super::picture::{BLUE, CHATTER, INK, Labels, PictureError, axes, draw, label, span};

/// Event that a chart of a signal over time marks.
#[derive(Clone, Debug, PartialEq)]
pub struct TimeMark {
    /// Time of the event, s.
    pub t_s: f64,
    /// Label of the event.
    pub label: String,
}

/// Width and height in pixels of the chart of a signal over time.
const SIZE: (u32, u32) = (960, 280);
/// Largest number of runs of samples of which the minimum and maximum are drawn: a choice above the width of the
/// picture, 960 pixels.
const SUBINTERVALS: usize = 1200;

/// Draws `values` at the ascending times `t_s` (equally many, s) as SVG; `range` is that of the vertical axis, by
/// default that of the values with a margin.
///
/// # Errors
/// There are no samples, or the drawing library fails.
pub fn time_signal(
    title: &str,
    quantity: &str,
    t_s: &[f64],
    values: &[f64],
    moments: &[TimeMark],
    range: Option<Range<f64>>,
) -> Result<String, PictureError> {
    let (Some(&from), Some(&to)) = (t_s.first(), t_s.last()) else {
        return Err(PictureError::nothing("a signal needs samples"));
    };
    let y = range.unwrap_or_else(|| span(values.iter().copied()));
    let labels = Labels {
        title,
        x: "time [s]",
        y: quantity,
    };
    draw(SIZE, |canvas| {
        let mut chart = axes(canvas, &labels, from..to, y.clone())?;
        chart.draw_series(LineSeries::new(thinned(t_s, values), BLUE.stroke_width(1)))?;
        for (index, moment) in moments.iter().enumerate() {
            let line = [(moment.t_s, y.start), (moment.t_s, y.end)];
            chart.draw_series([PathElement::new(line, CHATTER.stroke_width(2))])?;
            let (x, top) = chart.backend_coord(&(moment.t_s, y.end));
            // The labels of three events in a row get different heights, so that these labels do not overlap.
            let row = 16 * (index as i32 % 3);
            label(canvas, (x + 6, top + 4 + row), &moment.label, INK)?;
        }
        Ok(())
    })
}

/// Reduces a signal over time to its minimum and maximum in each of at most 1200 runs of equally many samples (the last
/// may be shorter), in the order in which they occur; a signal of up to 2400 samples stays as it is.
pub(super) fn thinned(t_s: &[f64], values: &[f64]) -> Vec<(f64, f64)> {
    let points: Vec<(f64, f64)> = t_s.iter().copied().zip(values.iter().copied()).collect();
    let length = points.len().div_ceil(SUBINTERVALS).max(1);
    if length <= 2 {
        return points;
    }
    let mut kept = Vec::with_capacity(2 * SUBINTERVALS);
    for subinterval in points.chunks(length) {
        let by_value = |a: &&(f64, f64), b: &&(f64, f64)| a.1.total_cmp(&b.1);
        if let (Some(&low), Some(&high)) = (
            subinterval.iter().min_by(by_value),
            subinterval.iter().max_by(by_value),
        ) {
            if low.0 <= high.0 {
                kept.extend([low, high]);
            } else {
                kept.extend([high, low]);
            }
        }
    }
    kept
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn thinning_keeps_the_extremes() {
        let t_s: Vec<f64> = (0..100_000).map(|i| i as f64 * 1e-4).collect();
        let mut values = vec![0.0; t_s.len()];
        values[50_001] = 7.0;
        values[50_002] = -3.0;
        let kept = thinned(&t_s, &values);
        assert!(kept.len() <= 2 * SUBINTERVALS);
        assert!(kept.windows(2).all(|pair| pair[0].0 <= pair[1].0));
        for extreme in [7.0, -3.0] {
            assert!(kept.iter().any(|&(_, value)| value == extreme), "{extreme}");
        }
    }
}
