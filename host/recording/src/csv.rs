//! Reader of text tables: a row of names, then rows of numbers. [`super::text_head`] finds separator, decimal mark and
//! names.
//!
//! The file is read in chunks, so that its whole text is never in memory. [`super::text_rows`] reads the rows.

use std::io::Read;
use std::path::Path;

use super::RecordingError;
use super::raw::{FoundUnit, Raw};
use super::text_file;
use super::text_head::head;
use super::text_rows::Table;
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
    let text_file::TextFile { text, length, note } = text_file::open(path).map_err(unreadable)?;
    if length == 0 {
        return Err(RecordingError::Content {
            path: path.into(),
            what: "the file is empty; a row of names and then rows of numbers are needed".into(),
        });
    }
    let mut raw = table(path, text, length, CHUNK, finite)?;
    raw.notes.extend(note);
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
    let mut file = text_file::open(path).map_err(unreadable)?;
    let filled = fill(&mut file.text, &mut start).map_err(unreadable)?;
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
        let whole = filled
            .iter()
            .rposition(|&byte| byte == b'\n')
            .map_or(0, |at| at + 1);
        table.lines(&filled[..whole])?;
        if read == 0 {
            table.last_line(&filled[whole..])?;
            return table.raw(head);
        }
        let end = kept + read;
        buffer.copy_within(whole..end, 0);
        kept = end - whole;
    }
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

    #[test]
    fn a_cut_off_last_line_and_text_after_the_numbers_are_left_out() {
        let kept = Ok(vec![vec![1.0, 3.0], vec![2.0, 4.0]]);
        for text in [
            "a,b\n1,2\n3,4\n5",
            "a,b\n1,2\n3,4\n5,-",
            "a,b\n1,2\n3,4\n5,1e",
            "a,b\n1,2\n3,4\nend of data\n",
            "a,b\n1,2\n3,4\n\nend,of,data\nsaved by Huber",
        ] {
            for chunk in [1, 64] {
                assert_eq!(parse(text.as_bytes(), chunk), kept, "{text}");
            }
        }
        for text in [
            "a,b\n1,2\n5,x",
            "a,b\n1,2\n5\n",
            "a,b\n1,2\nstop\n3,4\n",
            "a,b\n1,2\n0.0O3,4\n",
        ] {
            let said = parse(text.as_bytes(), 3).unwrap_err();
            assert!(said.contains("line 3"), "{text}: {said}");
        }
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
