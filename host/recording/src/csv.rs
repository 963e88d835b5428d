//! Reader and writer of CSV recordings: a header row with `name [unit]` per column, then rows of numbers.
//!
//! Files of hundreds of megabytes are read in chunks, without the whole text in memory. Lines that start with `#` are comments. Empty lines
//! are skipped. Numbers may be quoted.

use std::fs::File;
use std::io::Read;
use std::path::Path;

use super::raw::{Raw, RawColumn};
use super::{Quantity, Recording, RecordingError};
use crate::file::{FileError, Prepared};

/// Significant digits of written samples: nine digits represent every 32-bit float exactly.
const DIGITS: usize = 9;

/// Chunk size of reading, bytes; a choice.
const CHUNK: usize = 1 << 18;

/// Reads a CSV file. With `finite`, a NaN or infinite value is an error that names its line.
pub(super) fn read(path: &Path, finite: bool) -> Result<Raw, RecordingError> {
    let unreadable = |cause| FileError::Read {
        path: path.into(),
        cause,
    };
    let file = File::open(path).map_err(unreadable)?;
    let length = file.metadata().map_err(unreadable)?.len();
    let columns = columns(path, file, length, CHUNK, finite)?;
    if columns.iter().all(|column| column.samples.is_empty()) {
        return Err(RecordingError::Content {
            path: path.into(),
            what: "there are no samples; a header row and then numbers are needed".into(),
        });
    }
    Ok(Raw {
        columns,
        sample_rate_hz: None,
        start_s: 0.0,
    })
}

/// Reads the columns of a text of `length` bytes, in chunks of `chunk` bytes.
fn columns(
    path: &Path,
    mut text: impl Read,
    length: u64,
    chunk: usize,
    finite: bool,
) -> Result<Vec<RawColumn>, RecordingError> {
    let mut table = Table {
        path,
        line: 0,
        columns: Vec::new(),
        bytes: length,
        finite,
    };
    // The first `kept` bytes of the buffer hold the incomplete last line of the previous chunk.
    let mut buffer = vec![0; chunk.max(1)];
    let mut kept = 0;
    loop {
        if kept == buffer.len() {
            buffer.resize(2 * kept, 0);
        }
        let read = match text.read(&mut buffer[kept..]) {
            Ok(read) => read,
            Err(error) if error.kind() == std::io::ErrorKind::Interrupted => continue,
            Err(cause) => {
                return Err(FileError::Read {
                    path: path.into(),
                    cause,
                }
                .into());
            }
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
            for column in &mut table.columns {
                column.samples.shrink_to_fit();
            }
            return Ok(table.columns);
        }
        let end = kept + read;
        buffer.copy_within(whole..end, 0);
        kept = end - whole;
    }
}

/// Columns of a CSV file while its lines are read.
struct Table<'a> {
    path: &'a Path,
    /// Number of lines read so far.
    line: u64,
    /// Columns with their samples; empty until the header is read.
    columns: Vec<RawColumn>,
    /// Length of the whole file, bytes.
    bytes: u64,
    /// True if NaN and infinite values are errors.
    finite: bool,
}

/// Message part: remedy for a row with NaN or infinity.
const LEAVE_OUT: &str = "a number is needed; repair the row, or leave it out with --from-s or --until-s";

impl Table<'_> {
    /// Parses complete lines; only the last line of a file may lack its line end.
    fn lines(&mut self, text: &[u8]) -> Result<(), RecordingError> {
        let mut rest = text;
        while !rest.is_empty() {
            self.line += 1;
            if self.columns.is_empty() || matches!(rest[0], b'#' | b'\n' | b'\r' | b' ' | b'\t') {
                let end = rest.iter().position(|&byte| byte == b'\n');
                let (line, after) = rest.split_at(end.map_or(rest.len(), |at| at + 1));
                rest = after;
                let line = line.trim_ascii();
                match line.first() {
                    None | Some(b'#') => {}
                    Some(_) if self.columns.is_empty() => self.header(line)?,
                    Some(_) => {
                        self.row(line)?;
                    }
                }
            } else {
                rest = self.row(rest)?;
            }
        }
        Ok(())
    }

    /// Parses the header row into columns.
    fn header(&mut self, line: &[u8]) -> Result<(), RecordingError> {
        // Byte order mark of UTF-8, written by some editors.
        let line = line.strip_prefix(b"\xef\xbb\xbf").unwrap_or(line);
        let text = std::str::from_utf8(line).map_err(|error| {
            self.wrong(format!(
                "byte {} of the header is not UTF-8; a text file is needed",
                error.valid_up_to() + 1
            ))
        })?;
        let mut reader = csv::ReaderBuilder::new()
            .has_headers(false)
            .trim(csv::Trim::All)
            .from_reader(text.as_bytes());
        let mut titles = csv::StringRecord::new();
        reader
            .read_record(&mut titles)
            .map_err(|error| self.wrong(error.to_string()))?;
        for title in &titles {
            let column = self.column(title)?;
            self.columns.push(column);
        }
        Ok(())
    }

    /// Parses one column header, `name [unit]` or `name`.
    fn column(&self, title: &str) -> Result<RawColumn, RecordingError> {
        let (name, unit) = match title.strip_suffix(']').and_then(|inner| inner.rsplit_once('[')) {
            Some((name, unit)) => {
                let unit = unit.parse().map_err(|cause| RecordingError::Unit {
                    path: self.path.into(),
                    column: title.into(),
                    cause,
                })?;
                (name.trim(), Some(unit))
            }
            None => (title, None),
        };
        let is_number = name.parse::<f64>().is_ok();
        if name.is_empty() || is_number {
            return Err(self.wrong(if is_number {
                format!("the header has the number {name}; a row of names is needed before the numbers")
            } else {
                "a column has no name; every column needs one, as in \"ax [m/s^2]\"".into()
            }));
        }
        Ok(RawColumn {
            name: name.into(),
            unit,
            samples: Vec::new(),
        })
    }

    /// Parses the numbers of the first line of `text` and returns the text after this line.
    fn row<'t>(&mut self, text: &'t [u8]) -> Result<&'t [u8], RecordingError> {
        let mut rest = text;
        for index in 0..self.columns.len() {
            let is_last = index + 1 == self.columns.len();
            let parsed = number(rest).filter(|&(value, _, end)| {
                (value.is_finite() || !self.finite) && end == if is_last { End::Line } else { End::Field }
            });
            let Some((value, length, _)) = parsed else {
                return Err(self.row_error(text));
            };
            self.columns[index].samples.push(value);
            rest = &rest[length..];
        }
        if self
            .columns
            .first()
            .is_some_and(|column| column.samples.len() == 1)
        {
            self.make_room(text.len() - rest.len());
        }
        Ok(rest)
    }

    /// Reserves memory for all samples, from the file length and the length of the first row. Growth by doubling could take twice the memory.
    fn make_room(&mut self, line: usize) {
        let lines = usize::try_from(self.bytes).unwrap_or(0) / line.max(1);
        // Later rows are often longer, since time gets more digits. The surplus is small, and unused memory is not committed.
        for column in &mut self.columns {
            column.samples.reserve_exact(lines);
        }
    }

    /// Error that describes the fault in the first line of `text`.
    fn row_error(&self, text: &[u8]) -> RecordingError {
        let end = text.iter().position(|&byte| byte == b'\n').unwrap_or(text.len());
        let line = String::from_utf8_lossy(&text[..end]);
        let fields: Vec<&str> = line.split(',').map(str::trim).collect();
        if fields.len() != self.columns.len() {
            return self.wrong(format!(
                "{} values, but the header has {} columns",
                fields.len(),
                self.columns.len()
            ));
        }
        let parsed = |field: &str| {
            number(field.as_bytes())
                .filter(|&(_, length, _)| length == field.len())
                .map(|(value, ..)| value)
        };
        let is_number = |field: &str| parsed(field).is_some_and(|value| value.is_finite() || !self.finite);
        let wrong = fields
            .iter()
            .zip(&self.columns)
            .find(|(field, _)| !is_number(field));
        self.wrong(match wrong {
            Some((field, column)) => {
                // At most 40 characters: a damaged file may have a very long field.
                let shown: String = field.chars().take(40).collect();
                let needed = if parsed(field).is_some() {
                    LEAVE_OUT
                } else {
                    "a number is needed"
                };
                format!("\"{shown}\" in column \"{}\": {needed}", column.name)
            }
            None => "a number for each column is needed, with commas between".into(),
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

/// Separator after a number.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum End {
    /// Comma: another field follows.
    Field,
    /// End of the line or of the file.
    Line,
}

/// Parses the number at the start of `text`, with optional blanks and quotes. Returns its value, the number of bytes up to and including the
/// separator, and the separator.
#[inline]
fn number(text: &[u8]) -> Option<(f64, usize, End)> {
    // Fast path: a number without blanks and quotes.
    if let Ok((value, length)) = fast_float2::parse_partial::<f64, _>(text) {
        match &text[length..] {
            [b',', ..] => return Some((value, length + 1, End::Field)),
            [b'\n', ..] => return Some((value, length + 1, End::Line)),
            [] => return Some((value, length, End::Line)),
            _ => {}
        }
    }
    let blanks = |text: &[u8]| {
        text.iter()
            .take_while(|byte| matches!(byte, b' ' | b'\t' | b'\r'))
            .count()
    };
    let mut at = blanks(text);
    let is_quoted = text.get(at) == Some(&b'"');
    if is_quoted {
        at += 1;
        at += blanks(&text[at..]);
    }
    let (value, length) = fast_float2::parse_partial::<f64, _>(&text[at..]).ok()?;
    at += length;
    at += blanks(&text[at..]);
    if is_quoted {
        if text.get(at) != Some(&b'"') {
            return None;
        }
        at += 1;
        at += blanks(&text[at..]);
    }
    match text.get(at) {
        Some(b',') => Some((value, at + 1, End::Field)),
        Some(b'\n') => Some((value, at + 1, End::Line)),
        None => Some((value, at, End::Line)),
        Some(_) => None,
    }
}

/// A recording as a CSV file that is written but not yet published: time in seconds, then one column per channel.
pub(super) fn prepared(path: &Path, recording: &Recording) -> Result<Prepared, RecordingError> {
    Ok(crate::file::prepare(path, |writer| {
        let mut writer = csv::Writer::from_writer(writer);
        let titles = recording.channels.iter().map(|channel| match channel.quantity {
            Quantity::Unknown => channel.name.clone(),
            quantity => format!("{} [{}]", channel.name, quantity.unit()),
        });
        writer.write_record(std::iter::once("t [s]".into()).chain(titles))?;
        let mut row: Vec<String> = Vec::with_capacity(recording.channels.len() + 1);
        for sample in 0..recording.len() {
            row.clear();
            // Time is written with all digits: nine digits resolve only 10 µs after an hour.
            row.push(recording.time_s(sample).to_string());
            row.extend(
                recording
                    .channels
                    .iter()
                    .map(|channel| number_text(channel.samples[sample])),
            );
            writer.write_record(&row)?;
        }
        writer.flush()
    })?)
}

/// Shortest text of a number with [`DIGITS`] significant digits.
fn number_text(value: f64) -> String {
    let rounded: f64 = format!("{value:.*e}", DIGITS - 1).parse().unwrap_or(value);
    let plain = rounded.to_string();
    let exponent = format!("{rounded:e}");
    if exponent.len() < plain.len() {
        exponent
    } else {
        plain
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn parse(text: &[u8], chunk: usize) -> Result<Vec<Vec<f64>>, String> {
        columns(Path::new("a.csv"), text, text.len() as u64, chunk, true)
            .map(|columns| columns.into_iter().map(|column| column.samples).collect())
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
        let said = parse(b"a,\xe4\n1,2\n", 64).unwrap_err();
        assert!(said.contains("line 1") && said.contains("byte 3"), "{said}");
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
