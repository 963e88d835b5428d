//! The two table slots in flash: their layout, and reading, erasing and writing of their bytes.

use quietcut_core::lobes::Header;
use quietcut_core::protocol::Refusal;
use quietcut_core::protocol::message::SLOTS;

use super::TableMemory;
use super::contents::Contents;
use super::journal::Journal;
use super::progress::Progress;

/// The slots in the flash memory of a device that hold its lobe tables.
pub struct Storage<M> {
    pub(super) memory: M,
    pub(super) contents: [Contents; SLOTS],
    pub(super) in_use: Option<usize>,
    pub(super) upload: Option<Progress>,
}

impl<M: TableMemory> Storage<M> {
    pub(super) const PAGE: u32 = M::ERASE_SIZE as u32;

    /// Largest length in bytes of a lobe table that fits into a slot.
    pub fn slot_capacity(&self) -> u32 {
        self.slot_length().saturating_sub(Self::PAGE)
    }

    fn slot_length(&self) -> u32 {
        let length = (self.memory.capacity() / SLOTS) as u32;
        length - length % Self::PAGE
    }

    pub(super) fn start_of(&self, slot: usize) -> u32 {
        slot as u32 * self.slot_length()
    }

    pub(super) fn journal(&self, slot: usize) -> Journal<M> {
        Journal::new(self.start_of(slot) + self.slot_capacity(), self.slot_capacity())
    }

    /// The bytes of a table slot, without its journal.
    pub(super) fn slot_bytes(&self, slot: usize) -> &[u8] {
        let start = self.start_of(slot) as usize;
        let end = start + self.slot_capacity() as usize;
        self.memory.mapped().get(start..end).unwrap_or_default()
    }

    /// The bytes of the lobe table in a slot, with the length that its header states; `None` if the header cannot be
    /// read or states more bytes than the slot has.
    pub(super) fn table_bytes(&self, slot: usize) -> Option<&[u8]> {
        let bytes = self.slot_bytes(slot);
        let header = Header::read(bytes).ok()?;
        bytes.get(..header.length as usize)
    }

    pub(super) fn erase(&mut self, from: u32, length: u32) -> Result<(), Refusal> {
        self.memory.erase(from, from + length).map_err(|_| Refusal::Flash)
    }

    /// Writes flash words at an offset of the memory and verifies them by reading back.
    pub(super) fn write(&mut self, offset: u32, words: &[u8]) -> Result<(), Refusal> {
        self.memory.write(offset, words).map_err(|_| Refusal::Flash)?;
        let range = offset as usize..offset as usize + words.len();
        if self.memory.mapped().get(range) == Some(words) {
            Ok(())
        } else {
            Err(Refusal::Flash)
        }
    }
}
