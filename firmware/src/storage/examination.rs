//! What is in the slots, and which of them comes next.

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

    /// Looks what is in a slot.
    pub(super) fn examine(&mut self, slot: usize) {
        self.note(slot, |table| LobeTable::parse(table).map(|_| ()));
    }

    /// A check for tables whose CRC is known to be right.
    pub(super) fn entries_checked(table: &[u8]) -> Result<(), TableError> {
        LobeTable::reopen(table)?.check_entries()
    }

    /// Notes what is in a slot; `check` refuses bytes that are no table.
    pub(super) fn note(&mut self, slot: usize, check: impl FnOnce(&[u8]) -> Result<(), TableError>) {
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

    pub(super) fn newest(&self) -> Option<usize> {
        let generation = |slot: &usize| match self.contents_of(*slot) {
            Contents::Valid(header) => Some(header.generation),
            _ => None,
        };
        let slots = || (0..SLOTS).filter(|slot| generation(slot).is_some());
        // Generations may come round: the newer of two is the one less than half a round ahead.
        slots().reduce(|a, b| match (generation(&a), generation(&b)) {
            (Some(of_a), Some(of_b)) if of_b.wrapping_sub(of_a) < u32::MAX / 2 => b,
            _ => a,
        })
    }

    pub(super) fn next_generation(&self) -> u32 {
        match self.in_use.map(|slot| self.contents_of(slot)) {
            Some(Contents::Valid(header)) => header.generation.wrapping_add(1),
            _ => 1,
        }
    }

    /// The slot for the next upload: one that is not in use.
    pub(super) fn free_slot(&self) -> usize {
        (0..SLOTS)
            .find(|&slot| self.in_use != Some(slot))
            .unwrap_or_default()
    }
}
