//! The stroboscopic map: one point per tooth passing, at the same angle of the spindle.

use quietcut_core::monitor::Strobe;
use ratatui::buffer::Buffer;
use ratatui::layout::Rect;
use ratatui::style::Color;
use ratatui::symbols::Marker;
use ratatui::widgets::Widget;
use ratatui::widgets::canvas::{Canvas, Points};

use super::frame::{framed, put};
use super::palette::Palette;
use crate::monitor::choices::{AXES, Choices};
use crate::monitor::received::Received;

/// Smallest range of the map, m/s²: a choice above the noise of the sensor, which would fill the map otherwise.
const LEAST_RANGE: f64 = 0.05;

/// Draws the map of the chosen band and axes.
pub(super) fn draw(
    received: &Received,
    choices: &Choices,
    palette: Palette,
    area: Rect,
    buffer: &mut Buffer,
) {
    let (across, up) = choices.axes;
    let strobes = received.strobes(choices.band);
    let at = |strobe: &Strobe, axis: usize| {
        let value = strobe.meters_per_second2.get(axis).copied().unwrap_or_default();
        f64::from(value)
    };
    let points: Vec<(f64, f64)> = strobes
        .iter()
        .map(|strobe| (at(strobe, across), at(strobe, up)))
        .collect();
    let largest = points
        .iter()
        .map(|(x, y)| x.abs().max(y.abs()))
        .fold(LEAST_RANGE, f64::max);
    let range = largest * 1.1;
    let name = |axis: usize| AXES.get(axis).copied().unwrap_or_default();
    let title = format!(" map {} → {} ↑ ±{range:.2} m/s² ", name(across), name(up));
    let inside = framed(&title, palette, area, buffer);
    if points.is_empty() {
        put(inside, 0, "no tooth passing yet", palette.faint(), buffer);
        return;
    }
    let colour = palette.curve().fg.unwrap_or(Color::Reset);
    Canvas::default()
        .marker(Marker::Braille)
        .x_bounds([-range, range])
        .y_bounds([-range, range])
        .paint(|context| {
            context.draw(&Points {
                coords: &points,
                color: colour,
            })
        })
        .render(inside, buffer);
}
