//! Draws the received state: layout by the size of the terminal.

mod charts;
mod frame;
mod head;
mod letters;
mod lobes;
mod map;
pub(crate) mod palette;
mod spectrum;

use ratatui::Frame;
use ratatui::layout::Rect;

use self::frame::put;
use self::palette::Palette;
use super::choices::Choices;
use super::received::Received;

/// Smallest terminal that has room for verdict, advice, one chart and keys, columns and rows: a choice.
const LEAST: (u16, u16) = (40, 12);

/// Keys with their meaning, for the width that each text has: the first that fits is shown.
const KEYS: [&str; 3] = [
    "q quit   Tab next chart   Space freeze   b band   a axes   + - 0 zoom   c clear map   r redraw",
    "q quit  Tab chart  Space freeze  b band  a axes  + - 0 zoom  c clear  r redraw",
    "q quit  Tab chart  Space freeze  b band",
];

/// Draws the whole view; `frozen` says that the picture stands still.
pub(crate) fn draw(
    frame: &mut Frame<'_>,
    received: &Received,
    choices: &Choices,
    palette: Palette,
    frozen: bool,
) {
    let area = frame.area();
    let buffer = frame.buffer_mut();
    if area.width < LEAST.0 || area.height < LEAST.1 {
        head::draw_small(received, LEAST, palette, area, buffer);
        return;
    }
    let keys = Rect {
        y: area.bottom() - 1,
        height: 1,
        ..area
    };
    let used = head::draw(received, frozen, palette, area, buffer);
    let body = Rect {
        y: area.y + used,
        height: area.height.saturating_sub(used + 1),
        ..area
    };
    charts::draw(received, choices, palette, body, buffer);
    let fits = |text: &&&str| text.len() <= usize::from(area.width);
    let text = KEYS.iter().find(fits).copied().unwrap_or_default();
    put(keys, 0, text, palette.faint(), buffer);
}
