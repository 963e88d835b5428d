//! Reader of MAT-files of level 5, compressed or uncompressed: numbers, text, structures and cells.
//!
//! Format: MathWorks, "MAT-File Format", level 5. Objects, complex, logical and sparse arrays, and arrays of more than
//! two dimensions are skipped.
//!
//! The file is read in chunks and its values are stored only once.

use std::io::{BufRead, BufReader, Read, copy, sink};

use flate2::bufread::ZlibDecoder;

use super::memory::{DEPTH_MAX, ValueMemory};
use super::source::{CHUNK, SMALL_MAX, Source, number_type, word};
use super::value::{Channels, Item, Value, Variable};
use crate::criteria::INFLATION_MAX;

/// Length of the file header of a MAT-file of level 5, bytes.
const HEADER: usize = 128;

/// Code of the data type of a compressed element in a MAT-file (miCOMPRESSED).
pub(super) const COMPRESSED: u32 = 15;

/// Code of the data type of a matrix element in a MAT-file (miMATRIX).
pub(super) const MATRIX: u32 = 14;

/// Reads the variables of a MAT-file of level 5 of `length` bytes, except those that [`matrix`] skips.
pub(super) fn items(
    reader: &mut dyn BufRead,
    length: u64,
    memory: &mut ValueMemory,
) -> Result<Vec<Item>, String> {
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
    if header.starts_with(b"MATLAB 7.3") {
        return Err("it is of level 7.3, but holds no HDF5 file: it is cut off or damaged".into());
    }
    let big_endian = match &header[126..128] {
        b"IM" => false,
        b"MI" => true,
        other => {
            return Err(format!(
                "bytes 126 and 127 are {other:?}; a MAT-file of level 5 has IM or MI there; if MATLAB wrote this one with -v4, save it with -v7"
            ));
        }
    };
    let mut source = Source {
        reader,
        at: HEADER as u64,
        available: length,
        big_endian,
    };
    let mut items = Vec::new();
    while !source.is_at_end()? {
        let tag = source.tag()?;
        match tag.kind {
            COMPRESSED => items.extend(inflated(&mut source, tag.length, memory)?),
            MATRIX => items.extend(source.within(&tag, |inner| matrix(inner, memory, 0))?),
            _ => source.skip(&tag)?,
        }
    }
    Ok(items)
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
    if !matches!(class, 1 | 2 | 4 | 6..=15) || logical {
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
    let number = number_type(tag.kind).ok_or_else(|| {
        format!(
            "variable \"{name}\" has data of type {}; a number type from 1 to 13 was expected",
            tag.kind
        )
    })?;
    let count = (tag.length / number.size() as u64) as usize;
    if rows.checked_mul(columns) != Some(count) {
        return Err(format!(
            "variable \"{name}\" is {rows} by {columns}, but has {count} values"
        ));
    }
    if tag.length > source.available {
        return Err(source.cut_off(tag.length));
    }
    memory.take(&name, count as u64)?;
    let mut channels = Channels::new(rows, columns, memory.trusted(rows.min(columns)));
    source.numbers(&tag, number, |value| channels.push(value))?;
    let mut variable = channels.named(name.clone());
    if complex {
        variable = imaginary(source, memory, variable, [rows, columns])?;
    }
    Ok(Some(Item {
        name,
        value: Value::Numbers(variable),
    }))
}

/// Reads the imaginary parts of a matrix behind its real parts.
fn imaginary(
    source: &mut Source<'_>,
    memory: &mut ValueMemory,
    real: Variable,
    [rows, columns]: [usize; 2],
) -> Result<Variable, String> {
    let tag = source.tag()?;
    let number = number_type(tag.kind).ok_or_else(|| {
        format!(
            "variable \"{}\" has imaginary parts of type {}",
            real.name, tag.kind
        )
    })?;
    let count = tag.length / number.size() as u64;
    if rows.checked_mul(columns) != Some(count as usize) || tag.length > source.available {
        return Err(format!(
            "variable \"{}\" is {rows} by {columns}, but has {count} imaginary parts",
            real.name
        ));
    }
    memory.take(&real.name, count)?;
    let mut channels = Channels::new(rows, columns, memory.trusted(rows.min(columns)));
    source.numbers(&tag, number, |value| channels.push(value))?;
    Ok(real.with_imaginary(channels.named(String::new())))
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
