//! Stabilization diagram: poles over the model order; below it the magnitudes of the measured receptances and of the
//! modal fit.

use plotters::prelude::{Circle, LineSeries, PathElement, RGBColor};
use plotters::style::Color;

use super::picture::{
    BLUE, CHATTER, Canvas, GRID, INK, Labels, ORANGE, PictureError, QUIET, VIOLET, axes, draw, label, legend,
    span,
};
use crate::identify::modes::{ModalModel, Receptances};

/// Width and height in pixels of the stabilization diagram.
const SIZE: (u32, u32) = (900, 820);

/// Colours of the receptances in the stabilization diagram, used cyclically.
const COLORS: [RGBColor; 6] = [BLUE, ORANGE, QUIET, CHATTER, VIOLET, INK];

/// Draws stable poles, other poles and the selected modes over frequency and model order; below them the magnitudes of
/// the measured receptances (dots) and of those of the modal model (lines).
///
/// A pole is stable if its frequency, damping and mode shape agree with those of a pole of the previous model order.
///
/// # Errors
/// The drawing library fails.
pub fn stabilization_chart(
    title: &str,
    data: &Receptances,
    model: &ModalModel,
) -> Result<String, PictureError> {
    draw(SIZE, |canvas| {
        let (above, below) = canvas.split_vertically(420);
        diagram(&above, title, data, model)?;
        receptances(&below, data, model)
    })
}

fn diagram(
    canvas: &Canvas<'_>,
    title: &str,
    data: &Receptances,
    model: &ModalModel,
) -> Result<(), PictureError> {
    let [from_hz, to_hz] = data.band_hz();
    let top = model.stabilization.highest_order as f64 + 1.0;
    let labels = Labels {
        title,
        x: "frequency [Hz]",
        y: "order of the model",
    };
    let mut chart = axes(canvas, &labels, from_hz..to_hz, 0.0..top + 3.0)?;
    for mode in &model.modes {
        let hertz = mode.mode.frequency_hz;
        chart.draw_series(LineSeries::new(
            [(hertz, 0.0), (hertz, top)],
            QUIET.stroke_width(1),
        ))?;
    }
    for (is_stable, color, name) in [
        (false, GRID.mix(1.0), "pole"),
        (true, BLUE.mix(1.0), "stable pole"),
    ] {
        let dots = model
            .stabilization
            .candidates
            .iter()
            .filter(|pole| pole.is_stable == is_stable)
            .map(|pole| Circle::new((pole.frequency_hz(), pole.order as f64), 4, color.filled()));
        chart
            .draw_series(dots)?
            .label(name)
            .legend(move |(x, y)| Circle::new((x + 9, y), 4, color.filled()));
    }
    legend(&mut chart)?;
    for (index, mode) in model.modes.iter().enumerate() {
        let words = format!(
            "{:.2} Hz, {:.2} %",
            mode.mode.frequency_hz,
            100.0 * mode.mode.damping_ratio
        );
        // The labels of three modes in a row, by frequency, get different heights, so that they do not overlap.
        let at = chart.backend_coord(&(mode.mode.frequency_hz, top + 2.6 - (index % 3) as f64));
        let origin = canvas.get_base_pixel();
        label(canvas, (at.0 - origin.0 + 4, at.1 - origin.1), &words, QUIET)?;
    }
    Ok(())
}

fn receptances(canvas: &Canvas<'_>, data: &Receptances, model: &ModalModel) -> Result<(), PictureError> {
    let [from_hz, to_hz] = data.band_hz();
    let micrometers = |size: f64| 1e6 * size;
    let top = span(data.values.iter().flatten().map(|h| micrometers(h.norm()))).end;
    let labels = Labels {
        title: "",
        x: "frequency [Hz]",
        y: "receptance [µm/N]: dots measured, lines fitted",
    };
    let mut chart = axes(canvas, &labels, from_hz..to_hz, 0.0..top)?;
    for ((&(p, q), values), color) in data
        .places
        .iter()
        .zip(&data.values)
        .zip(COLORS.into_iter().cycle())
    {
        let (response, force) = (data.responses[p], data.forces[q]);
        let points = data.frequency_hz.iter().zip(values);
        chart
            .draw_series(points.map(|(hertz, h)| {
                Circle::new((*hertz, micrometers(h.norm())), 2, color.mix(0.45).filled())
            }))?;
        let fitted = data.frequency_hz.iter().filter_map(|&hertz| {
            let h = model.receptance(response, force, hertz)?;
            Some((hertz, micrometers(h.norm())))
        });
        chart
            .draw_series(LineSeries::new(fitted, color.stroke_width(2)))?
            .label(format!("H{response}{force}"))
            .legend(move |(x, y)| PathElement::new([(x, y), (x + 18, y)], color.stroke_width(2)));
    }
    legend(&mut chart)
}
