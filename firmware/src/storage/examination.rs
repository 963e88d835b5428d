//! Examination of the table slots in flash: their content, the newest table, and the slot of the next upload.

use quietcut_core::lobes::format::HEADER_LENGTH;
use quietcut_core::lobes::{Header, LobeTable, TableError};
use quietcut_core::protocol::message::SLOTS;

use super::TableMemory;
use super::contents::Contents;
use super::memory::ERASED;
use super::slots::Storage;

impl<M: TableMemory> Storage<M> {
    pub(super) fn contents_of(&self, slot: usize) -> Contents {
        self.contents.get(slot).copied().unwrap_or(Contents::Empty)
    }

    /// Determines the content of a table slot with a full check of its table.
    pub(super) fn examine(&mut self, slot: usize) {
        self.record_contents(slot, |table| LobeTable::parse(table).map(|_| ()));
    }

    /// Checks the entries of a lobe table whose CRC-32 has already been verified.
    pub(super) fn entries_checked(table: &[u8]) -> Result<(), TableError> {
        LobeTable::reopen(table)?.check_entries()
    }

    /// Records the content of a table slot. The table is valid if its header is readable, its length fits into the
    /// slot, and `check` accepts its bytes.
    pub(super) fn record_contents(
        &mut self,
        slot: usize,
        check: impl FnOnce(&[u8]) -> Result<(), TableError>,
    ) {
        let bytes = self.slot_bytes(slot);
        let is_empty = bytes.iter().take(HEADER_LENGTH).all(|&byte| byte == ERASED);
        let read = || {
            let header = Header::read(bytes)?;
            let table = bytes.get(..header.length as usize).ok_or(TableError::Length {
                header: header.length,
                found: bytes.len() as u32,
            })?;
            check(table).map(|()| header)
        };
        let contents = match read() {
            Ok(header) => Contents::Valid(header),
            Err(_) if is_empty => Contents::Empty,
            Err(why) => Contents::Damaged(why),
        };
        if let Some(slot) = self.contents.get_mut(slot) {
            *slot = contents;
        }
    }

    /// The slot with the newest valid lobe table; `None` if no slot holds a valid one.
    pub(super) fn newest(&self) -> Option<usize> {
        let generation = |slot: &usize| match self.contents_of(*slot) {
            Contents::Valid(header) => Some(header.generation),
            _ => None,
        };
        let slots = || (0..SLOTS).filter(|slot| generation(slot).is_some());
        // Generation numbers of lobe tables wrap at 2³². Table `b` is newer if its number is less than 2³¹ − 1
        // ahead of that of table `a`.
        slots().reduce(|a, b| match (generation(&a), generation(&b)) {
            (Some(of_a), Some(of_b)) if of_b.wrapping_sub(of_a) < u32::MAX / 2 => b,
            _ => a,
        })
    }

    /// The generation number that the next uploaded lobe table gets.
    pub(super) fn next_generation(&self) -> u32 {
        match self.in_use.map(|slot| self.contents_of(slot)) {
            Some(Contents::Valid(header)) => header.generation.wrapping_add(1),
            _ => 1,
        }
    }

    /// The table slot of the next upload: one whose table is not in use.
    pub(super) fn free_slot(&self) -> usize {
        (0..SLOTS)
            .find(|&slot| self.in_use != Some(slot))
            .unwrap_or_default()
    }
}
