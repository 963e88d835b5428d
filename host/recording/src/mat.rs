//! MAT-files of level 5, compressed or not: every real numeric vector is a channel.
//!
//! The longer side of a matrix is time: of a matrix N × 3 the columns are channels, of a matrix 3 × N the rows. The columns of
//! a square matrix are channels.
//!
//! The format is documented by MathWorks ("MAT-File Format", level 5). Text, structures, objects and sparse arrays
//! are passed over; level 7.3 is HDF5 and is refused. A vector of which there is one sample is a parameter, no channel.
//!
//! A file is read in pieces and its numbers go straight to their channels: a long record is in memory once. Memory is
//! bounded by the length of the file, not by the sizes that its headers state.

use std::fs::File;
use std::io::{BufRead, BufReader, ErrorKind, Read, copy, sink};
use std::path::Path;

use flate2::bufread::ZlibDecoder;

use super::RecordingError;
use super::raw::{Raw, RawColumn};
use crate::file::FileError;

/// Bytes of the file header.
const HEADER: usize = 128;

/// Bytes that are read at once; a multiple of every number's size.
const PIECE: usize = 1 << 16;

/// The most that deflate packs into a byte: a compressed element that states more is damaged.
const INFLATION_MAX: u64 = 1032;

/// Bytes of values that any file may hold: a million samples of eight channels that were not connected, whose zeros are
/// compressed to nearly nothing.
const VALUES_MIN: u64 = 64 << 20;

/// Bytes of values that a file may hold for each of its own bytes. Bytes that become 8-byte numbers take a factor of 8; measured
/// channels are compressed by a factor below 20.
const VALUES_PER_BYTE: u64 = 200;

/// Values to make room for before any has been read, where the file is shorter.
const TRUSTED: u64 = 1 << 16;

/// Bytes of an element that holds flags, dimensions or a name. Names have up to 63 characters.
const SMALL_MAX: u64 = 4096;

const COMPRESSED: u32 = 15;
const MATRIX: u32 = 14;

pub(super) fn read(path: &Path) -> Result<Raw, RecordingError> {
    let unreadable = |cause| FileError::Read {
        path: path.into(),
        cause,
    };
    let file = File::open(path).map_err(unreadable)?;
    let length = file.metadata().map_err(unreadable)?.len();
    let content = |what: String| RecordingError::Content {
        path: path.into(),
        what,
    };
    let variables = variables(&mut BufReader::with_capacity(PIECE, file), length).map_err(content)?;
    let longest = variables.iter().map(Variable::samples).max().unwrap_or(0);
    let columns: Vec<RawColumn> = variables
        .into_iter()
        .filter(|variable| longest > 1 && variable.samples() == longest)
        .flat_map(Variable::into_columns)
        .collect();
    if columns.is_empty() {
        return Err(content(
            "it has no numeric vector that could be a channel (text, structures and objects are passed over)"
                .into(),
        ));
    }
    Ok(Raw {
        columns,
        sample_rate_hz: None,
        start_s: 0.0,
    })
}

/// A real numeric matrix: a vector is one column, however it lies.
struct Variable {
    name: String,
    /// The channels, all of one length.
    values: Vec<Vec<f64>>,
}

impl Variable {
    /// Samples of each channel: the longer side.
    fn samples(&self) -> usize {
        self.values.first().map_or(0, Vec::len)
    }

    fn into_columns(self) -> Vec<RawColumn> {
        let is_one = self.values.len() == 1;
        let name = |index: usize| match is_one {
            true => self.name.clone(),
            false => format!("{}{}", self.name, index + 1),
        };
        self.values
            .into_iter()
            .enumerate()
            .map(|(index, samples)| RawColumn {
                name: name(index),
                unit: None,
                samples,
            })
            .collect()
    }
}

/// All real numeric matrices of a file of `length` bytes.
fn variables(reader: &mut dyn BufRead, length: u64) -> Result<Vec<Variable>, String> {
    let mut header = Vec::with_capacity(HEADER);
    reader
        .take(HEADER as u64)
        .read_to_end(&mut header)
        .map_err(|error| error.to_string())?;
    if header.len() < HEADER {
        return Err(format!(
            "{} bytes; a MAT-file has a header of {HEADER}",
            header.len()
        ));
    }
    if header.starts_with(b"MATLAB 7.3") || header.starts_with(b"\x89HDF") {
        return Err("level 7.3 (HDF5) is not read; save it with -v7".into());
    }
    let big_endian = match &header[126..128] {
        b"IM" => false,
        b"MI" => true,
        other => {
            return Err(format!(
                "bytes 126 and 127 are {other:?}; a MAT-file of level 5 has IM or MI there"
            ));
        }
    };
    let mut source = Source {
        reader,
        at: HEADER as u64,
        room: length,
        big_endian,
    };
    let mut room = ValueRoom {
        file: length,
        bytes: length.saturating_mul(VALUES_PER_BYTE).max(VALUES_MIN),
    };
    let mut variables = Vec::new();
    while !source.is_at_end()? {
        let tag = source.tag()?;
        match tag.kind {
            COMPRESSED => variables.extend(inflated(&mut source, tag.length, &mut room)?),
            MATRIX => variables.extend(source.within(&tag, |inner| matrix(inner, &mut room))?),
            _ => source.skip(&tag)?,
        }
    }
    Ok(variables)
}

/// Memory for the values of a file.
struct ValueRoom {
    /// Bytes of the file.
    file: u64,
    /// Bytes of values that it may still hold.
    bytes: u64,
}

impl ValueRoom {
    /// Takes the room of `count` values of a variable.
    fn take(&mut self, name: &str, count: u64) -> Result<(), String> {
        let needed = count.saturating_mul(size_of::<f64>() as u64);
        self.bytes = self.bytes.checked_sub(needed).ok_or_else(|| {
            format!(
                "variable \"{name}\" has {count} values, which inflate a file of {} bytes beyond {} times its length; no \
                 recording is compressed so far: the file is damaged, or save it without compression (-v6)",
                self.file, VALUES_PER_BYTE
            )
        })?;
        Ok(())
    }

    /// Values of a channel to make room for before they are read, where a variable has `channels`.
    fn trusted(&self, channels: usize) -> usize {
        usize::try_from(self.file.max(TRUSTED) / channels.max(1) as u64 + 1).unwrap_or(usize::MAX)
    }
}

/// The matrix in a compressed element of `length` bytes.
fn inflated(source: &mut Source<'_>, length: u64, room: &mut ValueRoom) -> Result<Option<Variable>, String> {
    if length > source.room {
        return Err(source.cut_off(length));
    }
    let before = source.at + length;
    let inflated_max = length.saturating_mul(INFLATION_MAX);
    let mut packed = (&mut *source.reader).take(length);
    let mut inflated = BufReader::with_capacity(PIECE, ZlibDecoder::new(&mut packed).take(inflated_max));
    let mut inner = Source {
        reader: &mut inflated,
        at: 0,
        room: inflated_max,
        big_endian: source.big_endian,
    };
    let found = inner.tag().and_then(|tag| match tag.kind {
        MATRIX => inner.within(&tag, |inner| matrix(inner, room)),
        _ => Ok(None),
    });
    let found =
        found.map_err(|what| format!("a compressed element before byte {before} is damaged: {what}"))?;
    drop(inflated);
    copy(&mut packed, &mut sink()).map_err(|error| error.to_string())?;
    source.at = before;
    Ok(found)
}

/// The matrix in the data of a matrix element; `None` where it is none of real numbers.
fn matrix(source: &mut Source<'_>, room: &mut ValueRoom) -> Result<Option<Variable>, String> {
    let flags = source.small()?;
    let Some(flags) = flags.get(..4) else {
        return Ok(None);
    };
    let flags = word(flags, source.big_endian);
    let (class, complex, logical) = (flags & 0xff, flags & 0x800 != 0, flags & 0x200 != 0);
    // Classes 6 to 15 are double, single and the integers.
    if !(6..=15).contains(&class) || complex || logical {
        return Ok(None);
    }
    let dimensions: Vec<usize> = source
        .small()?
        .chunks_exact(4)
        .map(|bytes| word(bytes, source.big_endian) as usize)
        .collect();
    let &[rows, columns] = dimensions.as_slice() else {
        return Ok(None);
    };
    let name = String::from_utf8_lossy(&source.small()?).into_owned();
    let tag = source.tag()?;
    let size = size_of_kind(tag.kind).ok_or_else(|| {
        format!(
            "variable \"{name}\" has data of type {}; a number type from 1 to 13 was expected",
            tag.kind
        )
    })?;
    let count = (tag.length / size as u64) as usize;
    if rows.checked_mul(columns) != Some(count) {
        return Err(format!(
            "variable \"{name}\" is {rows} by {columns}, but has {count} values"
        ));
    }
    if tag.length > source.room {
        return Err(source.cut_off(tag.length));
    }
    room.take(&name, count as u64)?;
    let (samples, channels) = (rows.max(columns), rows.min(columns));
    let trusted = samples.min(room.trusted(channels));
    let mut values: Vec<Vec<f64>> = Vec::new();
    // Values come column by column.
    let in_rows = rows < columns;
    let mut index = 0;
    source.numbers(&tag, |value| {
        let channel = if in_rows { index % rows } else { index / rows };
        index += 1;
        match values.get_mut(channel) {
            Some(samples) => samples.push(value),
            None => {
                let mut samples = Vec::with_capacity(trusted);
                samples.push(value);
                values.push(samples);
            }
        }
    })?;
    Ok(Some(Variable { name, values }))
}

/// Bytes of a number as it is stored; `None` where a type is no number.
fn size_of_kind(kind: u32) -> Option<usize> {
    Some(match kind {
        1 | 2 => 1,
        3 | 4 => 2,
        5..=7 => 4,
        9 | 12 | 13 => 8,
        _ => return None,
    })
}

/// Numbers as they are stored: a matrix of doubles may be stored in a smaller type where that loses nothing.
fn decode(kind: u32, data: &[u8], big_endian: bool, mut take: impl FnMut(f64)) {
    macro_rules! decode {
        ($type:ty) => {
            for bytes in data.chunks_exact(size_of::<$type>()) {
                let mut array = [0; size_of::<$type>()];
                array.copy_from_slice(bytes);
                take(if big_endian {
                    <$type>::from_be_bytes(array) as f64
                } else {
                    <$type>::from_le_bytes(array) as f64
                });
            }
        };
    }
    match kind {
        1 => decode!(i8),
        2 => decode!(u8),
        3 => decode!(i16),
        4 => decode!(u16),
        5 => decode!(i32),
        6 => decode!(u32),
        7 => decode!(f32),
        9 => decode!(f64),
        12 => decode!(i64),
        13 => decode!(u64),
        _ => {}
    }
}

fn word(bytes: &[u8], big_endian: bool) -> u32 {
    let array = [bytes[0], bytes[1], bytes[2], bytes[3]];
    if big_endian {
        u32::from_be_bytes(array)
    } else {
        u32::from_le_bytes(array)
    }
}

/// What stands before the data of an element.
struct Tag {
    kind: u32,
    /// Bytes of data.
    length: u64,
    /// The data, where it stands within the tag: up to four bytes do.
    inside: Option<[u8; 4]>,
}

/// Bytes in their order.
struct Source<'a> {
    reader: &'a mut dyn BufRead,
    at: u64,
    /// More bytes than this there cannot be.
    room: u64,
    big_endian: bool,
}

impl Source<'_> {
    fn is_at_end(&mut self) -> Result<bool, String> {
        self.reader
            .fill_buf()
            .map(<[u8]>::is_empty)
            .map_err(|error| error.to_string())
    }

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

    fn cut_off(&self, length: u64) -> String {
        format!(
            "it ends within an element of {length} bytes at byte {}: it is cut off",
            self.at
        )
    }

    /// The next tag.
    fn tag(&mut self) -> Result<Tag, String> {
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

    /// The data of the next element, which is a few bytes.
    fn small(&mut self) -> Result<Vec<u8>, String> {
        let tag = self.tag()?;
        if tag.length > SMALL_MAX {
            return Err(format!(
                "flags, dimensions or a name of {} bytes at byte {}; at most {SMALL_MAX} are possible",
                tag.length, self.at
            ));
        }
        let mut data = Vec::new();
        self.pieces(&tag, |piece| data.extend_from_slice(piece))?;
        Ok(data)
    }

    /// The numbers of an element.
    fn numbers(&mut self, tag: &Tag, mut take: impl FnMut(f64)) -> Result<(), String> {
        let big_endian = self.big_endian;
        self.pieces(tag, |piece| decode(tag.kind, piece, big_endian, &mut take))
    }

    /// The data of an element piece by piece, and what pads it to 8 bytes.
    fn pieces(&mut self, tag: &Tag, mut take: impl FnMut(&[u8])) -> Result<(), String> {
        if let Some(inside) = &tag.inside {
            take(&inside[..tag.length as usize]);
            return Ok(());
        }
        if tag.length > self.room {
            return Err(self.cut_off(tag.length));
        }
        let mut piece = vec![0; PIECE.min(tag.length as usize)];
        let mut left = tag.length as usize;
        while left > 0 {
            let length = left.min(PIECE);
            self.fill(&mut piece[..length])?;
            take(&piece[..length]);
            left -= length;
        }
        self.pad(tag.length)
    }

    /// Reads over the padding; that of the last element may be missing.
    fn pad(&mut self, length: u64) -> Result<(), String> {
        let padding = length.next_multiple_of(8) - length;
        let read = copy(&mut (&mut *self.reader).take(padding), &mut sink());
        self.at += read.map_err(|error| error.to_string())?;
        Ok(())
    }

    /// What `read` finds in the data of an element, and nothing behind it.
    fn within<T>(
        &mut self,
        tag: &Tag,
        read: impl FnOnce(&mut Source<'_>) -> Result<T, String>,
    ) -> Result<T, String> {
        if tag.length > self.room {
            return Err(self.cut_off(tag.length));
        }
        let end = self.at + tag.length;
        let mut data = (&mut *self.reader).take(tag.length);
        let found = read(&mut Source {
            reader: &mut data,
            at: self.at,
            room: tag.length,
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

    /// Passes an element over.
    fn skip(&mut self, tag: &Tag) -> Result<(), String> {
        if tag.inside.is_some() {
            return Ok(());
        }
        self.within(tag, |_| Ok(()))
    }
}

#[cfg(test)]
mod tests;
