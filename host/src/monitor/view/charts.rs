//! The charts: four of them, two or one, by the room there is.

use ratatui::buffer::Buffer;
use ratatui::layout::{Constraint, Layout, Rect};
use ratatui::style::Style;

use super::frame::{framed, put, wrapped};
use super::palette::Palette;
use super::{lobes, map, spectrum};
use crate::monitor::choices::{Chart, Choices};
use crate::monitor::received::Received;

/// Least rows and columns of the four charts together: a choice that leaves each one 6 rows inside its frame.
const FOUR: (u16, u16) = (100, 16);

/// Least columns of two charts side by side: a choice.
const TWO: u16 = 70;

/// Draws as many charts as there is room for.
pub(super) fn draw(
    received: &Received,
    choices: &Choices,
    palette: Palette,
    area: Rect,
    buffer: &mut Buffer,
) {
    let sides =
        |area| Layout::horizontal([Constraint::Percentage(60), Constraint::Percentage(40)]).areas::<2>(area);
    let mut one = |chart, area| match chart {
        Chart::Spectrum => spectrum::draw(received, choices, palette, area, buffer),
        Chart::Map => map::draw(received, choices, palette, area, buffer),
        Chart::Lobes => lobes::draw(received, palette, area, buffer),
        Chart::History => draw_history(received, palette, area, buffer),
    };
    if area.width >= FOUR.0 && area.height >= FOUR.1 {
        let [above, below] =
            Layout::vertical([Constraint::Percentage(55), Constraint::Percentage(45)]).areas::<2>(area);
        let ([spectrum, map], [lobes, history]) = (sides(above), sides(below));
        one(Chart::Spectrum, spectrum);
        one(Chart::Map, map);
        one(Chart::Lobes, lobes);
        one(Chart::History, history);
    } else if area.width >= TWO {
        let [left, right] = sides(area);
        let beside = if choices.chart == Chart::Map {
            Chart::Spectrum
        } else {
            Chart::Map
        };
        one(choices.chart, left);
        one(beside, right);
    } else {
        one(choices.chart, area);
    }
}

/// The newest entries of the history, the newest at the top.
fn draw_history(received: &Received, palette: Palette, area: Rect, buffer: &mut Buffer) {
    let inside = framed(" history, newest first ", palette, area, buffer);
    let lines = received
        .lines
        .iter()
        .rev()
        .flat_map(|entry| wrapped(entry, inside.width));
    for (row, line) in (0..inside.height).zip(lines) {
        put(inside, row, &line, Style::new(), buffer);
    }
}
