//! Bounded access to the bytes of an HDF5 file.

use std::io::{ErrorKind, Read, Seek, SeekFrom};

use super::cursor::Cursor;
use super::fault::Fault;

/// Bytes of headers that are read of any HDF5 file, however short it is. A choice: headers of a recording take kilobytes.
const HEADERS_MIN: u64 = 16 << 20;

/// Bytes of headers that are read per byte of an HDF5 file. Each header of a valid file is read a few times at most: a
/// heap of 4096 bytes with the names of fields once for each structure, of which one takes about 1000 bytes. Beyond this
/// factor the headers refer to one another in circles. A choice.
const HEADERS_PER_BYTE: u64 = 8;

/// A file, or its bytes in memory.
pub(crate) trait Bytes: Read + Seek {}

impl<T: Read + Seek> Bytes for T {}

/// Reader of blocks at addresses of an HDF5 file.
pub(super) struct Storage<'a> {
    reader: &'a mut dyn Bytes,
    /// Length of the file, bytes.
    pub(super) length: u64,
    /// Offset in the file from which its addresses count.
    base: u64,
    /// Size of an address in the file, bytes.
    pub(super) address_size: usize,
    /// Size of a length in the file, bytes.
    pub(super) length_size: usize,
    headers_left: u64,
}

impl<'a> Storage<'a> {
    /// Storage of a file of `length` bytes whose addresses count from `base`.
    pub(super) fn new(reader: &'a mut dyn Bytes, length: u64, base: u64) -> Self {
        Self {
            reader,
            length,
            base,
            address_size: 8,
            length_size: 8,
            headers_left: headers_max(length),
        }
    }

    /// Offset in the file of the block of `length` bytes at an address; an error if it lies beyond the end of the file.
    pub(super) fn offset(&self, address: u64, length: u64) -> Result<u64, Fault> {
        let at = self.base.saturating_add(address);
        match at.checked_add(length) {
            Some(end) if end <= self.length => Ok(at),
            _ => Err(Fault::CutOff { at, length }),
        }
    }

    /// Fills `bytes` with the bytes of the file from offset `at`.
    fn fill(&mut self, at: u64, bytes: &mut [u8]) -> Result<(), Fault> {
        let read = self.reader.seek(SeekFrom::Start(at));
        read.and_then(|_| self.reader.read_exact(bytes))
            .map_err(|cause| match cause.kind() {
                ErrorKind::UnexpectedEof => Fault::CutOff {
                    at,
                    length: bytes.len() as u64,
                },
                _ => Fault::Read { at, cause },
            })
    }

    /// The block of samples of `length` bytes at an address.
    pub(super) fn data(&mut self, address: u64, length: u64) -> Result<Vec<u8>, Fault> {
        let at = self.offset(address, length)?;
        let mut bytes = vec![0; length as usize];
        self.fill(at, &mut bytes)?;
        Ok(bytes)
    }

    /// The block of a header of `length` bytes at an address; an error if headers of the file refer to one another in
    /// circles.
    pub(super) fn header(&mut self, address: u64, length: u64) -> Result<Vec<u8>, Fault> {
        self.offset(address, length)?;
        self.headers_left = self
            .headers_left
            .checked_sub(length)
            .ok_or_else(|| Fault::Circles {
                limit: headers_max(self.length),
                length: self.length,
            })?;
        self.data(address, length)
    }

    /// The block of a header at an address: `length` bytes, or fewer up to the end of the file.
    pub(super) fn header_up_to(&mut self, address: u64, length: u64) -> Result<Vec<u8>, Fault> {
        let left = self.length.saturating_sub(self.at(address));
        self.header(address, length.min(left))
    }

    /// The block of a header of `length` bytes at an address, which begins with `mark`.
    pub(super) fn marked(&mut self, address: u64, length: u64, mark: &'static str) -> Result<Vec<u8>, Fault> {
        let bytes = self.header(address, length)?;
        if !bytes.starts_with(mark.as_bytes()) {
            return Err(Fault::Mark {
                expected: mark,
                at: self.base.saturating_add(address),
            });
        }
        Ok(bytes)
    }

    /// True if a block with `mark` stands at an address.
    pub(super) fn is_marked(&mut self, address: u64, mark: &str) -> Result<bool, Fault> {
        Ok(self.header(address, mark.len() as u64)? == mark.as_bytes())
    }

    /// Cursor over `bytes` of this file; `part` names them in messages.
    pub(super) fn cursor<'b>(&self, bytes: &'b [u8], part: &'static str) -> Cursor<'b> {
        Cursor::new(bytes, part, self.address_size, self.length_size)
    }

    /// Offset in the file of an address.
    pub(super) fn at(&self, address: u64) -> u64 {
        self.base.saturating_add(address)
    }
}

/// Bytes of headers that are read of a file of `length` bytes.
fn headers_max(length: u64) -> u64 {
    length.saturating_mul(HEADERS_PER_BYTE).max(HEADERS_MIN)
}
