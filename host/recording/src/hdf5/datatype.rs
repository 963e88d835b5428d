//! Types and dimensions of the values of a dataset or an attribute.

use super::cursor::Cursor;
use super::fault::Fault;
use crate::binary_number::NumberType;

/// Largest number of dimensions of a dataset in HDF5.
const RANK_MAX: usize = 32;

/// Type of one value.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Datatype {
    /// A number.
    Number {
        /// Type of the number.
        number: NumberType,
        /// True if the first byte is the highest.
        is_big_endian: bool,
    },
    /// A text of a fixed length.
    Text,
    /// The address of an object.
    Reference,
    /// A list of values of any length, which stand in a global heap.
    List,
    /// A type that is not read, such as a compound of real and imaginary part.
    Other,
}

/// Type of a value and its size in the file.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Type {
    pub(crate) datatype: Datatype,
    /// Size of one value, bytes; above 0.
    pub(super) size: usize,
}

impl Type {
    /// Reads a type.
    pub(super) fn read(mut cursor: Cursor<'_>) -> Result<Self, Fault> {
        let class = cursor.byte()? & 0xf;
        let bits = cursor.unsigned(3)?;
        let size = cursor.unsigned(4)? as usize;
        if size == 0 {
            return Err(Fault::Value {
                part: "the size of a type",
                value: 0,
            });
        }
        let datatype = match class {
            0 | 1 => {
                // A number with unused bits, or of a size of its own, is not read.
                let (offset, precision) = (cursor.short()?, cursor.short()?);
                let number = match (class, size) {
                    (0, _) => NumberType::integer(size, bits & 8 != 0),
                    (_, 4) => Some(NumberType::F32),
                    (_, 8) => Some(NumberType::F64),
                    _ => None,
                };
                match number {
                    Some(number) if offset == 0 && precision == 8 * size => Datatype::Number {
                        number,
                        is_big_endian: bits & 1 != 0,
                    },
                    _ => Datatype::Other,
                }
            }
            3 => Datatype::Text,
            7 if bits & 0xf == 0 => Datatype::Reference,
            9 => Datatype::List,
            _ => Datatype::Other,
        };
        Ok(Self { datatype, size })
    }
}

/// Reads dimensions, the slowest first: none for one value, a zero for none.
pub(super) fn dimensions(mut cursor: Cursor<'_>) -> Result<Vec<u64>, Fault> {
    let (version, rank, _flags, kind) = (cursor.byte()?, cursor.byte()?, cursor.byte()?, cursor.byte()?);
    match version {
        1 => cursor.skip(4)?,
        // Kind 2 has no values at all.
        2 if kind == 2 => return Ok(vec![0]),
        2 => {}
        _ => {
            return Err(Fault::Value {
                part: "the version of the dimensions",
                value: u64::from(version),
            });
        }
    }
    if usize::from(rank) > RANK_MAX {
        return Err(Fault::Value {
            part: "the number of dimensions",
            value: u64::from(rank),
        });
    }
    (0..rank).map(|_| cursor.length()).collect()
}

/// Number of values of these dimensions; the largest integer if it exceeds every file.
pub(crate) fn count(dimensions: &[u64]) -> u64 {
    if dimensions.contains(&0) {
        return 0;
    }
    dimensions
        .iter()
        .fold(1, |count: u64, &dimension| count.saturating_mul(dimension))
}
