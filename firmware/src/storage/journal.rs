//! The journal of a slot: the header of the table being uploaded, and the progress of the upload.
//!
//! One page of flash:
//!
//! | offset | bytes | |
//! |---|---|---|
//! | 0 | 4 | magic `QCUP` |
//! | 4 | 32 | header of the file |
//! | 36 | 4 | CRC-32 of the 36 bytes before |
//! | 40 | 24 | erased |
//! | 64 | U each | marks: mark k is written after section k of the slot |
//!
//! A section is one page, or several pages if the marks of single pages would not fit. A mark of U bytes, one or more
//! flash words, holds the CRC-32 of the file's header and the number k, so that random bytes are hardly ever a valid
//! mark. The highest valid mark counts, even if lower marks are damaged.

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

/// Position and layout in flash of the journal of a table slot.
pub(super) struct Journal<M> {
    start: u32,
    /// Length in bytes of a section: the part of the table slot after which the journal gets a mark.
    section: u32,
    marks: u32,
    memory: PhantomData<M>,
}

impl<M: NorFlash> Journal<M> {
    /// Distance in bytes of two progress marks in the journal, a multiple of the flash word.
    const MARK_STEP: usize = if M::WRITE_SIZE < MARK_LENGTH {
        MARK_LENGTH
    } else {
        M::WRITE_SIZE
    };

    /// Smallest flash page in bytes that holds the record of an upload and one progress mark.
    pub(super) const LEAST_PAGE: usize = MARKS_OFFSET + Self::MARK_STEP;

    /// The journal at offset `start` of the flash memory, for a slot with `capacity` bytes for the lobe table.
    pub(super) fn new(start: u32, capacity: u32) -> Self {
        let page = M::ERASE_SIZE as u32;
        let room = ((M::ERASE_SIZE - MARKS_OFFSET) / Self::MARK_STEP) as u32;
        let pages_per_mark = (capacity / page).div_ceil(room).max(1);
        let section = pages_per_mark * page;
        Self {
            start,
            section,
            marks: capacity.div_ceil(section),
            memory: PhantomData,
        }
    }

    pub(super) fn start(&self) -> u32 {
        self.start
    }

    /// The journal's record of an upload (magic, header of the file, CRC-32), padded to 64 bytes, which are whole
    /// flash words.
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

    /// Offset in the slot, after `written` bytes, at which the next progress mark is due: the end of the present
    /// section.
    pub(super) fn next_mark(&self, written: u32) -> u32 {
        (written / self.section + 1) * self.section
    }

    /// True if a section of the slot ends after `written` bytes, so that its progress mark is due.
    pub(super) fn is_at_mark(&self, written: u32) -> bool {
        written > 0 && written.is_multiple_of(self.section)
    }

    /// Offset in the flash memory, and content, of the journal's mark that `written` bytes of the table are written.
    pub(super) fn mark(&self, header: &Header, written: u32) -> (u32, Vec<u8, MAX_WRITE_SIZE>) {
        let number = written.div_ceil(self.section).saturating_sub(1);
        let value = mark_value(header, number);
        let bytes = value.into_iter().cycle().take(Self::MARK_STEP).collect();
        (self.start + self.offset_of(number), bytes)
    }

    /// Header of the uploaded file, and number of its bytes up to the last valid progress mark (at least those of the
    /// header), from the journal; `None` if the journal has no valid record.
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
            .map_or(0, |number| (number + 1) * self.section);
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
