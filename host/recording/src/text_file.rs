//! Text files as bytes in UTF-8 or Latin-1 with the line end `\n`, whatever encoding and line ends they have.

use std::fs::File;
use std::io::{Cursor, Read, Result, Seek, SeekFrom};
use std::path::Path;

/// Number of bytes in which a line end is sought: a choice, larger than any line of a table.
const FIRST: u64 = 1 << 16;

/// A text file, ready to be read.
pub(super) struct TextFile {
    pub(super) text: Box<dyn Read>,
    /// Length, bytes.
    pub(super) length: u64,
    /// What was converted; `None` for a file that is read as it is.
    pub(super) note: Option<String>,
}

/// Opens a text file. UTF-16 with a byte order mark and files with the line end `\r` alone are converted in memory;
/// others are read as they are.
pub(super) fn open(path: &Path) -> Result<TextFile> {
    let mut file = File::open(path)?;
    let length = file.metadata()?.len();
    let mut first = Vec::new();
    file.by_ref().take(FIRST).read_to_end(&mut first)?;
    file.seek(SeekFrom::Start(0))?;
    let is_big_endian = first.starts_with(b"\xfe\xff");
    let is_wide = is_big_endian || first.starts_with(b"\xff\xfe");
    let has_old_lines = !is_wide && first.contains(&b'\r') && !first.contains(&b'\n');
    if !is_wide && !has_old_lines {
        return Ok(TextFile {
            text: Box::new(file),
            length,
            note: None,
        });
    }
    let mut bytes = Vec::new();
    file.read_to_end(&mut bytes)?;
    let (mut text, mut note) = (bytes, None);
    if is_wide {
        text = utf8_of_utf16(&text, is_big_endian).into_bytes();
        note = Some("encoding UTF-16".to_owned());
    }
    if !text.contains(&b'\n') {
        text.iter_mut()
            .filter(|byte| **byte == b'\r')
            .for_each(|byte| *byte = b'\n');
        note.get_or_insert_with(|| "lines end with carriage returns".to_owned());
    }
    Ok(TextFile {
        length: text.len() as u64,
        text: Box::new(Cursor::new(text)),
        note,
    })
}

/// Text of UTF-16, without its byte order mark; what is no text becomes the replacement character.
fn utf8_of_utf16(bytes: &[u8], is_big_endian: bool) -> String {
    let (pairs, _) = bytes.as_chunks::<2>();
    let units = pairs.iter().skip(1).map(|&pair| {
        if is_big_endian {
            u16::from_be_bytes(pair)
        } else {
            u16::from_le_bytes(pair)
        }
    });
    char::decode_utf16(units)
        .map(|letter| letter.unwrap_or(char::REPLACEMENT_CHARACTER))
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(bytes: &[u8]) -> (String, Option<String>) {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.csv");
        std::fs::write(&path, bytes).unwrap();
        let mut file = open(&path).unwrap();
        let mut text = String::new();
        file.text.read_to_string(&mut text).unwrap();
        assert_eq!(text.len() as u64, file.length);
        (text, file.note)
    }

    #[test]
    fn wide_text_and_old_line_ends_are_converted() {
        let text = "t [s],a [m/s²]\r\n0,1\r\n";
        let wide = |order: fn(u16) -> [u8; 2]| -> Vec<u8> {
            std::iter::once(0xfeff)
                .chain(text.encode_utf16())
                .flat_map(order)
                .collect()
        };
        for bytes in [wide(u16::to_le_bytes), wide(u16::to_be_bytes)] {
            assert_eq!(
                read(&bytes),
                (text.to_owned(), Some("encoding UTF-16".to_owned()))
            );
        }
        assert_eq!(read(text.as_bytes()), (text.to_owned(), None));
        let (old, note) = read(b"t,a\r0,1\r1,2\r");
        assert_eq!(old, "t,a\n0,1\n1,2\n");
        assert!(note.is_some());
    }
}
