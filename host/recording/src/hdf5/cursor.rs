//! Reading position in a structure of an HDF5 file. Integers of the format itself are little-endian.

use super::fault::Fault;

/// Reading position in the bytes of a structure.
#[derive(Clone)]
pub(super) struct Cursor<'a> {
    bytes: &'a [u8],
    /// Bytes of the structure before the reading position.
    pub(super) at: usize,
    part: &'static str,
    address_size: usize,
    length_size: usize,
}

impl<'a> Cursor<'a> {
    /// Cursor at the begin of `bytes`; `part` names them in messages.
    pub(super) fn new(bytes: &'a [u8], part: &'static str, address_size: usize, length_size: usize) -> Self {
        Self {
            bytes,
            at: 0,
            part,
            address_size,
            length_size,
        }
    }

    /// The next `length` bytes.
    pub(super) fn take(&mut self, length: usize) -> Result<&'a [u8], Fault> {
        let rest = self.bytes.get(self.at..).unwrap_or_default();
        let taken = rest.get(..length).ok_or(Fault::Short { part: self.part })?;
        self.at += length;
        Ok(taken)
    }

    /// The bytes that are left.
    pub(super) fn rest(&self) -> &'a [u8] {
        self.bytes.get(self.at..).unwrap_or_default()
    }

    /// Skips `length` bytes.
    pub(super) fn skip(&mut self, length: usize) -> Result<(), Fault> {
        self.take(length).map(|_| ())
    }

    /// An unsigned integer of `size` bytes, at most 8.
    pub(super) fn unsigned(&mut self, size: usize) -> Result<u64, Fault> {
        let bytes = self.take(size)?;
        Ok(bytes
            .iter()
            .rev()
            .fold(0, |value, &byte| value << 8 | u64::from(byte)))
    }

    /// An unsigned integer of 1 byte.
    pub(super) fn byte(&mut self) -> Result<u8, Fault> {
        Ok(self.take(1)?[0])
    }

    /// An unsigned integer of 2 bytes.
    pub(super) fn short(&mut self) -> Result<usize, Fault> {
        Ok(self.unsigned(2)? as usize)
    }

    /// A length of the file.
    pub(super) fn length(&mut self) -> Result<u64, Fault> {
        self.unsigned(self.length_size)
    }

    /// An address of the file; `None` if it is undefined, which is a number of ones.
    pub(super) fn address(&mut self) -> Result<Option<u64>, Fault> {
        let address = self.unsigned(self.address_size)?;
        let undefined = u64::MAX >> (64 - 8 * self.address_size.clamp(1, 8));
        Ok((address != undefined).then_some(address))
    }

    /// Skips the padding up to a multiple of `size` bytes of what stands since the position `start`.
    pub(super) fn pad(&mut self, start: usize, size: usize) -> Result<(), Fault> {
        let length = self.at - start;
        self.skip(length.next_multiple_of(size) - length)
    }

    /// Refuses members or attributes that stand in a heap, `what` in words: the information about them, with `further` bytes
    /// before the address if its flag says so, has the address of a heap.
    pub(super) fn refuse_heap(mut self, further: usize, what: &str) -> Result<(), Fault> {
        self.skip(1)?;
        if self.byte()? & 1 != 0 {
            self.skip(further)?;
        }
        match self.address()? {
            Some(_) => Err(Fault::Unsupported { what: what.into() }),
            None => Ok(()),
        }
    }
}
