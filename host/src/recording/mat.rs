//! MAT-files of level 5, compressed or not: every real numeric vector is a channel, every column of a matrix too.
//!
//! The format is documented by MathWorks ("MAT-File Format", level 5). Text, structures, objects and sparse arrays
//! are passed over; level 7.3 is HDF5 and is refused. A vector of which there is one sample is a parameter, no channel.

use std::io::Read;
use std::path::Path;

use flate2::read::ZlibDecoder;

use super::{Raw, RawColumn, RecordingError};

/// Bytes of the file header.
const HEADER: usize = 128;

/// What a compressed element may grow to: far beyond any recording, and less than memory.
const INFLATED_MAX: u64 = 4 << 30;

const COMPRESSED: u32 = 15;
const MATRIX: u32 = 14;

pub(super) fn read(path: &Path) -> Result<Raw, RecordingError> {
    let bytes = crate::file::read(path)?;
    let content = |what: String| RecordingError::Content {
        path: path.into(),
        what,
    };
    let variables = variables(&bytes).map_err(content)?;
    let longest = variables
        .iter()
        .map(|variable| variable.rows.max(variable.columns))
        .max()
        .unwrap_or(0);
    let columns: Vec<RawColumn> = variables
        .into_iter()
        .filter(|variable| longest > 1 && variable.rows.max(variable.columns) == longest)
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

/// A real numeric matrix, column by column.
struct Variable {
    name: String,
    rows: usize,
    columns: usize,
    values: Vec<f64>,
}

impl Variable {
    fn into_columns(self) -> Vec<RawColumn> {
        let length = self.rows.max(self.columns);
        // A row of samples is one channel, as a column is; a matrix has one channel per column.
        if self.values.len() == length {
            return vec![RawColumn {
                name: self.name,
                unit: None,
                samples: self.values,
            }];
        }
        self.values
            .chunks_exact(self.rows.max(1))
            .enumerate()
            .map(|(index, samples)| RawColumn {
                name: format!("{}{}", self.name, index + 1),
                unit: None,
                samples: samples.to_vec(),
            })
            .collect()
    }
}

/// All real numeric matrices of a file.
fn variables(bytes: &[u8]) -> Result<Vec<Variable>, String> {
    let header = bytes
        .get(..HEADER)
        .ok_or_else(|| format!("{} bytes; a MAT-file has a header of {HEADER}", bytes.len()))?;
    if bytes.starts_with(b"MATLAB 7.3") || header.starts_with(b"\x89HDF") {
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
    let mut cursor = Cursor {
        bytes,
        at: HEADER,
        big_endian,
    };
    let mut variables = Vec::new();
    while cursor.at < bytes.len() {
        let (kind, data) = cursor.element()?;
        match kind {
            COMPRESSED => {
                let mut inflated = Vec::new();
                ZlibDecoder::new(data)
                    .take(INFLATED_MAX)
                    .read_to_end(&mut inflated)
                    .map_err(|error| {
                        format!(
                            "a compressed element before byte {} is damaged: {error}",
                            cursor.at
                        )
                    })?;
                let mut inner = Cursor {
                    bytes: &inflated,
                    at: 0,
                    big_endian,
                };
                let (kind, data) = inner.element()?;
                if kind == MATRIX {
                    variables.extend(matrix(data, big_endian)?);
                }
            }
            MATRIX => variables.extend(matrix(data, big_endian)?),
            _ => {}
        }
    }
    Ok(variables)
}

/// The matrix in the data of a matrix element; `None` where it is none of real numbers.
fn matrix(data: &[u8], big_endian: bool) -> Result<Option<Variable>, String> {
    let mut cursor = Cursor {
        bytes: data,
        at: 0,
        big_endian,
    };
    let (_, flags) = cursor.element()?;
    let Some(flags) = flags.get(..4) else {
        return Ok(None);
    };
    let flags = word(flags, big_endian);
    let (class, complex, logical) = (flags & 0xff, flags & 0x800 != 0, flags & 0x200 != 0);
    // Classes 6 to 15 are double, single and the integers.
    if !(6..=15).contains(&class) || complex || logical {
        return Ok(None);
    }
    let (_, dimensions) = cursor.element()?;
    let dimensions: Vec<usize> = dimensions
        .chunks_exact(4)
        .map(|bytes| word(bytes, big_endian) as usize)
        .collect();
    let &[rows, columns] = dimensions.as_slice() else {
        return Ok(None);
    };
    let (_, name) = cursor.element()?;
    let name = String::from_utf8_lossy(name).into_owned();
    let (kind, data) = cursor.element()?;
    let values = numbers(kind, data, big_endian).ok_or_else(|| {
        format!("variable \"{name}\" has data of type {kind}; a number type from 1 to 13 was expected")
    })?;
    if rows.checked_mul(columns) != Some(values.len()) {
        return Err(format!(
            "variable \"{name}\" is {rows} by {columns}, but has {} values",
            values.len()
        ));
    }
    Ok(Some(Variable {
        name,
        rows,
        columns,
        values,
    }))
}

/// Numbers as they are stored: a matrix of doubles may be stored in a smaller type where that loses nothing.
fn numbers(kind: u32, data: &[u8], big_endian: bool) -> Option<Vec<f64>> {
    macro_rules! decode {
        ($type:ty) => {
            data.chunks_exact(size_of::<$type>())
                .map(|bytes| {
                    let mut array = [0; size_of::<$type>()];
                    array.copy_from_slice(bytes);
                    if big_endian {
                        <$type>::from_be_bytes(array) as f64
                    } else {
                        <$type>::from_le_bytes(array) as f64
                    }
                })
                .collect()
        };
    }
    Some(match kind {
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
        _ => return None,
    })
}

fn word(bytes: &[u8], big_endian: bool) -> u32 {
    let array = [bytes[0], bytes[1], bytes[2], bytes[3]];
    if big_endian {
        u32::from_be_bytes(array)
    } else {
        u32::from_le_bytes(array)
    }
}

struct Cursor<'a> {
    bytes: &'a [u8],
    at: usize,
    big_endian: bool,
}

impl<'a> Cursor<'a> {
    fn take(&mut self, length: usize) -> Result<&'a [u8], String> {
        let end = self.at.checked_add(length);
        let taken = end.and_then(|end| self.bytes.get(self.at..end)).ok_or_else(|| {
            format!(
                "the file ends at byte {}, within an element of {length} bytes at {}: it is cut off",
                self.bytes.len(),
                self.at
            )
        })?;
        self.at += length;
        Ok(taken)
    }

    /// The next element: its type and its data. Elements are padded to 8 bytes, but for compressed ones; up to four
    /// bytes of data may stand within the tag.
    fn element(&mut self) -> Result<(u32, &'a [u8]), String> {
        let first = word(self.take(4)?, self.big_endian);
        let small = (first >> 16) as usize;
        if small > 0 {
            let data = self.take(4)?;
            let kind = first & 0xffff;
            let data = data
                .get(..small)
                .ok_or_else(|| format!("an element at byte {} has {small} bytes in 4", self.at - 8))?;
            return Ok((kind, data));
        }
        let length = word(self.take(4)?, self.big_endian) as usize;
        let data = self.take(length)?;
        if first != COMPRESSED {
            let padding = length.next_multiple_of(8) - length;
            // The padding of the last element may be missing.
            self.at = (self.at + padding).min(self.bytes.len());
        }
        Ok((first, data))
    }
}

#[cfg(test)]
mod tests;
