//! Reader of MAT-files of level 5, compressed or uncompressed: numbers, text, structures and cells.
//!
//! The longer dimension of a matrix is time: the columns of an N × 3 matrix are channels, and the rows of a 3 × N matrix. The columns of a
//! square matrix are channels. [`records`] finds the records in the variables.
//!
//! Format: MathWorks, "MAT-File Format", level 5. Objects, complex, logical and sparse arrays are skipped. Level 7.3 (HDF5) is an error.
//!
//! The file is read in chunks and its values are stored only once. The length of the file bounds the allocated memory, whatever sizes its
//! headers state.

mod records;

use std::fs::File;
use std::io::{BufRead, BufReader, ErrorKind, Read, copy, sink};
use std::path::Path;

use flate2::bufread::ZlibDecoder;

use super::RecordingError;
use super::raw::{Raw, RawColumn};
use crate::file::FileError;

/// Length of the file header, bytes (MAT-File Format, level 5).
const HEADER: usize = 128;

/// Chunk size of reading, bytes; a choice. It is a multiple of the size of every number type.
const CHUNK: usize = 1 << 16;

/// Largest compression factor of the deflate format (1032:1). An element with a larger factor is damaged.
const INFLATION_MAX: u64 = 1032;

/// Memory for values that every file may use, bytes, however short it is: one million samples of eight channels of 8 bytes. Constant
/// channels of this size compress to almost nothing. The size is a choice.
const VALUES_MIN: u64 = 64 << 20;

/// Memory for values per byte of the file, bytes. One-byte integers that become 8-byte numbers need a factor of 8, and measured channels
/// compress by a factor below 20: together 160.
const VALUES_PER_BYTE: u64 = 200;

/// Number of values for which memory is reserved before reading, even if the file is shorter. A choice; it bounds what a false header costs.
const TRUSTED: u64 = 1 << 16;

/// Largest element with flags, dimensions or a name, bytes. Valid names have up to 63 characters; the limit is a choice above that.
const SMALL_MAX: u64 = 4096;

/// Data type of a compressed element (miCOMPRESSED).
const COMPRESSED: u32 = 15;

/// Data type of a matrix element (miMATRIX).
const MATRIX: u32 = 14;

/// Largest depth of structures in structures that is read. A choice; recordings have one or two levels.
const DEPTH_MAX: usize = 6;

/// Largest number of elements of all structures and cells of a file. A choice; a record of a structure array takes a few.
const ELEMENTS_MAX: usize = 100_000;

/// Reads the records of a MAT-file: its vectors and matrices, or those of its structures.
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

/// A named value of the file, or of a structure.
#[derive(Debug)]
struct Item {
    name: String,
    value: Value,
}

/// A value of the file.
#[derive(Debug)]
enum Value {
    Numbers(Variable),
    Text(String),
    /// Elements of a structure array, each with its fields; the elements of a cell array have one field without name.
    Elements(Vec<Vec<Item>>),
}

/// A real numeric variable, split into channels; a row vector and a column vector are one channel.
#[derive(Debug)]
struct Variable {
    name: String,
    /// Samples of each channel; all channels have the same length.
    values: Vec<Vec<f64>>,
}

impl Variable {
    /// Number of samples per channel: the longer dimension of the matrix.
    fn samples(&self) -> usize {
        self.values.first().map_or(0, Vec::len)
    }

    /// Channels with their names: the name of the variable, numbered from 1 if there are several.
    fn into_columns(self) -> Vec<RawColumn> {
        let is_one = self.values.len() == 1;
        let name = |index: usize| match is_one {
            true => self.name.clone(),
            false => format!("{}{}", self.name, index + 1),
        };
        self.values
            .into_iter()
            .enumerate()
            .map(|(index, samples)| RawColumn::without_unit(name(index), samples))
            .collect()
    }
}

/// Reads all variables of a file of `length` bytes.
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

/// Remaining memory for the values of one file.
struct ValueMemory {
    /// Length of the file, bytes.
    file: u64,
    /// Memory still available for values, bytes.
    bytes: u64,
    /// Elements of structures and cells that may still be read.
    elements: usize,
}

impl ValueMemory {
    /// Reserves the memory of `count` values of variable `name`; an error if it exceeds the budget.
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

    /// Counts `count` elements of structure or cell `name`; an error if the file has too many.
    fn take_elements(&mut self, name: &str, count: usize) -> Result<(), String> {
        self.elements = self.elements.checked_sub(count).ok_or_else(|| {
            format!("structure \"{name}\" has more than {ELEMENTS_MAX} elements; save the records as vectors")
        })?;
        Ok(())
    }

    /// Number of values per channel for which memory is reserved before reading a variable with `channels` channels.
    fn trusted(&self, channels: usize) -> usize {
        usize::try_from(self.file.max(TRUSTED) / channels.max(1) as u64 + 1).unwrap_or(usize::MAX)
    }
}

/// Decompresses an element of `length` bytes and reads the matrix in it; `None` if it holds no value that is read.
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

/// Reads the data of a matrix element `depth` levels inside others; `None` if it holds no real numbers in two dimensions, text, structure
/// or cell.
fn matrix(source: &mut Source<'_>, memory: &mut ValueMemory, depth: usize) -> Result<Option<Item>, String> {
    // An empty field of a structure has no content at all.
    if source.available == 0 {
        return Ok(None);
    }
    let flags = source.small()?;
    let Some(flags) = flags.get(..4) else {
        return Ok(None);
    };
    let flags = word(flags, source.big_endian);
    let (class, complex, logical) = (flags & 0xff, flags & 0x800 != 0, flags & 0x200 != 0);
    // Array classes: 1 cell, 2 structure, 4 text, 6 to 15 double, single and the integer types.
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
    // Values are stored in column-major order.
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

/// Reads the elements of a structure array or a cell array of `count` elements.
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

impl Item {
    /// The value with the name of its field; the elements of structures have no names of their own.
    fn named(mut self, name: &str) -> Self {
        self.name = name.into();
        if let Value::Numbers(variable) = &mut self.value {
            variable.name = name.into();
        }
        self
    }
}

/// Size of a stored number type, bytes; `None` if the data type is not numeric.
fn size_of_kind(kind: u32) -> Option<usize> {
    Some(match kind {
        1 | 2 => 1,
        3 | 4 => 2,
        5..=7 => 4,
        9 | 12 | 13 => 8,
        _ => return None,
    })
}

/// Decodes numbers of data type `kind` and passes each to `take`. A matrix of doubles may be stored in a smaller integer type without loss.
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
        // Text in UTF-8 (16) has single bytes.
        2 | 16 => decode!(u8),
        3 => decode!(i16),
        4 | 17 => decode!(u16),
        5 => decode!(i32),
        6 => decode!(u32),
        7 => decode!(f32),
        9 => decode!(f64),
        12 => decode!(i64),
        13 => decode!(u64),
        _ => {}
    }
}

/// Decodes a 32-bit unsigned integer from the first four bytes.
fn word(bytes: &[u8], big_endian: bool) -> u32 {
    let array = [bytes[0], bytes[1], bytes[2], bytes[3]];
    if big_endian {
        u32::from_be_bytes(array)
    } else {
        u32::from_le_bytes(array)
    }
}

/// Tag of a data element: data type and length.
struct Tag {
    /// Data type of the element (miINT8 = 1 … miCOMPRESSED = 15).
    kind: u32,
    /// Length of the data, bytes.
    length: u64,
    /// Data of a small element, which are stored inside the tag (up to four bytes).
    inside: Option<[u8; 4]>,
}

/// Sequential reader of the elements of a file or of a compressed element.
struct Source<'a> {
    reader: &'a mut dyn BufRead,
    /// Offset of the next byte.
    at: u64,
    /// Upper bound of the bytes available: the length of the file or of the enclosing element.
    available: u64,
    big_endian: bool,
}

impl Source<'_> {
    /// True if no byte is left.
    fn is_at_end(&mut self) -> Result<bool, String> {
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

    /// Message for a file that ends within an element of `length` bytes.
    fn cut_off(&self, length: u64) -> String {
        format!(
            "it ends within an element of {length} bytes at byte {}: it is cut off",
            self.at
        )
    }

    /// Reads the next tag.
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

    /// Reads the next element, which holds flags, dimensions or a name: at most [`SMALL_MAX`] bytes.
    fn small(&mut self) -> Result<Vec<u8>, String> {
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

    /// Reads the text of an element: UTF-8, UTF-16 or bytes.
    fn text(&mut self, tag: &Tag) -> Result<String, String> {
        let mut codes = Vec::new();
        self.numbers(tag, |code| codes.push(code as u32))?;
        // Data types 16 (UTF-8), 1 and 2 hold bytes of UTF-8; the others hold one code for each letter.
        if matches!(tag.kind, 1 | 2 | 16) {
            let bytes: Vec<u8> = codes.iter().map(|&code| code as u8).collect();
            return Ok(String::from_utf8_lossy(&bytes).into_owned());
        }
        Ok(codes.into_iter().filter_map(char::from_u32).collect())
    }

    /// Reads the numbers of an element and passes each to `take`.
    fn numbers(&mut self, tag: &Tag, mut take: impl FnMut(f64)) -> Result<(), String> {
        let big_endian = self.big_endian;
        self.chunks(tag, |chunk| decode(tag.kind, chunk, big_endian, &mut take))
    }

    /// Reads the data of an element in chunks, and its padding to a multiple of 8 bytes.
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

    /// Skips the padding after `length` bytes; the padding of the last element may be missing.
    fn pad(&mut self, length: u64) -> Result<(), String> {
        let padding = length.next_multiple_of(8) - length;
        let read = copy(&mut (&mut *self.reader).take(padding), &mut sink());
        self.at += read.map_err(|error| error.to_string())?;
        Ok(())
    }

    /// Applies `read` to the data of an element, limited to that element, and skips data that `read` leaves.
    fn within<T>(
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
    fn skip(&mut self, tag: &Tag) -> Result<(), String> {
        if tag.inside.is_some() {
            return Ok(());
        }
        self.within(tag, |_| Ok(()))
    }
}

#[cfg(test)]
mod tests;
