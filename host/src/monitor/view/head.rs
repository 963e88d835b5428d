//! The upper part: port, verdict and speed in large letters, advice, margin, strip of verdicts.

use ratatui::buffer::Buffer;
use ratatui::layout::Rect;
use ratatui::style::Style;

use super::frame::{put, wrapped};
use super::letters::{self, Size};
use super::palette::Palette;
use crate::monitor::received::{Received, STRIP_S};
use crate::monitor::sentences::letter;

/// Rows of a terminal from which margin and strip of verdicts are shown: a choice.
const ROWS_OF_ALL: u16 = 20;

/// Rows of a terminal from which the reason of the advice has two rows: a choice.
const ROWS_OF_REASON: u16 = 30;

/// Columns between the large verdict and the large speed: a choice.
const GAP: u16 = 4;

/// Draws the upper part; returns the number of rows that it takes.
pub(super) fn draw(
    received: &Received,
    frozen: bool,
    palette: Palette,
    area: Rect,
    buffer: &mut Buffer,
) -> u16 {
    put(area, 0, &title(received, frozen), palette.title(), buffer);
    let below = |rows: u16| Rect {
        y: area.y + rows,
        height: area.height.saturating_sub(rows),
        ..area
    };
    let mut used = 1 + draw_large(received, palette, below(1), area.height, buffer);
    let mut line = |text: &str, style: Style| {
        put(area, used, text, style, buffer);
        used += 1;
    };
    line(&received.sentence(), palette.verdict(received.verdict()));
    line(&format!("advice: {}", received.advice_text()), Style::new());
    if area.height >= ROWS_OF_ALL {
        // The reason may take two rows, which stay empty otherwise so that the charts do not jump.
        let rows = if area.height >= ROWS_OF_REASON { 2 } else { 1 };
        let reason = wrapped(&reason(received), area.width);
        for row in 0..rows {
            line(reason.get(row).map_or("", String::as_str), palette.faint());
        }
        line(&format!("margin: {}", received.margin_text()), Style::new());
        draw_strip(received, palette, below(used), buffer);
        used += 1;
    }
    used
}

/// Draws what a terminal too small for the view has room for.
pub(super) fn draw_small(
    received: &Received,
    least: (u16, u16),
    palette: Palette,
    area: Rect,
    buffer: &mut Buffer,
) {
    let style = palette.verdict(received.verdict());
    put(
        area,
        0,
        &format!("{} {}", received.word(), received.speed_text()),
        style,
        buffer,
    );
    put(area, 1, &received.sentence(), Style::new(), buffer);
    let advice = format!("advice: {}", received.advice_text());
    put(area, 2, &advice, Style::new(), buffer);
    let hint = format!("min {} x {}; q quits", least.0, least.1);
    put(
        area,
        area.height.saturating_sub(1).max(3),
        &hint,
        palette.faint(),
        buffer,
    );
}

fn title(received: &Received, frozen: bool) -> String {
    let frozen = if frozen { "FROZEN (Space goes on)  " } else { "" };
    let device = received.device_text();
    let gap = if device.is_empty() { "" } else { "  " };
    format!(
        "{frozen}quietcut {}: {}{gap}{device}",
        received.port,
        received.connection_text()
    )
}

fn reason(received: &Received) -> String {
    match received.reason_text() {
        why if why.is_empty() => why,
        why => format!("reason: {why}"),
    }
}

/// Draws verdict and speed in large letters; returns the number of rows.
fn draw_large(received: &Received, palette: Palette, area: Rect, rows: u16, buffer: &mut Buffer) -> u16 {
    const UNIT: &str = "rev/min";
    let (word, speed) = (received.word(), received.speed_text());
    // The size is that of the longest verdict, so that the picture does not jump when the verdict changes.
    let widest = format!("CHATTER {}", if speed.len() > 5 { "000000" } else { "00000" });
    let room = area.width.saturating_sub(UNIT.len() as u16 + GAP + 1);
    let size = Size::fitting(&widest, room, rows);
    let style = palette.verdict(received.verdict());
    letters::draw(word, size, style, area, buffer);
    let from = size.columns("CHATTER") + GAP;
    let right = Rect {
        x: area.x + from.min(area.width),
        width: area.width.saturating_sub(from),
        ..area
    };
    if size.columns(&speed) > right.width {
        // A number that is cut off is another number.
        put(right, 0, &speed, palette.title(), buffer);
        put(right, 1, UNIT, palette.faint(), buffer);
        return size.rows();
    }
    letters::draw(&speed, size, Style::new(), right, buffer);
    let behind = size.columns(&speed) + 1;
    let unit = Rect {
        x: right.x + behind.min(right.width),
        width: right.width.saturating_sub(behind),
        ..right
    };
    put(unit, size.rows() - 1, UNIT, palette.faint(), buffer);
    size.rows()
}

/// The verdicts of the last time as letters, the newest at the right.
fn draw_strip(received: &Received, palette: Palette, area: Rect, buffer: &mut Buffer) {
    let head = "verdicts ";
    put(area, 0, head, palette.faint(), buffer);
    let legend = format!(" now  1 = {STRIP_S} s  .air q quiet H Hopf D doubling");
    let room = area.width.saturating_sub((head.len() + legend.len()) as u16);
    let cells = received.strip.iter().rev().take(usize::from(room));
    let right = area.x + head.len() as u16 + room;
    for (back, verdict) in (1..).zip(cells) {
        if let Some(cell) = buffer.cell_mut((right.saturating_sub(back), area.y)) {
            cell.set_char(letter(*verdict))
                .set_style(palette.verdict(*verdict));
        }
    }
    let behind = Rect {
        x: right.min(area.right()),
        width: area.right().saturating_sub(right),
        ..area
    };
    put(behind, 0, &legend, palette.faint(), buffer);
}
