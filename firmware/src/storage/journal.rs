//! The journal of a slot: which table is on its way, and how far it is.
//!
//! One page of flash:
//!
//! | offset | bytes | |
//! |---|---|---|
//! | 0 | 4 | magic `QCUP` |
//! | 4 | 32 | header of the file |
//! | 36 | 4 | CRC-32 of the 36 bytes before |
//! | 40 | 24 | as erased |
//! | 64 | U each | marks: number k is written when the k-th stretch of the slot is |
//!
//! A stretch is a page, or as many as make the marks fit. A mark is the CRC-32 of record and number in a word of
//! the flash, so that none is right by chance; the highest right one counts, whatever those below it are.

use core::marker::PhantomData;

use embedded_storage::nor_flash::NorFlash;
use heapless::Vec;
use quietcut_core::checksum::crc32;
use quietcut_core::lobes::Header;
use quietcut_core::lobes::format::HEADER_LENGTH;

use super::memory::{ERASED, MAX_WRITE_SIZE};

const MAGIC: [u8; 4] = *b"QCUP";
const RECORD_LENGTH: usize = MAGIC.len() + HEADER_LENGTH + 4;
const MARKS_OFFSET: usize = 64;
const MARK_LENGTH: usize = 4;

/// Where the journal of a slot is.
pub(super) struct Journal<M> {
    start: u32,
    /// Bytes of a stretch.
    stretch: u32,
    marks: u32,
    memory: PhantomData<M>,
}

impl<M: NorFlash> Journal<M> {
    /// Bytes between two marks: whole words.
    const MARK_STEP: usize = if M::WRITE_SIZE < MARK_LENGTH {
        MARK_LENGTH
    } else {
        M::WRITE_SIZE
    };

    /// The fewest bytes of a page: the record and one mark.
    pub(super) const LEAST_PAGE: usize = MARKS_OFFSET + Self::MARK_STEP;

    /// The journal at `start` for a slot that holds `capacity` bytes.
    pub(super) fn new(start: u32, capacity: u32) -> Self {
        let page = M::ERASE_SIZE as u32;
        let room = ((M::ERASE_SIZE - MARKS_OFFSET) / Self::MARK_STEP) as u32;
        let pages_per_mark = (capacity / page).div_ceil(room).max(1);
        let stretch = pages_per_mark * page;
        Self {
            start,
            stretch,
            marks: capacity.div_ceil(stretch),
            memory: PhantomData,
        }
    }

    pub(super) fn start(&self) -> u32 {
        self.start
    }

    /// The record of an upload: whole words.
    pub(super) fn record(header: &Header) -> [u8; MARKS_OFFSET] {
        let mut record = [ERASED; MARKS_OFFSET];
        let header = header.to_bytes();
        let crc = crc32([MAGIC.as_slice(), &header]).to_le_bytes();
        let bytes = MAGIC.into_iter().chain(header).chain(crc);
        for (slot, byte) in record.iter_mut().zip(bytes) {
            *slot = byte;
        }
        record
    }

    /// The next offset of the slot behind `written` where a mark is due.
    pub(super) fn next_mark(&self, written: u32) -> u32 {
        (written / self.stretch + 1) * self.stretch
    }

    /// True where the mark of a stretch is due that ends here.
    pub(super) fn is_at_mark(&self, written: u32) -> bool {
        written > 0 && written.is_multiple_of(self.stretch)
    }

    /// Offset in the memory and bytes of the mark that says that so many bytes are written.
    pub(super) fn mark(&self, header: &Header, written: u32) -> (u32, Vec<u8, MAX_WRITE_SIZE>) {
        let number = written.div_ceil(self.stretch).saturating_sub(1);
        let value = mark_value(header, number);
        let bytes = value.into_iter().cycle().take(Self::MARK_STEP).collect();
        (self.start + self.offset_of(number), bytes)
    }

    /// Header of the file and bytes received, where the journal knows an upload.
    pub(super) fn read(&self, memory: &[u8]) -> Option<(Header, u32)> {
        let page = memory.get(self.start as usize..)?.get(..M::ERASE_SIZE)?;
        let record = page.get(..RECORD_LENGTH)?;
        let (content, crc) = record.split_last_chunk::<4>()?;
        let header = Header::read(content.strip_prefix(&MAGIC)?).ok()?;
        if crc32([content]) != u32::from_le_bytes(*crc) {
            return None;
        }
        let is_set = |&number: &u32| {
            let offset = self.offset_of(number) as usize;
            page.get(offset..offset + MARK_LENGTH) == Some(mark_value(&header, number).as_slice())
        };
        let finished = (0..self.marks)
            .rev()
            .find(is_set)
            .map_or(0, |number| (number + 1) * self.stretch);
        Some((
            header,
            finished.clamp(HEADER_LENGTH as u32, header.length.max(HEADER_LENGTH as u32)),
        ))
    }

    fn offset_of(&self, number: u32) -> u32 {
        MARKS_OFFSET as u32 + number * Self::MARK_STEP as u32
    }
}

fn mark_value(header: &Header, number: u32) -> [u8; MARK_LENGTH] {
    crc32([header.to_bytes().as_slice(), &number.to_le_bytes()]).to_le_bytes()
}
