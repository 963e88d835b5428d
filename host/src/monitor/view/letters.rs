//! Large letters and digits, drawn with blocks.

use ratatui::buffer::Buffer;
use ratatui::layout::Rect;
use ratatui::style::Style;

/// Height of a letter in dots.
const DOTS: u16 = 5;

/// Dots of a character, one text per row; `None` for a character that is never shown large.
fn dots(character: char) -> Option<[&'static str; DOTS as usize]> {
    Some(match character {
        'A' => ["###", "# #", "###", "# #", "# #"],
        'C' => ["###", "#  ", "#  ", "#  ", "###"],
        'D' => ["## ", "# #", "# #", "# #", "## "],
        'E' => ["###", "#  ", "## ", "#  ", "###"],
        'F' => ["###", "#  ", "## ", "#  ", "#  "],
        'G' => ["####", "#   ", "# ##", "#  #", "####"],
        'H' => ["# #", "# #", "###", "# #", "# #"],
        'I' => ["#", "#", "#", "#", "#"],
        'N' => ["#  #", "## #", "# ##", "#  #", "#  #"],
        'O' => ["###", "# #", "# #", "# #", "###"],
        'Q' => ["### ", "# # ", "# # ", "# ##", "####"],
        'R' => ["###", "# #", "## ", "# #", "# #"],
        'S' => ["###", "#  ", "###", "  #", "###"],
        'T' => ["###", " # ", " # ", " # ", " # "],
        'U' => ["# #", "# #", "# #", "# #", "###"],
        '0' => ["###", "# #", "# #", "# #", "###"],
        '1' => [" #", "##", " #", " #", " #"],
        '2' => ["###", "  #", "###", "#  ", "###"],
        '3' => ["###", "  #", " ##", "  #", "###"],
        '4' => ["# #", "# #", "###", "  #", "  #"],
        '5' => ["###", "#  ", "###", "  #", "###"],
        '6' => ["###", "#  ", "###", "# #", "###"],
        '7' => ["###", "  #", "  #", "  #", "  #"],
        '8' => ["###", "# #", "###", "# #", "###"],
        '9' => ["###", "# #", "###", "  #", "###"],
        '?' => ["###", "  #", " ##", "   ", " # "],
        ' ' => ["  ", "  ", "  ", "  ", "  "],
        _ => return None,
    })
}

/// Width of a text in dots, without the gap after its last letter.
pub(super) fn width(text: &str) -> u16 {
    let letters = text
        .chars()
        .filter_map(dots)
        .map(|[row, ..]| row.len() as u16 + 1);
    letters.sum::<u16>().saturating_sub(1)
}

/// Size of a dot of large letters.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Size {
    /// A dot is half a cell high and one cell wide: letters of three rows.
    Half,
    /// A dot is this number of cells high and wide.
    Whole { rows: u16, columns: u16 },
}

impl Size {
    /// Size of letters that take at least an eighth of a screen with `rows` rows; their dots are as wide as `text` in
    /// `columns` columns allows, at most twice as wide as high, since a cell is about twice as high as wide.
    pub(super) fn fitting(text: &str, columns: u16, rows: u16) -> Self {
        let least = rows.div_ceil(8);
        if least <= Self::Half.rows() {
            return Self::Half;
        }
        let rows = least.div_ceil(DOTS);
        Self::Whole {
            rows,
            columns: (columns / width(text).max(1)).clamp(1, 2 * rows),
        }
    }

    /// Rows of a letter.
    pub(super) fn rows(self) -> u16 {
        match self {
            Self::Half => DOTS.div_ceil(2),
            Self::Whole { rows, .. } => DOTS * rows,
        }
    }

    /// Columns of a text.
    pub(super) fn columns(self, text: &str) -> u16 {
        match self {
            Self::Half => width(text),
            Self::Whole { columns, .. } => columns * width(text),
        }
    }
}

/// Draws a text at the upper left corner of `area`; cells outside of `area` stay as they are.
pub(super) fn draw(text: &str, size: Size, style: Style, area: Rect, buffer: &mut Buffer) {
    let mut rows: [String; DOTS as usize] = Default::default();
    for letter in text.chars().filter_map(dots) {
        for (row, dots) in rows.iter_mut().zip(letter) {
            row.push_str(dots);
            row.push(' ');
        }
    }
    let is_on = |x: u16, y: u16| {
        let row = rows.get(usize::from(y));
        row.is_some_and(|row| row.as_bytes().get(usize::from(x)) == Some(&b'#'))
    };
    for y in 0..size.rows().min(area.height) {
        for x in 0..size.columns(text).min(area.width) {
            let symbol = match size {
                Size::Whole { rows, columns } => [" ", "█"][usize::from(is_on(x / columns, y / rows))],
                Size::Half => match (is_on(x, 2 * y), is_on(x, 2 * y + 1)) {
                    (true, true) => "█",
                    (true, false) => "▀",
                    (false, true) => "▄",
                    (false, false) => " ",
                },
            };
            if let Some(cell) = buffer.cell_mut((area.x + x, area.y + y)) {
                cell.set_symbol(symbol).set_style(style);
            }
        }
    }
}
