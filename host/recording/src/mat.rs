//! Reader of MAT-files of level 5, compressed or uncompressed: numbers, text, structures and cells.
//!
//! The longer dimension of a matrix is time: the columns of an N × 3 matrix are channels, and the rows of a 3 × N
//! matrix. The columns of a square matrix are channels. [`records`] finds the records in the variables.
//!
//! Format: MathWorks, "MAT-File Format", level 5. Objects, complex, logical and sparse arrays, and arrays of more than
//! two dimensions are skipped. Level 7.3 (HDF5) is an error.
//!
//! The file is read in chunks and its values are stored only once. The length of the file bounds the allocated memory,
//! whatever sizes its headers state; 64 MiB of values are allowed for any file.

mod records;
mod source;
mod value;

use std::fs::File;
use std::io::{BufRead, BufReader, Read, copy, sink};
use std::path::Path;

use flate2::bufread::ZlibDecoder;

use super::RecordingError;
use super::raw::Raw;
use crate::file::FileError;
use source::{CHUNK, SMALL_MAX, Source, size_of_kind, word};
use value::{Item, Value, Variable};

/// Length of the file header of a MAT-file of level 5, bytes.
const HEADER: usize = 128;

/// Largest compression factor that the deflate format allows (1032:1). A compressed element that states more is
/// damaged.
const INFLATION_MAX: u64 = 1032;

/// Memory that the values of any MAT-file may take, bytes, however short the file is: one million samples of eight
/// channels of 8 bytes. Constant channels of this size compress to almost nothing. The size is a choice.
const VALUES_MIN: u64 = 64 << 20;

/// Memory that the values of a MAT-file may take per byte of the file, bytes. One-byte integers that become 8-byte
/// numbers need a factor of 8, and measured channels compress by a factor below 20: together 160.
const VALUES_PER_BYTE: u64 = 200;

/// Largest number of values of a variable for which memory is reserved before they are read; in a MAT-file with more
/// bytes than this number, its length in bytes takes its place. A choice; it bounds the cost of a header with a false
/// size.
const TRUSTED: u64 = 1 << 16;

/// Code of the data type of a compressed element in a MAT-file (miCOMPRESSED).
const COMPRESSED: u32 = 15;

/// Code of the data type of a matrix element in a MAT-file (miMATRIX).
const MATRIX: u32 = 14;

/// Largest number of levels of nested structures and cells of a MAT-file that are read. A choice; recordings have one
/// or two levels.
const DEPTH_MAX: usize = 6;

/// Largest total number of field values of all structures and elements of all cells of a MAT-file. A choice; a record
/// in a structure array has a few fields.
const ELEMENTS_MAX: usize = 100_000;

/// Reads the records of a MAT-file; [`records`] states what is a record.
pub(super) fn read(path: &Path) -> Result<Vec<Raw>, RecordingError> {
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
    let items = items(&mut BufReader::with_capacity(CHUNK, file), length).map_err(content)?;
    records::records(items).map_err(content)
}

/// Reads the variables of a MAT-file of `length` bytes, except those that [`matrix`] skips.
fn items(reader: &mut dyn BufRead, length: u64) -> Result<Vec<Item>, String> {
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
        available: length,
        big_endian,
    };
    let mut memory = ValueMemory {
        file: length,
        bytes: length.saturating_mul(VALUES_PER_BYTE).max(VALUES_MIN),
        elements: ELEMENTS_MAX,
    };
    let mut items = Vec::new();
    while !source.is_at_end()? {
        let tag = source.tag()?;
        match tag.kind {
            COMPRESSED => items.extend(inflated(&mut source, tag.length, &mut memory)?),
            MATRIX => items.extend(source.within(&tag, |inner| matrix(inner, &mut memory, 0))?),
            _ => source.skip(&tag)?,
        }
    }
    Ok(items)
}

/// Memory that the values of one MAT-file may still take: a bound against false sizes in its headers.
struct ValueMemory {
    /// Length of the file, bytes.
    file: u64,
    /// Memory that values of the MAT-file may still take, bytes.
    bytes: u64,
    /// Number of field values of structures and elements of cells of the MAT-file that may still be read.
    elements: usize,
}

impl ValueMemory {
    /// Deducts the memory of `count` values of variable `name` from what the values of the MAT-file may still take; an
    /// error if that does not suffice.
    fn take(&mut self, name: &str, count: u64) -> Result<(), String> {
        let needed = count.saturating_mul(size_of::<f64>() as u64);
        self.bytes = self.bytes.checked_sub(needed).ok_or_else(|| {
            format!(
                "variable \"{name}\" has {count} values, more than a file of {} bytes can hold: {} bytes per byte of the file are \
                 allowed. The file is damaged, or save it without compression (-v6)",
                self.file, VALUES_PER_BYTE
            )
        })?;
        Ok(())
    }

    /// Counts `count` more field values of structure `name`, or elements of cell `name`; an error if the MAT-file has
    /// more than [`ELEMENTS_MAX`].
    fn take_elements(&mut self, name: &str, count: usize) -> Result<(), String> {
        self.elements = self.elements.checked_sub(count).ok_or_else(|| {
            format!("structure \"{name}\" has more than {ELEMENTS_MAX} elements; save the records as vectors")
        })?;
        Ok(())
    }

    /// Largest number of samples per channel for which memory is reserved before the samples of a variable with
    /// `channels` channels are read.
    fn trusted(&self, channels: usize) -> usize {
        usize::try_from(self.file.max(TRUSTED) / channels.max(1) as u64 + 1).unwrap_or(usize::MAX)
    }
}

/// Decompresses an element of `length` bytes and reads the matrix in it; `None` if it holds no matrix that is
/// read.
fn inflated(source: &mut Source<'_>, length: u64, memory: &mut ValueMemory) -> Result<Option<Item>, String> {
    if length > source.available {
        return Err(source.cut_off(length));
    }
    let before = source.at + length;
    let inflated_max = length.saturating_mul(INFLATION_MAX);
    let mut packed = (&mut *source.reader).take(length);
    let mut inflated = BufReader::with_capacity(CHUNK, ZlibDecoder::new(&mut packed).take(inflated_max));
    let mut inner = Source {
        reader: &mut inflated,
        at: 0,
        available: inflated_max,
        big_endian: source.big_endian,
    };
    let found = inner.tag().and_then(|tag| match tag.kind {
        MATRIX => inner.within(&tag, |inner| matrix(inner, memory, 0)),
        _ => Ok(None),
    });
    let found =
        found.map_err(|what| format!("a compressed element before byte {before} is damaged: {what}"))?;
    drop(inflated);
    copy(&mut packed, &mut sink()).map_err(|error| error.to_string())?;
    source.at = before;
    Ok(found)
}

/// Reads the data of a matrix element `depth` levels inside others; `None` unless it has two dimensions and holds a
/// real numeric matrix that is not logical, a text of at most [`SMALL_MAX`] bytes, or a structure or cell less than
/// [`DEPTH_MAX`] levels inside others.
fn matrix(source: &mut Source<'_>, memory: &mut ValueMemory, depth: usize) -> Result<Option<Item>, String> {
    // An empty field of a MAT structure is stored as an element without any content.
    if source.available == 0 {
        return Ok(None);
    }
    let flags = source.small()?;
    let Some(flags) = flags.get(..4) else {
        return Ok(None);
    };
    let flags = word(flags, source.big_endian);
    let (class, complex, logical) = (flags & 0xff, flags & 0x800 != 0, flags & 0x200 != 0);
    // Codes of array classes in a MAT-file: 1 cell, 2 structure, 4 text, 6 to 15 double, single and the integer types.
    if !matches!(class, 1 | 2 | 4 | 6..=15) || complex || logical {
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
    let item = |value| {
        Ok(Some(Item {
            name: name.clone(),
            value,
        }))
    };
    match class {
        1 | 2 => {
            if depth >= DEPTH_MAX {
                return Ok(None);
            }
            let count = rows.saturating_mul(columns);
            let elements = elements(source, memory, &name, count, class == 2, depth)?;
            return item(Value::Elements(elements));
        }
        4 => {
            let tag = source.tag()?;
            return if tag.length > SMALL_MAX {
                Ok(None)
            } else {
                item(Value::Text(source.text(&tag)?))
            };
        }
        _ => {}
    }
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
    if tag.length > source.available {
        return Err(source.cut_off(tag.length));
    }
    memory.take(&name, count as u64)?;
    let (samples, channels) = (rows.max(columns), rows.min(columns));
    let trusted = samples.min(memory.trusted(channels));
    let mut values: Vec<Vec<f64>> = Vec::new();
    // A MAT-file stores a matrix in column-major order.
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
    Ok(Some(Item {
        name: name.clone(),
        value: Value::Numbers(Variable { name, values }),
    }))
}

/// Reads the elements of a MAT structure array or cell array of `count` elements. Index: element, then its fields,
/// without those that are not read.
fn elements(
    source: &mut Source<'_>,
    memory: &mut ValueMemory,
    name: &str,
    count: usize,
    is_structure: bool,
    depth: usize,
) -> Result<Vec<Vec<Item>>, String> {
    let fields = if is_structure {
        let length = source.small()?;
        let length = length
            .get(..4)
            .map_or(0, |bytes| word(bytes, source.big_endian) as usize);
        let names = source.small()?;
        if length == 0 || length > names.len().max(1) {
            return Ok(Vec::new());
        }
        names
            .chunks_exact(length)
            .map(|name| {
                let end = name.iter().position(|&byte| byte == 0).unwrap_or(length);
                String::from_utf8_lossy(&name[..end]).into_owned()
            })
            .collect()
    } else {
        vec![String::new()]
    };
    memory.take_elements(name, count.saturating_mul(fields.len().max(1)))?;
    let mut elements = Vec::new();
    for _ in 0..count {
        let mut items = Vec::new();
        for field in &fields {
            let tag = source.tag()?;
            if tag.kind != MATRIX {
                source.skip(&tag)?;
                continue;
            }
            let found = source.within(&tag, |inner| matrix(inner, memory, depth + 1))?;
            items.extend(found.map(|found| found.named(field)));
        }
        elements.push(items);
    }
    Ok(elements)
}

#[cfg(test)]
mod tests;
