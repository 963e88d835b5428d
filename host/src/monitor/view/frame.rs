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

/// Writes one line of text in a row of `area`; a text that is cut at its right end ends in `…`.
pub(super) fn put(area: Rect, row: u16, text: &str, style: Style, buffer: &mut Buffer) {
    if row >= area.height || area.width == 0 {
        return;
    }
    let width = usize::from(area.width);
    let y = area.y + row;
    buffer.set_stringn(area.x, y, text, width, style);
    if text.chars().count() > width
        && let Some(cell) = buffer.cell_mut((area.right() - 1, y))
    {
        cell.set_symbol("…");
    }
}

/// Text as lines of at most `width` columns, cut between words; each line but the first is indented by two columns.
pub(super) fn wrapped(text: &str, width: u16) -> Vec<String> {
    let mut lines = vec![String::new()];
    for word in text.split_whitespace() {
        let Some(line) = lines.last_mut() else {
            continue;
        };
        let is_first_word = line.trim().is_empty();
        if !is_first_word && line.chars().count() + 1 + word.chars().count() > usize::from(width) {
            lines.push(format!("  {word}"));
            continue;
        }
        if !is_first_word {
            line.push(' ');
        }
        line.push_str(word);
    }
    lines
}
