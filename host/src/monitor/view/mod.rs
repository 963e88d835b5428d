//! Draws what was heard: layout by the size of the terminal.

mod charts;
mod head;
mod letters;
mod lobes;
mod map;
pub(crate) mod palette;
mod spectrum;

use quietcut_core::monitor::Band;
use ratatui::Frame;
use ratatui::buffer::Buffer;
use ratatui::layout::Rect;
use ratatui::style::Style;
use ratatui::widgets::{Block, Widget};

use self::palette::Palette;
use super::choices::Choices;
use super::heard::Heard;

/// Smallest terminal that has room for verdict, advice, one chart and keys, columns and rows: a choice.
const LEAST: (u16, u16) = (40, 12);

/// Draws the whole view; `frozen` says that the picture stands still.
pub(crate) fn draw(frame: &mut Frame<'_>, heard: &Heard, choices: &Choices, palette: Palette, frozen: bool) {
    let area = frame.area();
    let buffer = frame.buffer_mut();
    if area.width < LEAST.0 || area.height < LEAST.1 {
        head::draw_small(heard, LEAST, palette, area, buffer);
        return;
    }
    let keys = Rect {
        y: area.bottom() - 1,
        height: 1,
        ..area
    };
    let used = head::draw(heard, frozen, palette, area, buffer);
    let body = Rect {
        y: area.y + used,
        height: area.height.saturating_sub(used + 1),
        ..area
    };
    charts::draw(heard, choices, palette, body, buffer);
    let text = if area.width < 80 {
        "q quit  Tab chart  Space freeze  b band"
    } else {
        "q quit   Tab next chart   Space freeze   b band   a axes   + - 0 zoom   c clear map   r redraw"
    };
    put(keys, 0, text, palette.faint(), buffer);
}

/// Name of a band.
fn band_name(band: Band) -> &'static str {
    match band {
        Band::Structure => "structure",
        Band::Tool => "tool",
    }
}

/// Draws a frame with a title; returns the area inside of it.
fn framed(title: &str, palette: Palette, area: Rect, buffer: &mut Buffer) -> Rect {
    let block = Block::bordered()
        .title(title.to_owned())
        .border_style(palette.faint())
        .title_style(palette.title());
    let inside = block.inner(area);
    block.render(area, buffer);
    inside
}

/// Writes one line of text in a row of `area`, cut at its right end.
fn put(area: Rect, row: u16, text: &str, style: Style, buffer: &mut Buffer) {
    if row < area.height && area.width > 0 {
        buffer.set_stringn(area.x, area.y + row, text, usize::from(area.width), style);
    }
}
