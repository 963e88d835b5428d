//! Rows of a text table: numbers in columns.
//!
//! Lines that start with `#`, `%` or `//` are comments. Empty lines are skipped. Numbers may be quoted. Columns without
//! any value are left out, as are, in a table of several columns, unnamed ones that count the rows. A last line that
//! is cut off, and text after the last row of numbers, are left out with a note.

use std::path::Path;

use super::csv_number::{End, number};
use super::raw::{FoundUnit, Raw, RawColumn};
use super::text_dialect::{Dialect, Separator};
use super::text_head::{Head, HeadColumn, is_comment};
use super::text_number::{complex, is_no_value};
use super::unit::Unit;
use super::{Quantity, RecordingError};

/// Columns of a text table, filled while its lines are read.
pub(super) struct Table<'a> {
    path: &'a Path,
    /// Number of lines of the text table that are read so far, those of the head included.
    line: u64,
    columns: Vec<RawColumn>,
    /// Empty fields of each column, in the order of `columns`.
    gaps: Vec<Gaps>,
    dialect: Dialect,
    /// For each field of a row, true if its numbers are complex; empty if none are.
    complex: Vec<bool>,
    /// Length of the whole file of the text table, bytes.
    bytes: u64,
    /// True if a NaN or infinite value, or an empty field in a column with values, is an error.
    finite: bool,
    /// Error about the first line without any number after the last row of numbers: it counts if a row of numbers
    /// follows. With the count of such lines.
    after: Option<(RecordingError, usize)>,
    /// True while the last line of the file is read and lacks its line end: it may be cut off.
    is_open: bool,
    /// Number of clock times in each column, in the order of `columns`.
    clocks: Vec<usize>,
    notes: Vec<String>,
}

/// Unit of clock times.
const SECONDS: Unit = Unit {
    quantity: Quantity::Time,
    factor: 1.0,
};

/// Fields of a column without a value: empty, or a word such as `OVR`.
#[derive(Clone, Default)]
struct Gaps {
    count: usize,
    /// Number of the line with the first such field of a column, from 1; 0 without one.
    line: u64,
    /// Text of this field.
    text: String,
}

/// End of an error message about a row of a text table with NaN or infinity: what the user can do.
const LEAVE_OUT: &str = "a number is needed; repair the row, or leave it out with --from-s or --until-s";

impl<'a> Table<'a> {
    /// A table without samples yet, with the columns that the head of the text file names; unnamed columns are called
    /// by their number.
    pub(super) fn new(path: &'a Path, head: &Head, bytes: u64, finite: bool) -> Self {
        let unnamed = || {
            vec![
                HeadColumn {
                    name: String::new(),
                    unit: FoundUnit::None
                };
                head.width
            ]
        };
        let columns = head.columns.clone().unwrap_or_else(unnamed);
        Self {
            path,
            line: head.lines,
            gaps: vec![Gaps::default(); columns.len()],
            clocks: vec![0; columns.len()],
            columns: columns
                .into_iter()
                .enumerate()
                .map(|(index, column)| RawColumn {
                    name: if column.name.is_empty() {
                        (index + 1).to_string()
                    } else {
                        column.name
                    },
                    unit: column.unit,
                    samples: Vec::new(),
                })
                .collect(),
            dialect: head.dialect,
            complex: head.complex.clone(),
            bytes,
            finite,
            after: None,
            is_open: false,
            notes: Vec::new(),
        }
    }

    /// Parses the end of the file after the last line end.
    ///
    /// # Errors
    /// As [`Table::lines`]; a row that may have been cut off while it was written is left out with a note.
    pub(super) fn last_line(&mut self, text: &[u8]) -> Result<(), RecordingError> {
        self.is_open = true;
        self.lines(text)
    }

    /// Parses the complete lines of a text table in `text`.
    ///
    /// # Errors
    /// A row has text among its numbers or another number of values than the head, or comes after a line without any
    /// number.
    pub(super) fn lines(&mut self, text: &[u8]) -> Result<(), RecordingError> {
        let is_plain = self.dialect == Dialect::PLAIN && !self.columns.is_empty() && self.complex.is_empty();
        let mut rest = text;
        while !rest.is_empty() {
            self.line += 1;
            if !is_plain || matches!(rest[0], b'#' | b'%' | b'/' | b'\n' | b'\r' | b' ' | b'\t') {
                let end = rest.iter().position(|&byte| byte == b'\n');
                let (line, after) = rest.split_at(end.map_or(rest.len(), |at| at + 1));
                rest = after;
                match line.trim_ascii().first() {
                    None => {}
                    Some(b'#' | b'%' | b'/') if is_comment(&String::from_utf8_lossy(line)) => {}
                    Some(_) if is_plain => {
                        self.row(line.trim_ascii())?;
                    }
                    Some(_) => self.general_row(line)?,
                }
            } else {
                rest = self.row(rest)?;
            }
        }
        Ok(())
    }

    /// Parses the numbers in the first line of `text` into the columns and returns the text after this line.
    fn row<'t>(&mut self, text: &'t [u8]) -> Result<&'t [u8], RecordingError> {
        let mut rest = text;
        for index in 0..self.columns.len() {
            let is_last = index + 1 == self.columns.len();
            let parsed = number(rest).filter(|&(value, _, end)| {
                (value.is_finite() || !self.finite) && end == if is_last { End::Line } else { End::Field }
            });
            let Some((value, length, _)) = parsed else {
                // The line may have empty fields, which this fast path does not parse: the values that it has already
                // stored are removed, and the general parser reads the line.
                for column in &mut self.columns[..index] {
                    column.samples.pop();
                }
                let end = text
                    .iter()
                    .position(|&byte| byte == b'\n')
                    .map_or(text.len(), |at| at + 1);
                let (line, after) = text.split_at(end);
                self.general_row(line)?;
                return Ok(after);
            };
            self.columns[index].samples.push(value);
            rest = &rest[length..];
        }
        self.refuse_after_text()?;
        self.make_room_after_first(text.len() - rest.len());
        Ok(rest)
    }

    /// Parses a line of numbers with the separator and decimal mark of the file; an empty field becomes NaN and is
    /// counted in the gaps of its column. A line of empty fields only is skipped.
    fn general_row(&mut self, line: &[u8]) -> Result<(), RecordingError> {
        let text = String::from_utf8_lossy(line);
        let fields = self.parts(self.dialect.fields(text.trim_matches(['\n', '\r'])));
        if self.is_after_rows(&fields) || self.is_cut_off(&fields) {
            return Ok(());
        }
        let extra = fields.get(self.columns.len()..).unwrap_or_default();
        if fields.len() < self.columns.len() || extra.iter().any(|field| !field.is_empty()) {
            return Err(self.row_error(&fields));
        }
        if fields.iter().all(|field| field.is_empty()) {
            return Ok(());
        }
        for index in 0..self.columns.len() {
            let field = fields[index];
            let value = if is_no_value(field) {
                let gaps = &mut self.gaps[index];
                if gaps.count == 0 {
                    gaps.line = self.line;
                    gaps.text = field.into();
                }
                gaps.count += 1;
                f64::NAN
            } else {
                self.clocks[index] += usize::from(field.contains(':'));
                match self.dialect.number(field) {
                    Some(value) if value.is_finite() || !self.finite => value,
                    _ => return Err(self.row_error(&fields)),
                }
            };
            self.columns[index].samples.push(value);
        }
        self.refuse_after_text()?;
        self.make_room_after_first(line.len());
        Ok(())
    }

    /// Fields of a row with two, real and imaginary part, for each complex number.
    fn parts<'t>(&self, fields: Vec<&'t str>) -> Vec<&'t str> {
        let is_complex = self.complex.iter().copied().chain(std::iter::repeat(false));
        let mut parts = Vec::with_capacity(self.columns.len());
        for (field, is_complex) in fields.into_iter().zip(is_complex) {
            match (is_complex, complex(field)) {
                (true, Some((real, imaginary))) => parts.extend([real, imaginary]),
                (true, None) if self.dialect.number(field).is_some() => parts.extend([field, "0"]),
                (true, None) => parts.extend([field, field]),
                (false, _) => parts.push(field),
            }
        }
        parts
    }

    /// Refuses a row of numbers after a line without any.
    fn refuse_after_text(&mut self) -> Result<(), RecordingError> {
        match self.after.take() {
            Some((error, _)) => Err(error),
            None => Ok(()),
        }
    }

    /// True if the first field is text, not a damaged number, and rows of numbers came before: the line is no row, as it
    /// seems, but one of statistics or prose. Keeps the error that it is if another row follows.
    fn is_after_rows(&mut self, fields: &[&str]) -> bool {
        let has_rows = self
            .columns
            .first()
            .is_some_and(|column| !column.samples.is_empty());
        let is_text = |field: &&str| {
            let is_begun = field.starts_with(|first: char| first.is_ascii_digit() || "+-.,".contains(first));
            !is_begun && !is_no_value(field) && self.dialect.number(field).is_none()
        };
        if !has_rows || !fields.first().is_some_and(is_text) {
            return false;
        }
        match &mut self.after {
            Some((_, count)) => *count += 1,
            None => self.after = Some((self.row_error(fields), 1)),
        }
        true
    }

    /// True if these are the fields of a row that ends with the file, without line end, and lacks fields or the rest of
    /// its last number.
    fn is_cut_off(&mut self, fields: &[&str]) -> bool {
        let Some((last, before)) = fields.split_last() else {
            return false;
        };
        let is_number = |field: &&str| self.dialect.number(field).is_some();
        let is_begun = last.chars().all(|letter| "+-.,eE0123456789".contains(letter));
        let is_short = fields.len() < self.columns.len() || self.dialect.number(last).is_none();
        let has_rows = self
            .columns
            .first()
            .is_some_and(|column| !column.samples.is_empty());
        let is_cut = self.is_open
            && has_rows
            && is_short
            && is_begun
            && before.iter().all(is_number)
            && fields.len() <= self.columns.len()
            && !(last.is_empty() && fields.len() == self.columns.len());
        if is_cut {
            self.notes
                .push(format!("the last line, {}, is cut off and left out", self.line));
        }
        is_cut
    }

    /// After the first row, of `line` bytes, reserves memory for the samples of the whole file; after other rows does
    /// nothing. Growth by doubling could take twice the memory.
    fn make_room_after_first(&mut self, line: usize) {
        if self
            .columns
            .first()
            .is_none_or(|column| column.samples.len() != 1)
        {
            return;
        }
        let lines = usize::try_from(self.bytes).unwrap_or(0) / line.max(1);
        // The estimate of the number of rows is mostly too high, since later rows are longer (time gets more digits).
        // The surplus is small, and unused memory is not committed.
        for column in &mut self.columns {
            column.samples.reserve_exact(lines);
        }
    }

    /// The columns of the text table that have values, without unnamed ones that count the rows. If values must be
    /// finite, a column with values in some rows and empty fields in others is an error.
    pub(super) fn raw(self, head: Head) -> Result<Raw, RecordingError> {
        let mut notes = head.notes;
        notes.extend(self.notes);
        if let Some((RecordingError::Line { line, .. }, count)) = &self.after {
            notes.push(format!(
                "left out after the numbers: {count} lines of text from line {line} on"
            ));
        }
        let is_unnamed = |name: &str, index: usize| {
            head.columns
                .as_ref()
                .is_some_and(|columns| columns[index].name.is_empty())
                && name.parse() == Ok(index + 1)
        };
        let mut columns = Vec::with_capacity(self.columns.len());
        let mut numbers = Vec::with_capacity(self.columns.len());
        let several = self.columns.len() > 1;
        for (index, (mut column, gaps)) in self.columns.into_iter().zip(&self.gaps).enumerate() {
            if gaps.count > 0 && gaps.count == column.samples.len() {
                if !gaps.text.is_empty() {
                    notes.push(format!(
                        "column \"{}\" has no value: \"{}\" and the like in every row",
                        column.name, gaps.text
                    ));
                } else if !is_unnamed(&column.name, index) {
                    notes.push(format!("column \"{}\" is empty", column.name));
                }
                continue;
            }
            if gaps.count > 0 && self.finite {
                return Err(RecordingError::Line {
                    path: self.path.into(),
                    line: gaps.line,
                    what: format!(
                        "\"{}\" in column \"{}\": {}",
                        gaps.text,
                        column.name,
                        if gaps.text.is_empty() {
                            "a number is needed"
                        } else {
                            LEAVE_OUT
                        }
                    ),
                });
            }
            if several && is_unnamed(&column.name, index) && is_counting(&column.samples) {
                notes.push(format!("column {} counts the rows", index + 1));
                continue;
            }
            if self.clocks[index] > 0 {
                if self.clocks[index] + gaps.count < column.samples.len() {
                    return Err(RecordingError::Content {
                        path: self.path.into(),
                        what: format!(
                            "column \"{}\" has clock times and other numbers; one of both is needed in every row",
                            column.name
                        ),
                    });
                }
                column.unit = FoundUnit::Known(SECONDS);
                notes.push(format!("column \"{}\" holds clock times", column.name));
            }
            column.samples.shrink_to_fit();
            columns.push(column);
            numbers.push(index + 1);
        }
        Ok(Raw {
            columns,
            numbers,
            worded_rate_hz: head.rate_hz,
            unnamed_line: head.columns.is_none().then_some(head.lines + 1),
            notes,
            ..Raw::default()
        })
    }

    /// Error that names the fault in a row of a text table whose fields are `fields`.
    fn row_error(&self, fields: &[&str]) -> RecordingError {
        if fields.len() != self.columns.len() {
            let commas = if self.dialect == Dialect::PLAIN && fields.len() > self.columns.len() {
                "; if numbers have decimal commas, save the file with semicolons between the columns, or with decimal points"
            } else {
                ""
            };
            return self.wrong(format!(
                "{} values, but the header has {} columns{commas}",
                fields.len(),
                self.columns.len()
            ));
        }
        let parsed = |field: &str| self.dialect.number(field);
        let is_number = |field: &str| parsed(field).is_some_and(|value| value.is_finite() || !self.finite);
        let wrong = fields
            .iter()
            .zip(&self.columns)
            .find(|(field, _)| !field.is_empty() && !is_number(field));
        self.wrong(match wrong {
            Some((field, column)) => {
                // The message shows at most 40 characters of the field, because a damaged file may have a very long
                // one.
                let shown: String = field.chars().take(40).collect();
                let needed = if parsed(field).is_some() {
                    LEAVE_OUT
                } else {
                    "a number is needed"
                };
                format!("\"{shown}\" in column \"{}\": {needed}", column.name)
            }
            None => match self.dialect.separator {
                Separator::Comma => "a number for each column is needed, with commas between".into(),
                _ => "a number for each column is needed".into(),
            },
        })
    }

    fn wrong(&self, what: String) -> RecordingError {
        RecordingError::Line {
            path: self.path.into(),
            line: self.line,
            what,
        }
    }
}

/// True if the samples count the rows of the table from 0 or 1, as the index column of a data frame does.
fn is_counting(samples: &[f64]) -> bool {
    let first = samples.first().copied().unwrap_or(f64::NAN);
    (first == 0.0 || first == 1.0)
        && samples
            .iter()
            .enumerate()
            .all(|(index, sample)| *sample == first + index as f64)
}
