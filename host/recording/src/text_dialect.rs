//! Notation of the lines of a text table: separator between fields and decimal mark.

use super::text_number::{complex, is_no_value};

/// Separator between the fields of a line.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Separator {
    Comma,
    Semicolon,
    Tab,
    /// The fields of a line are separated by any number of blanks and tabs.
    Blank,
}

/// Notation of the lines of a text table: separator and decimal mark.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Dialect {
    pub(super) separator: Separator,
    /// True if the decimal mark is a comma.
    pub(super) decimal_comma: bool,
}

impl Dialect {
    /// Comma between fields, decimal point.
    pub(super) const PLAIN: Self = Self {
        separator: Separator::Comma,
        decimal_comma: false,
    };

    /// Fields of a line of a text table, without the blanks and quotes around them.
    pub(super) fn fields(self, line: &str) -> Vec<&str> {
        let separator = match self.separator {
            Separator::Blank => return blank_fields(line),
            Separator::Comma => ',',
            Separator::Semicolon => ';',
            Separator::Tab => '\t',
        };
        let mut fields = Vec::new();
        let mut start = 0;
        let mut is_quoted = false;
        // In a line with an odd number of quotes, separators between quotes separate too, so that an open quote does
        // not swallow the rest of the line.
        let is_closed = line.matches('"').count().is_multiple_of(2);
        for (at, letter) in line.char_indices() {
            if letter == '"' && is_closed {
                is_quoted = !is_quoted;
            } else if letter == separator && !is_quoted {
                fields.push(bare(&line[start..at]));
                start = at + 1;
            }
        }
        fields.push(bare(&line[start..]));
        fields
    }

    /// Number in a field of a text table; `None` if the field is no number in this notation.
    pub(super) fn number(self, field: &str) -> Option<f64> {
        super::text_number::number(field, self.decimal_comma)
    }

    /// Number of fields in a line of a text table if all are numbers, complex ones included, or without value; `None` if a field is text, or no field
    /// is a number.
    pub(super) fn count_of_numbers(self, line: &str) -> Option<usize> {
        let fields = self.fields(line);
        let is_number = |field: &&&str| self.number(field).is_some() || complex(field).is_some();
        let numbers = fields.iter().filter(is_number).count();
        let empty = fields.iter().filter(|field| is_no_value(field)).count();
        (numbers > 0 && numbers + empty == fields.len()).then_some(fields.len())
    }

    /// Description of separator and decimal mark for the user; `None` for the usual pair of comma and decimal point.
    pub(super) fn note(self) -> Option<String> {
        let separator = match self.separator {
            Separator::Comma => "comma",
            Separator::Semicolon => "semicolon",
            Separator::Tab => "tab",
            Separator::Blank => "blank",
        };
        match (self == Self::PLAIN, self.decimal_comma) {
            (true, _) => None,
            (_, true) => Some(format!("separator {separator}, decimal comma")),
            (_, false) => Some(format!("separator {separator}")),
        }
    }
}

/// Text of a field of a table, without the blanks and quotes around it.
pub(super) fn bare(field: &str) -> &str {
    let field = field.trim();
    field
        .strip_prefix('"')
        .and_then(|inner| inner.strip_suffix('"'))
        .map_or(field, str::trim)
}

/// Fields of a line that are separated by blanks; a quoted field may contain blanks.
pub(super) fn blank_fields(line: &str) -> Vec<&str> {
    let mut fields = Vec::new();
    let mut rest = line.trim();
    while !rest.is_empty() {
        let end = match rest.strip_prefix('"').and_then(|inner| inner.find('"')) {
            Some(inner) => inner + 2,
            None => rest.find(char::is_whitespace).unwrap_or(rest.len()),
        };
        fields.push(bare(&rest[..end]));
        rest = rest[end..].trim_start();
    }
    fields
}
