//! Reader of text tables: a row of names, then rows of numbers. [`super::text_head`] finds separator, decimal mark and
//! names.
//!
//! The file is read in chunks, so that its whole text is never in memory. Lines that start with `#`, `%` or `//` are
//! comments. Empty lines are skipped. Numbers may be quoted. Columns without any value are left out, as are, in a table
//! of several columns, unnamed ones that count the rows.

use std::fs::File;
use std::io::Read;
use std::path::Path;

use super::RecordingError;
use super::csv_number::{End, number};
use super::raw::{FoundUnit, Raw, RawColumn};
use super::text_dialect::{Dialect, Separator};
use super::text_head::{Head, HeadColumn, head, is_comment};
use crate::file::FileError;

/// Number of bytes of a text table that are read at once; a choice.
const CHUNK: usize = 1 << 18;

/// Largest length of the head of a text file, bytes: prose, names, units. A choice; the heads of logging programs have
/// a few kilobytes.
const HEAD_MAX: usize = 1 << 18;

/// Reads a text table. With `finite`, a NaN or infinite value, or an empty field in a column with values, is an error
/// that names its line.
pub(super) fn read(path: &Path, finite: bool) -> Result<Raw, RecordingError> {
    let unreadable = |cause| FileError::Read {
        path: path.into(),
        cause,
    };
    let file = File::open(path).map_err(unreadable)?;
    let length = file.metadata().map_err(unreadable)?.len();
    if length == 0 {
        return Err(RecordingError::Content {
            path: path.into(),
            what: "the file is empty; a row of names and then rows of numbers are needed".into(),
        });
    }
    let raw = table(path, file, length, CHUNK, finite)?;
    if raw.columns.iter().all(|column| column.samples.is_empty()) {
        return Err(RecordingError::Content {
            path: path.into(),
            what: "there are no samples; a header row and then numbers are needed".into(),
        });
    }
    Ok(raw)
}

/// Names of the columns of a text table, with their units in brackets, from the head of the file alone; empty if there
/// is no row of names or the head cannot be understood.
pub(super) fn titles(path: &Path) -> Result<Vec<String>, RecordingError> {
    let unreadable = |cause| FileError::Read {
        path: path.into(),
        cause,
    };
    let mut start = vec![0; HEAD_MAX];
    let mut file = File::open(path).map_err(unreadable)?;
    let filled = fill(&mut file, &mut start).map_err(unreadable)?;
    let columns = head(&start[..filled]).ok().and_then(|head| head.columns);
    Ok(columns
        .into_iter()
        .flatten()
        .map(|column| match column.unit {
            FoundUnit::Text(unit) => format!("{} [{unit}]", column.name),
            _ => column.name,
        })
        .collect())
}

/// Reads from `text` until `buffer` is full or the text ends; returns the number of bytes read.
fn fill(text: &mut impl Read, buffer: &mut [u8]) -> std::io::Result<usize> {
    let mut filled = 0;
    while filled < buffer.len() {
        match text.read(&mut buffer[filled..]) {
            Ok(0) => break,
            Ok(read) => filled += read,
            Err(error) if error.kind() == std::io::ErrorKind::Interrupted => {}
            Err(error) => return Err(error),
        }
    }
    Ok(filled)
}

/// Reads a text table of `length` bytes: first its head, then the rest in chunks of `chunk` bytes.
fn table(
    path: &Path,
    mut text: impl Read,
    length: u64,
    chunk: usize,
    finite: bool,
) -> Result<Raw, RecordingError> {
    let unreadable = |cause| FileError::Read {
        path: path.into(),
        cause,
    };
    let mut start = vec![0; HEAD_MAX.min(usize::try_from(length).unwrap_or(HEAD_MAX)).max(1)];
    let filled = fill(&mut text, &mut start).map_err(unreadable)?;
    start.truncate(filled);
    let head = head(&start).map_err(|(line, what)| RecordingError::Line {
        path: path.into(),
        line,
        what,
    })?;
    let mut table = Table::new(path, &head, length, finite);
    // The first `kept` bytes of the buffer hold the incomplete last line of the chunk read before.
    let mut text = start[head.offset.min(start.len())..].chain(text);
    let mut buffer = vec![0; chunk.max(1)];
    let mut kept = 0;
    loop {
        if kept == buffer.len() {
            buffer.resize(2 * kept, 0);
        }
        let read = match text.read(&mut buffer[kept..]) {
            Ok(read) => read,
            Err(error) if error.kind() == std::io::ErrorKind::Interrupted => continue,
            Err(cause) => return Err(unreadable(cause).into()),
        };
        let filled = &buffer[..kept + read];
        let whole = if read == 0 {
            filled.len()
        } else {
            filled
                .iter()
                .rposition(|&byte| byte == b'\n')
                .map_or(0, |at| at + 1)
        };
        table.lines(&filled[..whole])?;
        if read == 0 {
            return table.raw(head);
        }
        let end = kept + read;
        buffer.copy_within(whole..end, 0);
        kept = end - whole;
    }
}

/// Columns of a text table, filled while its lines are read.
struct Table<'a> {
    path: &'a Path,
    /// Number of lines of the text table that are read so far, those of the head included.
    line: u64,
    columns: Vec<RawColumn>,
    /// Empty fields of each column, in the order of `columns`.
    gaps: Vec<Gaps>,
    dialect: Dialect,
    /// Length of the whole file of the text table, bytes.
    bytes: u64,
    /// True if a NaN or infinite value, or an empty field in a column with values, is an error.
    finite: bool,
}

/// Empty fields of a column.
#[derive(Clone, Copy, Default)]
struct Gaps {
    count: usize,
    /// Number of the line with the first empty field of a column, from 1; 0 without empty fields.
    line: u64,
}

/// End of an error message about a row of a text table with NaN or infinity: what the user can do.
const LEAVE_OUT: &str = "a number is needed; repair the row, or leave it out with --from-s or --until-s";

impl<'a> Table<'a> {
    /// A table without samples yet, with the columns that the head of the text file names; unnamed columns are called
    /// by their number.
    fn new(path: &'a Path, head: &Head, bytes: u64, finite: bool) -> Self {
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
            bytes,
            finite,
        }
    }

    /// Parses the complete lines of a text table in `text`; only the last line of a file may lack its line end.
    fn lines(&mut self, text: &[u8]) -> Result<(), RecordingError> {
        let is_plain = self.dialect == Dialect::PLAIN && !self.columns.is_empty();
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
        self.make_room_after_first(text.len() - rest.len());
        Ok(rest)
    }

    /// Parses a line of numbers with the separator and decimal mark of the file; an empty field becomes NaN and is
    /// counted in the gaps of its column. A line of empty fields only is skipped.
    fn general_row(&mut self, line: &[u8]) -> Result<(), RecordingError> {
        let text = String::from_utf8_lossy(line);
        let fields = self.dialect.fields(text.trim_matches(['\n', '\r']));
        let extra = fields.get(self.columns.len()..).unwrap_or_default();
        if fields.len() < self.columns.len() || extra.iter().any(|field| !field.is_empty()) {
            return Err(self.row_error(&fields));
        }
        if fields.iter().all(|field| field.is_empty()) {
            return Ok(());
        }
        for index in 0..self.columns.len() {
            let field = fields[index];
            let value = if field.is_empty() {
                let gaps = &mut self.gaps[index];
                if gaps.count == 0 {
                    gaps.line = self.line;
                }
                gaps.count += 1;
                f64::NAN
            } else {
                match self.dialect.number(field) {
                    Some(value) if value.is_finite() || !self.finite => value,
                    _ => return Err(self.row_error(&fields)),
                }
            };
            self.columns[index].samples.push(value);
        }
        self.make_room_after_first(line.len());
        Ok(())
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
    fn raw(self, head: Head) -> Result<Raw, RecordingError> {
        let mut notes = head.notes;
        let is_unnamed = |name: &str, index: usize| {
            head.columns
                .as_ref()
                .is_some_and(|columns| columns[index].name.is_empty())
                && name.parse() == Ok(index + 1)
        };
        let mut columns = Vec::with_capacity(self.columns.len());
        let several = self.columns.len() > 1;
        for (index, (mut column, gaps)) in self.columns.into_iter().zip(&self.gaps).enumerate() {
            if gaps.count > 0 && gaps.count == column.samples.len() {
                if !is_unnamed(&column.name, index) {
                    notes.push(format!("column \"{}\" is empty", column.name));
                }
                continue;
            }
            if gaps.count > 0 && self.finite {
                return Err(RecordingError::Line {
                    path: self.path.into(),
                    line: gaps.line,
                    what: format!("\"\" in column \"{}\": a number is needed", column.name),
                });
            }
            if several && is_unnamed(&column.name, index) && is_counting(&column.samples) {
                notes.push(format!("column {} counts the rows", index + 1));
                continue;
            }
            column.samples.shrink_to_fit();
            columns.push(column);
        }
        Ok(Raw {
            columns,
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

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn parse(text: &[u8], chunk: usize) -> Result<Vec<Vec<f64>>, String> {
        table(Path::new("a.csv"), text, text.len() as u64, chunk, true)
            .map(|raw| raw.columns.into_iter().map(|column| column.samples).collect())
            .map_err(|error| error.to_string())
    }

    #[test]
    fn blanks_quotes_comments_and_line_ends_are_accepted() {
        let text = "\u{feff}\n# made by hand\n\"a [N]\", b\r\n 1 ,\"2\"\r\n\r\n# later\n3,\t-4e0  \n+5,6.";
        // The chunk size does not matter.
        for chunk in [1, 2, 7, 64, 4096] {
            assert_eq!(
                parse(text.as_bytes(), chunk),
                Ok(vec![vec![1.0, 3.0, 5.0], vec![2.0, -4.0, 6.0]]),
                "{chunk}"
            );
        }
    }

    #[test]
    fn a_malformed_row_is_reported_with_its_line() {
        for (row, words) in [
            ("1", "1 values"),
            ("1,2,3", "3 values"),
            ("1,", "\"\" in column \"b\""),
            ("1,2x", "\"2x\" in column \"b\""),
            ("\"1,2", "\"\"1\" in column \"a\""),
            ("1,inf", "\"inf\" in column \"b\""),
            ("1,2e308", "\"2e308\" in column \"b\""),
            ("1;2", "1 values"),
        ] {
            let said = parse(format!("a,b\n1,2\n{row}\n3,4\n").as_bytes(), 4).unwrap_err();
            assert!(said.contains("line 3") && said.contains(words), "{row}: {said}");
        }
        let said = parse(b"\xff\xfea\0,\0", 64).unwrap_err();
        assert!(said.contains("line 1") && said.contains("UTF-16"), "{said}");
    }

    #[test]
    fn tables_of_spreadsheets_and_loggers_are_read() {
        let two = |a: [f64; 2], b: [f64; 2]| Ok(vec![a.to_vec(), b.to_vec()]);
        for (text, expected) in [
            (&b"a,\xe4\n1,2\n3,4\n"[..], two([1.0, 3.0], [2.0, 4.0])),
            (b"a;b\n1,5;2\n3;4,25\n", two([1.5, 3.0], [2.0, 4.25])),
            (b"a\tb\n1\t2\n3\t4\n", two([1.0, 3.0], [2.0, 4.0])),
            (b"a b\n  1   2\n  3 4e0\n", two([1.0, 3.0], [2.0, 4.0])),
            (b"a,b,\n1,2,\n3,4,\n", two([1.0, 3.0], [2.0, 4.0])),
            (b"a,b\n1,2,\n3,4,\n", two([1.0, 3.0], [2.0, 4.0])),
            (b",a,b\n0,1,2\n1,3,4\n", two([1.0, 3.0], [2.0, 4.0])),
            (b"a,Comment,b\n1,,2\n3,,4\n,,\n", two([1.0, 3.0], [2.0, 4.0])),
            (b"% made\na,b\n1,2\n% later\n3,4\n", two([1.0, 3.0], [2.0, 4.0])),
        ] {
            let shown = String::from_utf8_lossy(text);
            assert_eq!(parse(text, 5), expected, "{shown}");
        }
        let said = parse(b"a;b\n1,5;2\n3;x\n", 64).unwrap_err();
        assert!(
            said.contains("line 3") && said.contains("\"x\" in column \"b\""),
            "{said}"
        );
    }

    proptest! {
        /// Numbers are parsed to the same bits as by the standard library.
        #[test]
        fn numbers_are_exact(values in prop::collection::vec(any::<f64>().prop_filter("finite, with fewer digits too", |v| v.abs() < 1e308), 1..20), digits in 0usize..20) {
            let texts: Vec<String> = values.iter().map(|value| format!("{value:.digits$e}")).collect();
            let expected: Vec<f64> = texts.iter().map(|text| text.parse().unwrap()).collect();
            prop_assert_eq!(parse(format!("a\n{}", texts.join("\n")).as_bytes(), 100), Ok(vec![expected]));
        }

        /// Arbitrary bytes give a value or an error, never a panic.
        #[test]
        fn damaged_text_never_panics(bytes in prop::collection::vec(any::<u8>(), 0..200)) {
            let _ = parse(&bytes, 16);
            let _ = parse(&[b"a,b\n".as_slice(), &bytes].concat(), 16);
        }
    }
}
