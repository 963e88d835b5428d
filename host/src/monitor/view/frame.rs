//! Frames, lines of text and names that the parts of the picture share.

use quietcut_core::monitor::Band;
use ratatui::buffer::Buffer;
use ratatui::layout::Rect;
use ratatui::style::Style;
use ratatui::widgets::{Block, Widget};

use super::palette::Palette;

/// Name of a band.
pub(super) fn band_name(band: Band) -> &'static str {
    match band {
        Band::Structure => "structure",
        Band::Tool => "tool",
    }
}

/// Draws a frame with a title; returns the area inside of it.
pub(super) fn framed(title: &str, palette: Palette, area: Rect, buffer: &mut Buffer) -> Rect {
    let block = Block::bordered()
        .title(title.to_owned())
        .border_style(palette.faint())
        .title_style(palette.title());
    let inside = block.inner(area);
    block.render(area, buffer);
    inside
}

/// Writes one line of text in a row of `area`, cut at its right end.
pub(super) fn put(area: Rect, row: u16, text: &str, style: Style, buffer: &mut Buffer) {
    if row < area.height && area.width > 0 {
        buffer.set_stringn(area.x, area.y + row, text, usize::from(area.width), style);
    }
}
