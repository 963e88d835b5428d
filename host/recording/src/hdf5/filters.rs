//! Filters of chunks: compression, order of bytes, checksum.

use std::io::Read;

use flate2::bufread::ZlibDecoder;

use super::fault::Fault;
use super::storage::Storage;
use crate::criteria::INFLATION_MAX;

/// Largest number of filters of a dataset in HDF5.
const FILTERS_MAX: usize = 32;

/// A filter through which chunks went when they were written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Filter {
    /// Compression by deflate, in the form of zlib.
    Deflate,
    /// First bytes of all values, then second bytes of all values, and so on.
    Shuffle,
    /// Checksum of 4 bytes at the end.
    Fletcher32,
}

/// Filters of a dataset in the order in which they were applied when it was written.
#[derive(Debug, Default)]
pub(super) struct Filters(Vec<Filter>);

impl Filters {
    /// Reads the message with the filters of a dataset; an error for a filter that is not read.
    pub(super) fn read(storage: &Storage<'_>, message: &[u8]) -> Result<Self, Fault> {
        let mut cursor = storage.cursor(message, "the filters of a dataset");
        let (version, count) = (cursor.byte()?, usize::from(cursor.byte()?));
        if !matches!(version, 1 | 2) || count > FILTERS_MAX {
            return Err(Fault::Value {
                part: "the version or number of filters",
                value: u64::from(version),
            });
        }
        if version == 1 {
            cursor.skip(6)?;
        }
        let mut filters = Vec::new();
        for _ in 0..count {
            let code = cursor.short()?;
            let name = match version == 1 || code >= 256 {
                true => cursor.short()?,
                false => 0,
            };
            cursor.skip(2)?;
            let values = cursor.short()?;
            let start = cursor.at;
            cursor.skip(name)?;
            if version == 1 {
                cursor.pad(start, 8)?;
            }
            cursor.skip(4 * values)?;
            if version == 1 && values % 2 == 1 {
                cursor.skip(4)?;
            }
            filters.push(match code {
                1 => Filter::Deflate,
                2 => Filter::Shuffle,
                3 => Filter::Fletcher32,
                _ => {
                    return Err(Fault::Unsupported {
                        what: format!("the compression filter {code} of HDF5"),
                    });
                }
            });
        }
        Ok(Self(filters))
    }

    /// True if `stored` bytes can be a chunk of `length` bytes: without filters as many, after deflate at least a share
    /// of them, and a few more at most, of a checksum and of what cannot be compressed.
    pub(super) fn is_possible(&self, stored: u64, length: u64) -> bool {
        if self.0.is_empty() {
            return stored == length;
        }
        let stored_max = length.saturating_add(length / 100).saturating_add(64);
        let length_max = match self.0.contains(&Filter::Deflate) {
            true => stored.saturating_mul(INFLATION_MAX),
            false => stored,
        };
        stored <= stored_max && length <= length_max
    }

    /// Undoes the filters on the stored bytes of a chunk, except those in `omitted`: bit 0 is the first filter. The
    /// result has `length` bytes of values of `size` bytes. The error is the fault of the chunk.
    pub(super) fn undo(
        &self,
        mut bytes: Vec<u8>,
        omitted: u64,
        length: usize,
        size: usize,
    ) -> Result<Vec<u8>, String> {
        for (index, filter) in self.0.iter().enumerate().rev() {
            if omitted >> index & 1 == 1 {
                continue;
            }
            bytes = match filter {
                Filter::Deflate => inflated(&bytes, length)?,
                Filter::Shuffle => unshuffled(&bytes, size),
                Filter::Fletcher32 => checked(bytes)?,
            };
        }
        match bytes.len() == length {
            true => Ok(bytes),
            false => Err(format!("{} bytes instead of {length}", bytes.len())),
        }
    }
}

/// Decompresses a chunk; an error if it has more than `length` bytes and the 4 bytes of a checksum.
fn inflated(bytes: &[u8], length: usize) -> Result<Vec<u8>, String> {
    let max = length as u64 + 4;
    let mut inflated = Vec::new();
    let read = ZlibDecoder::new(bytes).take(max + 1).read_to_end(&mut inflated);
    read.map_err(|error| error.to_string())?;
    match inflated.len() as u64 > max {
        true => Err(format!("more than {length} bytes")),
        false => Ok(inflated),
    }
}

/// Undoes the shuffle of values of `size` bytes; bytes after the last whole value stay.
fn unshuffled(bytes: &[u8], size: usize) -> Vec<u8> {
    let count = bytes.len() / size.max(1);
    let mut values = bytes.to_vec();
    for (index, value) in values.chunks_exact_mut(size.max(1)).enumerate() {
        for (place, byte) in value.iter_mut().enumerate() {
            *byte = bytes[place * count + index];
        }
    }
    values
}

/// Removes the checksum at the end of a chunk; an error if it is another one than that of the chunk.
fn checked(mut bytes: Vec<u8>) -> Result<Vec<u8>, String> {
    let Some(at) = bytes.len().checked_sub(4) else {
        return Err("it lacks its checksum".into());
    };
    let end = bytes.split_off(at);
    let stated = end.iter().rev().fold(0, |sum, &byte| sum << 8 | u32::from(byte));
    match fletcher_32(&bytes) == stated {
        true => Ok(bytes),
        false => Err("its checksum is wrong".into()),
    }
}

/// Fletcher's checksum of 32 bits over words of 16 bits, the high byte first, as HDF5 computes it.
fn fletcher_32(bytes: &[u8]) -> u32 {
    /// Number of words whose sums cannot exceed 32 bits.
    const WORDS: usize = 360;
    let fold = |sum: u32| (sum & 0xffff) + (sum >> 16);
    let (mut first, mut second) = (0, 0);
    for words in bytes.chunks(2 * WORDS) {
        for word in words.chunks(2) {
            first += u32::from(word[0]) << 8 | word.get(1).map_or(0, |&byte| u32::from(byte));
            second += first;
        }
        (first, second) = (fold(first), fold(second));
    }
    fold(second) << 16 | fold(first)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_checksum_of_fletcher_is_that_of_the_words() {
        // Words 0x6162, 0x6364, 0x6500: sums modulo 65535.
        let words = [0x6162_u64, 0x6364, 0x6500];
        let first: u64 = words.iter().sum::<u64>() % 65535;
        let second = (3 * words[0] + 2 * words[1] + words[2]) % 65535;
        assert_eq!(u64::from(fletcher_32(b"abcde")), second << 16 | first);
        // The sums of a long block do not overflow.
        assert_eq!(fletcher_32(&[0xff; 100_000]), 0xffff_ffff);
    }

    #[test]
    fn a_shuffled_chunk_gets_its_order_back() {
        assert_eq!(unshuffled(&[1, 3, 5, 2, 4, 6, 9], 2), [1, 2, 3, 4, 5, 6, 9]);
    }
}
