//! Head of a text table: separator, decimal mark, encoding, names and units of the columns, sample rate, and where the
//! numbers begin.
//!
//! The head ends before the first line of numbers that is the last line, is followed by one with as many fields, or, in
//! a table of several columns, is preceded by a row of as many fields. Comments and empty lines do not count.

use super::import::is_ratio;
use super::raw::FoundUnit;
use super::text_dialect::{Dialect, Separator, bare, blank_fields};
use super::text_number::complex;
use super::text_rate::rate;
use super::unit::Unit;
use super::words::name_and_unit;

/// A column of the head.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct HeadColumn {
    /// Name of the column; empty if the head of the text table gives none.
    pub(super) name: String,
    pub(super) unit: FoundUnit,
}

/// Head of a text table.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Head {
    pub(super) dialect: Dialect,
    /// Columns of the text table with names and units; `None` if the file has no row of names.
    pub(super) columns: Option<Vec<HeadColumn>>,
    /// For each field of a row of the text table, true if its numbers are complex: they are two columns. Empty if none
    /// are.
    pub(super) complex: Vec<bool>,
    /// Number of columns in the first line of numbers of the text table; without such a line, number of fields in the
    /// first line that is no comment, or 0.
    pub(super) width: usize,
    /// Offset of the first row after the head of the text table from the start of the file, bytes.
    pub(super) offset: usize,
    /// Number of lines of the text file before the first row after its head.
    pub(super) lines: u64,
    /// Sample rate that a line before the numbers of the text table states, samples per second; `None` if none does.
    pub(super) rate_hz: Option<f64>,
    /// Facts about the reading of the head that the user should know: separator, encoding.
    pub(super) notes: Vec<String>,
}

/// A line of the head of a text table, with its position in the file.
struct Line<'a> {
    text: &'a str,
    /// Offset in the file, bytes.
    offset: usize,
    /// Number of the line in the file, from 1.
    number: u64,
}

impl Line<'_> {
    fn is_comment(&self) -> bool {
        is_comment(self.text)
    }
}

/// True if the line of a text file is a comment: `#`, `%` or `//` at its start.
pub(super) fn is_comment(line: &str) -> bool {
    let line = line.trim_start();
    line.starts_with(['#', '%']) || line.starts_with("//")
}

/// Text of a comment line without the marks `#`, `%` or `//` at its start.
fn without_marks(line: &str) -> &str {
    line.trim_start().trim_start_matches(['#', '%', '/']).trim()
}

/// Finds the head of a text table (names, units, separator) in the first bytes of its file.
///
/// # Errors
/// Number of the line and description of the fault: text among numbers, a line with another count of numbers before the
/// first row, or commas as both separator and decimal mark.
pub(super) fn head(bytes: &[u8]) -> Result<Head, (u64, String)> {
    let (text, is_latin) = decoded(bytes);
    let lines = lines(&text, bytes);
    let filled: Vec<&Line> = lines.iter().filter(|line| !line.text.trim().is_empty()).collect();
    let data: Vec<&Line> = filled.iter().copied().filter(|line| !line.is_comment()).collect();
    let found = (0..data.len()).find_map(|index| {
        let dialect = dialect(data[index].text, &data[index..])?;
        let width = dialect.count_of_numbers(data[index].text)?;
        let same = |line: &Line| dialect.count_of_numbers(line.text) == Some(width);
        let next = data.get(index + 1).is_none_or(|line| same(line));
        let names = index
            .checked_sub(1)
            .is_some_and(|before| width > 1 && names(dialect, data[before].text, width).is_some());
        (next || names).then_some((index, dialect, width))
    });
    let mut notes = Vec::new();
    if is_latin {
        notes.push("encoding Latin-1".into());
    }
    let Some((index, dialect, width)) = found else {
        // In a file without any line of numbers the first line that is no comment counts as the head; the reader of the
        // rows then reports the fault in the next lines.
        let first = data.first();
        let columns = first.map(|line| head_columns(&Dialect::PLAIN.fields(line.text), None));
        let after = data.get(1).or(data.first());
        return Ok(Head {
            dialect: Dialect::PLAIN,
            width: columns.as_ref().map_or(0, Vec::len),
            columns,
            offset: after
                .filter(|_| data.len() > 1)
                .map_or(bytes.len(), |line| line.offset),
            lines: after
                .filter(|_| data.len() > 1)
                .map_or(lines.len() as u64, |line| line.number - 1),
            rate_hz: None,
            complex: Vec::new(),
            notes,
        });
    };
    notes.extend(dialect.note());
    let first = data[index];
    let mut used = Vec::new();
    let columns = columns_before(dialect, width, &data[..index], &filled, first, &mut used)?;
    let rate_hz = filled
        .iter()
        .take_while(|line| line.number < first.number)
        .filter(|line| !used.contains(&line.number))
        .find_map(|line| rate(without_marks(line.text), dialect.decimal_comma));
    let complex: Vec<bool> = dialect
        .fields(first.text)
        .iter()
        .map(|field| complex(field).is_some())
        .collect();
    let complex = if complex.contains(&true) {
        complex
    } else {
        Vec::new()
    };
    Ok(Head {
        dialect,
        columns: columns.map(|columns| parts(columns, &complex)),
        width: width + complex.iter().filter(|is_complex| **is_complex).count(),
        complex,
        offset: first.offset,
        lines: first.number - 1,
        rate_hz,
        notes,
    })
}

/// Names and units of the columns from the lines before the first line of numbers; `None` if no row gives them. The
/// line numbers of the rows that give them are added to `used`.
fn columns_before(
    dialect: Dialect,
    width: usize,
    before: &[&Line],
    filled: &[&Line],
    first: &Line,
    used: &mut Vec<u64>,
) -> Result<Option<Vec<HeadColumn>>, (u64, String)> {
    let is_row = |line: &Line| {
        let fields = dialect.fields(line.text);
        width == 1 || fields.len() > 1 || names(dialect, line.text, width).is_some()
    };
    if let Some((line, what)) = ambiguous_commas(dialect, width, before, first) {
        return Err((line, what));
    }
    if let Some((last, earlier)) = before.split_last()
        && is_row(last)
    {
        let fields = names(dialect, last.text, width).unwrap_or_else(|| dialect.fields(last.text));
        let numbers = fields
            .iter()
            .filter(|field| dialect.number(field).is_some())
            .count();
        if numbers > 0 && numbers == fields.len() {
            return Err((
                last.number,
                format!(
                    "{numbers} numbers, but the line after it has {width}: every row needs a number for every column"
                ),
            ));
        }
        if numbers > 0 {
            let text = fields
                .iter()
                .find(|field| dialect.number(field).is_none() && !field.is_empty())
                .copied()
                .unwrap_or_default();
            return Err((
                last.number,
                format!(
                    "\"{text}\" stands among numbers before the first whole row of numbers: if this is a row of the recording, delete it or write \
                     the number; if it is the header, write a name instead of each number"
                ),
            ));
        }
        used.push(last.number);
        if is_units(&fields)
            && let Some(above) = earlier.last()
            && let Some(titles) = names(dialect, above.text, width)
        {
            used.push(above.number);
            return Ok(Some(head_columns(&titles, Some(&fields))));
        }
        return Ok(Some(head_columns(&fields, None)));
    }
    // The row of names may be the last comment before the numbers, as in files that numpy writes.
    let comment = filled
        .iter()
        .rev()
        .find(|line| line.number < first.number)
        .filter(|line| line.is_comment());
    if let Some(comment) = comment
        && let Some(titles) = names(dialect, without_marks(comment.text), width)
        && titles.iter().all(|title| dialect.number(title).is_none())
        && rate(without_marks(comment.text), dialect.decimal_comma).is_none()
    {
        used.push(comment.number);
        return Ok(Some(head_columns(&titles, None)));
    }
    Ok(None)
}

/// Fault of a table with commas between the columns and commas in its numbers: its rows have more fields than the row
/// of names. `None` if there is no such fault.
///
/// A decimal comma splits a number in two, so that a row has at most twice as many fields as names.
fn ambiguous_commas(dialect: Dialect, width: usize, before: &[&Line], first: &Line) -> Option<(u64, String)> {
    if dialect.separator != Separator::Comma {
        return None;
    }
    let titles = before.iter().rev().find_map(|line| {
        let fields = dialect.fields(line.text);
        let is_title = |field: &&str| !field.is_empty() && dialect.number(field).is_none();
        fields.iter().all(is_title).then_some(fields.len())
    })?;
    // Empty fields at the end of a row come from trailing commas.
    let filled = |line: &Line| {
        let fields = dialect.fields(line.text);
        fields.iter().filter(|field| !field.is_empty()).count()
    };
    let rows = before
        .iter()
        .filter(|line| dialect.count_of_numbers(line.text).is_some());
    let row = rows.copied().chain([first]).find(|line| filled(line) > titles)?;
    (titles > 1 && width > titles && width <= 2 * titles).then(|| {
        (
            row.number,
            format!(
                "{} numbers between commas, but the row of names has {titles} columns: a comma seems to be both the decimal mark and the \
                 separator, which cannot be told apart; save the file with semicolons or tabs between the columns, or with decimal points",
                filled(row)
            ),
        )
    })
}

/// Decodes UTF-8, or Latin-1 if the bytes are no UTF-8, and tells whether it was Latin-1; an incomplete UTF-8 character
/// at the end of `bytes` is dropped.
fn decoded(bytes: &[u8]) -> (String, bool) {
    match std::str::from_utf8(bytes) {
        Ok(text) => (text.into(), false),
        Err(error) if error.error_len().is_none() => {
            let whole = &bytes[..error.valid_up_to()];
            (String::from_utf8_lossy(whole).into_owned(), false)
        }
        Err(_) => (latin(bytes), true),
    }
}

/// Text of Latin-1 bytes.
pub(super) fn latin(bytes: &[u8]) -> String {
    bytes.iter().map(|&byte| char::from(byte)).collect()
}

/// Lines of the decoded text of a file, each with its offset in the bytes of the file.
fn lines<'t>(text: &'t str, bytes: &[u8]) -> Vec<Line<'t>> {
    let mut offset = if bytes.starts_with(b"\xef\xbb\xbf") { 3 } else { 0 };
    let text = text.strip_prefix('\u{feff}').unwrap_or(text);
    let mut lines = Vec::new();
    for (index, line) in text.split_inclusive('\n').enumerate() {
        let length = bytes
            .get(offset..)
            .and_then(|rest| rest.iter().position(|&byte| byte == b'\n'))
            .map_or(bytes.len() - offset.min(bytes.len()), |at| at + 1);
        lines.push(Line {
            text: line.trim_end_matches(['\n', '\r']),
            offset,
            number: index as u64 + 1,
        });
        offset += length;
    }
    lines
}

/// Number of lines that are searched for a decimal comma: a choice, since the first samples may be whole numbers.
const LINES_FOR_DECIMAL: usize = 200;

/// Separator and decimal mark, found from one line of numbers and the lines after it; `None` if the line holds text or
/// no number.
fn dialect(line: &str, lines: &[&Line]) -> Option<Dialect> {
    let with = |separator| Dialect {
        separator,
        decimal_comma: lines
            .iter()
            .take(LINES_FOR_DECIMAL)
            .any(|line| line.text.contains(',')),
    };
    let found = if line.contains(';') {
        with(Separator::Semicolon)
    } else if line.trim().contains('\t') {
        with(Separator::Tab)
    } else if line.contains(',') {
        let blank = with(Separator::Blank);
        let fields = blank.fields(line);
        // In `0,001 1,25` commas are decimal marks inside the fields; in `0.001, 1.25` they are separators at the ends
        // of the fields.
        let has_inner =
            |field: &&str| field.contains(',') && blank.number(field).is_some() && !field.ends_with(',');
        if fields.len() > 1 && fields.iter().any(has_inner) && blank.count_of_numbers(line).is_some() {
            blank
        } else {
            Dialect::PLAIN
        }
    } else if blank_fields(line).len() > 1 {
        with(Separator::Blank)
    } else {
        Dialect::PLAIN
    };
    found.count_of_numbers(line).map(|_| found)
}

/// Titles of the columns in a line of the head; `None` if the line cannot be split into `width` titles.
fn names(dialect: Dialect, line: &str, width: usize) -> Option<Vec<&str>> {
    let fields = dialect.fields(line);
    if fields.len() == width {
        return Some(fields);
    }
    if dialect.separator != Separator::Blank {
        return None;
    }
    // Titles with blanks in them, such as `Time (s)  Acc X (g)`, are separated by two or more blanks or by tabs.
    let wide: Vec<&str> = line
        .split('\t')
        .flat_map(|part| part.split("  "))
        .map(bare)
        .filter(|part| !part.is_empty())
        .collect();
    if wide.len() == width {
        return Some(wide);
    }
    // In `Time (s) Force (N)` the bracket with the unit belongs to the title before it.
    let mut joined: Vec<&str> = Vec::new();
    for field in &fields {
        match joined.last_mut() {
            Some(before) if field.starts_with(['(', '[']) => {
                let start = before.as_ptr() as usize - line.as_ptr() as usize;
                let end = field.as_ptr() as usize - line.as_ptr() as usize + field.len();
                *before = line.get(start..end)?;
            }
            _ => joined.push(field),
        }
    }
    (joined.len() == width).then_some(joined)
}

/// True if a line of the head is a row of units: every field is empty, in brackets, a known unit, that of a frequency
/// response function or of a phase, and not all are empty.
fn is_units(fields: &[&str]) -> bool {
    let is_bracketed = |field: &str| {
        (field.starts_with('(') && field.ends_with(')')) || (field.starts_with('[') && field.ends_with(']'))
    };
    let is_of_frf = |field: &str| {
        ["hz", "khz", "rad/s", "deg", "°", "degrees", "rad"].contains(&field.to_lowercase().as_str())
            || is_ratio(field)
    };
    let is_unit = |field: &&str| {
        field.is_empty() || is_bracketed(field) || is_of_frf(field) || field.parse::<Unit>().is_ok()
    };
    fields.iter().all(is_unit) && fields.iter().any(|field| !field.is_empty())
}

/// Names and units of columns from their titles, with the units from a row of units if the head has one.
fn head_columns(titles: &[&str], units: Option<&[&str]>) -> Vec<HeadColumn> {
    let columns = titles
        .iter()
        .enumerate()
        .map(|(index, title)| {
            if let Some(unit) = units.and_then(|units| units.get(index)) {
                let unit = unbracketed(unit);
                return HeadColumn {
                    name: (*title).into(),
                    unit: if unit.is_empty() {
                        FoundUnit::None
                    } else {
                        FoundUnit::Text(unit.into())
                    },
                };
            }
            let (name, unit) = name_and_unit(title);
            HeadColumn {
                name: name.into(),
                unit: unit.map_or(FoundUnit::None, |unit| FoundUnit::Text(unit.into())),
            }
        })
        .collect();
    told_apart(columns)
}

/// Columns with two for each that holds complex numbers: `H real` and `H imag`.
fn parts(columns: Vec<HeadColumn>, complex: &[bool]) -> Vec<HeadColumn> {
    let is_complex = complex.iter().copied().chain(std::iter::repeat(false));
    let two = |column: HeadColumn, is_complex| {
        // The unit of a receptance stands in brackets at the end of its title.
        let (name, unit) = match column.name.rfind(" (") {
            Some(at) if column.name.ends_with(')') => column.name.split_at(at),
            _ => (column.name.as_str(), ""),
        };
        let part = |part: &str| HeadColumn {
            name: format!("{name} {part}{unit}").trim_start().into(),
            unit: column.unit.clone(),
        };
        if is_complex {
            vec![part("real"), part("imag")]
        } else {
            vec![column]
        }
    };
    columns
        .into_iter()
        .zip(is_complex)
        .flat_map(|(column, is_complex)| two(column, is_complex))
        .collect()
}

/// Text without the brackets around all of it: `m/s^2` of `(m/s^2)`, but `(m/s^2)/N` stays.
fn unbracketed(text: &str) -> &str {
    let text = text.trim();
    for (open, close) in [('(', ')'), ('[', ']')] {
        let inner = text
            .strip_prefix(open)
            .and_then(|inner| inner.strip_suffix(close));
        if let Some(inner) = inner
            && inner.matches(open).count() == inner.matches(close).count()
            && inner.find(close).is_none_or(|at| inner[..at].contains(open))
        {
            return inner.trim();
        }
    }
    text
}

/// Columns with a number behind each name that an earlier column has: `ay`, `ay (2)`.
fn told_apart(mut columns: Vec<HeadColumn>) -> Vec<HeadColumn> {
    let names: Vec<String> = columns.iter().map(|column| column.name.clone()).collect();
    for (index, column) in columns.iter_mut().enumerate() {
        let earlier = names[..index].iter().filter(|name| **name == column.name).count();
        if earlier > 0 && !column.name.is_empty() {
            column.name = format!("{} ({})", column.name, earlier + 1);
        }
    }
    columns
}

#[cfg(test)]
mod tests;
