//! Sequential reader of the elements of a MAT-file or of a compressed element.

use std::io::{BufRead, ErrorKind, Read, copy, sink};

use super::value::text_of_codes;
use crate::binary_number::NumberType;

/// Number of bytes of a MAT-file that are read at once; a choice. It is a multiple of the size of every number type.
pub(super) const CHUNK: usize = 1 << 16;

/// Largest length that is accepted for an element of a MAT-file with flags, dimensions, names or a text, bytes. A
/// choice; it holds 64 field names of 64 bytes.
pub(super) const SMALL_MAX: u64 = 4096;

/// Type of the numbers of MAT data type `kind`; `None` if the data type is not numeric.
pub(super) fn number_type(kind: u32) -> Option<NumberType> {
    Some(match kind {
        1 => NumberType::I8,
        2 => NumberType::U8,
        3 => NumberType::I16,
        4 => NumberType::U16,
        5 => NumberType::I32,
        6 => NumberType::U32,
        7 => NumberType::F32,
        9 => NumberType::F64,
        12 => NumberType::I64,
        13 => NumberType::U64,
        _ => return None,
    })
}

/// Decodes a 32-bit unsigned integer from the first four bytes.
pub(super) fn word(bytes: &[u8], big_endian: bool) -> u32 {
    let array = [bytes[0], bytes[1], bytes[2], bytes[3]];
    if big_endian {
        u32::from_be_bytes(array)
    } else {
        u32::from_le_bytes(array)
    }
}

/// Tag of a data element in a MAT-file.
pub(super) struct Tag {
    /// Code of the data type of the element, for example 1 (miINT8) or 16 (miUTF8).
    pub(super) kind: u32,
    /// Length of the data, bytes.
    pub(super) length: u64,
    /// Data of a small element (up to four bytes), stored inside its tag instead of after it; `None` for other
    /// elements.
    inside: Option<[u8; 4]>,
}

/// Sequential reader of the elements of a file or of a compressed element.
pub(super) struct Source<'a> {
    pub(super) reader: &'a mut dyn BufRead,
    /// Offset of the next byte.
    pub(super) at: u64,
    /// Upper bound of the bytes that can still be read: length of the whole file or element, not reduced by reading.
    pub(super) available: u64,
    pub(super) big_endian: bool,
}

impl Source<'_> {
    /// True if the file or the compressed element has no more bytes.
    pub(super) fn is_at_end(&mut self) -> Result<bool, String> {
        self.reader
            .fill_buf()
            .map(<[u8]>::is_empty)
            .map_err(|error| error.to_string())
    }

    /// Reads exactly as many bytes as `bytes` holds.
    fn fill(&mut self, bytes: &mut [u8]) -> Result<(), String> {
        self.reader
            .read_exact(bytes)
            .map_err(|error| match error.kind() {
                ErrorKind::UnexpectedEof => self.cut_off(bytes.len() as u64),
                _ => format!("after byte {}: {error}", self.at),
            })?;
        self.at += bytes.len() as u64;
        Ok(())
    }

    /// Error message for a MAT-file that ends within an element of `length` bytes.
    pub(super) fn cut_off(&self, length: u64) -> String {
        format!(
            "it ends within an element of {length} bytes at byte {}: it is cut off",
            self.at
        )
    }

    /// Reads the next tag.
    pub(super) fn tag(&mut self) -> Result<Tag, String> {
        let mut bytes = [0; 4];
        self.fill(&mut bytes)?;
        let first = word(&bytes, self.big_endian);
        self.fill(&mut bytes)?;
        let small = first >> 16;
        if small > 4 {
            return Err(format!(
                "an element at byte {} has {small} bytes in 4",
                self.at - 8
            ));
        }
        Ok(if small > 0 {
            Tag {
                kind: first & 0xffff,
                length: u64::from(small),
                inside: Some(bytes),
            }
        } else {
            Tag {
                kind: first,
                length: u64::from(word(&bytes, self.big_endian)),
                inside: None,
            }
        })
    }

    /// Reads the next element of a MAT-file that holds flags, dimensions or names: at most [`SMALL_MAX`] bytes.
    pub(super) fn small(&mut self) -> Result<Vec<u8>, String> {
        let tag = self.tag()?;
        if tag.length > SMALL_MAX {
            return Err(format!(
                "flags, dimensions or a name of {} bytes at byte {}; at most {SMALL_MAX} are possible",
                tag.length, self.at
            ));
        }
        let mut data = Vec::new();
        self.chunks(&tag, |chunk| data.extend_from_slice(chunk))?;
        Ok(data)
    }

    /// Reads the text in an element of a MAT-file: UTF-8, UTF-16 or bytes.
    pub(super) fn text(&mut self, tag: &Tag) -> Result<String, String> {
        let mut codes = Vec::new();
        // Texts in UTF-8 (data type 16) are read byte by byte, texts in UTF-16 (data type 17) code by code.
        let number = match tag.kind {
            16 => NumberType::U8,
            17 => NumberType::U16,
            kind => match number_type(kind) {
                Some(number) => number,
                None => return Ok(String::new()),
            },
        };
        self.numbers(tag, number, |code| codes.push(code as u32))?;
        Ok(text_of_codes(&codes, number.size() == 1))
    }

    /// Reads the numbers of an element with tag `tag` and passes each to `take`.
    pub(super) fn numbers(
        &mut self,
        tag: &Tag,
        number: NumberType,
        mut take: impl FnMut(f64),
    ) -> Result<(), String> {
        let big_endian = self.big_endian;
        self.chunks(tag, |chunk| number.decode(chunk, big_endian, &mut take))
    }

    /// Reads the data of an element in chunks, passes each chunk to `take`, and skips the padding to a multiple of 8
    /// bytes.
    fn chunks(&mut self, tag: &Tag, mut take: impl FnMut(&[u8])) -> Result<(), String> {
        if let Some(inside) = &tag.inside {
            take(&inside[..tag.length as usize]);
            return Ok(());
        }
        if tag.length > self.available {
            return Err(self.cut_off(tag.length));
        }
        let mut chunk = vec![0; CHUNK.min(tag.length as usize)];
        let mut left = tag.length as usize;
        while left > 0 {
            let length = left.min(CHUNK);
            self.fill(&mut chunk[..length])?;
            take(&chunk[..length]);
            left -= length;
        }
        self.pad(tag.length)
    }

    /// Skips the padding after an element of `length` bytes; the padding of the last element may be missing.
    fn pad(&mut self, length: u64) -> Result<(), String> {
        let padding = length.next_multiple_of(8) - length;
        let read = copy(&mut (&mut *self.reader).take(padding), &mut sink());
        self.at += read.map_err(|error| error.to_string())?;
        Ok(())
    }

    /// Lets `read` read the data of one element, limits it to that element, and skips the data that `read` leaves
    /// unread and the padding.
    pub(super) fn within<T>(
        &mut self,
        tag: &Tag,
        read: impl FnOnce(&mut Source<'_>) -> Result<T, String>,
    ) -> Result<T, String> {
        if tag.length > self.available {
            return Err(self.cut_off(tag.length));
        }
        let end = self.at + tag.length;
        let mut data = (&mut *self.reader).take(tag.length);
        let found = read(&mut Source {
            reader: &mut data,
            at: self.at,
            available: tag.length,
            big_endian: self.big_endian,
        })?;
        copy(&mut data, &mut sink()).map_err(|error| error.to_string())?;
        if data.limit() > 0 {
            return Err(self.cut_off(tag.length));
        }
        self.at = end;
        self.pad(tag.length)?;
        Ok(found)
    }

    /// Skips an element.
    pub(super) fn skip(&mut self, tag: &Tag) -> Result<(), String> {
        if tag.inside.is_some() {
            return Ok(());
        }
        self.within(tag, |_| Ok(()))
    }
}
