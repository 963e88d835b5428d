//! Lobe tables in flash: two slots, so that power may fail at any moment and a whole table is left.
//!
//! The memory is divided into two equal slots. A slot is
//!
//! ```text
//! ├ header │ payload ……………………………………………………… │ journal ┤
//!   32 bytes, written last                       one page
//! ```
//!
//! and what stands before the journal is a table, byte for byte as [`quietcut_core::lobes::format`] has it, but with a
//! generation of its own. At the start the valid table with the newest generation is taken into use, so the order of an
//! upload is: erase the *other* slot and write the payload, page by page from the header's on, check it, write the header.
//! Until the last word of the header stands, the slot is not valid and the old table stays.
//!
//! The journal remembers across a power cut which table was on its way and how far it was: an upload goes on at the
//! page it had reached.
//!
//! No request erases more than one page, so that none holds the device up for longer than that takes.

mod contents;
mod journal;
mod progress;

use embedded_storage::nor_flash::NorFlash;
use quietcut_core::lobes::format::{HEADER_LENGTH, SCHEMA};
use quietcut_core::lobes::{Header, LobeTable, TableError};
use quietcut_core::protocol::message::SLOTS;
use quietcut_core::protocol::{Refusal, Slot, Upload};

use contents::Contents;
use journal::Journal;
use progress::Progress;

/// The largest [`NorFlash::WRITE_SIZE`] that is possible.
const MAX_WRITE_SIZE: usize = HEADER_LENGTH;

/// What erased flash reads as.
const ERASED: u8 = 0xFF;

/// Flash that can be read where it lies in the address space.
///
/// A word whose writing, or a page whose erasing, was cut short by a loss of power may read as anything, but reading it
/// must not fault: a memory with error correction that raises an interrupt there must return from it.
pub trait TableMemory: NorFlash {
    /// All bytes of the memory.
    fn mapped(&self) -> &[u8];
}

/// The table slots of a device.
pub struct Storage<M> {
    memory: M,
    contents: [Contents; SLOTS],
    in_use: Option<usize>,
    upload: Option<Progress>,
}

impl<M: TableMemory> Storage<M> {
    const PAGE: u32 = M::ERASE_SIZE as u32;

    /// Takes the memory and looks what is in it: the newest valid table is in use, an unfinished upload goes on.
    ///
    /// A memory of less than four pages holds no tables.
    pub fn new(memory: M) -> Self {
        const {
            assert!(
                HEADER_LENGTH.is_multiple_of(M::WRITE_SIZE),
                "a word of the flash divides the header"
            );
            assert!(
                M::ERASE_SIZE.is_multiple_of(MAX_WRITE_SIZE),
                "whole words fill a page"
            );
            assert!(
                M::ERASE_SIZE >= Journal::<M>::LEAST_PAGE,
                "a page holds the journal"
            );
        }
        let mut storage = Self {
            memory,
            contents: [Contents::Empty; SLOTS],
            in_use: None,
            upload: None,
        };
        for slot in 0..SLOTS {
            storage.examine(slot);
        }
        storage.in_use = storage.newest();
        storage.upload = storage.unfinished();
        storage
    }

    /// The most bytes of a table.
    pub fn slot_capacity(&self) -> u32 {
        self.slot_length().saturating_sub(Self::PAGE)
    }

    /// The table in use.
    pub fn table(&self) -> Option<LobeTable<'_>> {
        LobeTable::reopen(self.table_bytes(self.in_use?)?).ok()
    }

    /// What is in the slots.
    pub fn slots(&self) -> [Slot; SLOTS] {
        core::array::from_fn(|slot| match (&self.upload, self.contents_of(slot)) {
            (Some(upload), _) if upload.slot == slot => Slot::Unfinished(upload.state()),
            (_, Contents::Empty) => Slot::Empty,
            (_, Contents::Damaged(why)) => Slot::Damaged(why),
            (_, Contents::Valid(header)) if self.in_use == Some(slot) => Slot::InUse(header),
            (_, Contents::Valid(header)) => Slot::Valid(header),
        })
    }

    /// How far the upload is.
    ///
    /// # Errors
    /// [`Refusal::NoUpload`].
    pub fn upload(&self) -> Result<Upload, Refusal> {
        self.upload.as_ref().map(Progress::state).ok_or(Refusal::NoUpload)
    }

    /// Begins to receive the table with this header, into the slot that is not in use; goes on where a part of the same
    /// table is there already.
    ///
    /// # Errors
    /// [`Refusal::Table`], [`Refusal::TableTooLong`], [`Refusal::Flash`].
    pub fn begin(&mut self, header: Header) -> Result<Upload, Refusal> {
        if !Header::knows(header.schema) {
            return Err(Refusal::Table(TableError::Schema {
                found: header.schema,
                known: SCHEMA,
            }));
        }
        let needed = HEADER_LENGTH as u32 + 1;
        if header.length < needed {
            return Err(Refusal::Table(TableError::TooShort {
                needed,
                found: header.length,
            }));
        }
        let capacity = self.slot_capacity();
        if header.length > capacity {
            return Err(Refusal::TableTooLong {
                length: header.length,
                capacity,
            });
        }
        if let Some(upload) = self.upload.as_ref().filter(|upload| upload.header == header) {
            return Ok(upload.state());
        }
        let slot = self.free_slot();
        self.upload = None;
        let journal = self.journal(slot);
        // The journal first: without it nothing in the slot counts as a part of a table. The pages are erased as they are reached.
        self.erase(journal.start(), Self::PAGE)?;
        let record = Journal::<M>::record(&header);
        self.write(journal.start(), &record)?;
        let upload = Progress::resumed(slot, header, self.next_generation(), &[]);
        let state = upload.state();
        self.upload = Some(upload);
        Ok(state)
    }

    /// Receives a piece of the table.
    ///
    /// # Errors
    /// [`Refusal::NoUpload`], [`Refusal::ChunkOffset`]; after [`Refusal::Flash`] the upload must begin again, and goes on at
    /// the last page that is whole.
    pub fn chunk(&mut self, offset: u32, data: &[u8]) -> Result<Upload, Refusal> {
        let upload = self.upload.take().ok_or(Refusal::NoUpload)?;
        let (expected, length) = (upload.received, upload.header.length);
        let rest = length - expected;
        if offset != expected || data.len() > rest as usize {
            self.upload = Some(upload);
            return Err(Refusal::ChunkOffset {
                expected,
                found: offset,
                length,
            });
        }
        let upload = self.receive(upload, data)?;
        let state = upload.state();
        self.upload = Some(upload);
        Ok(state)
    }

    /// Checks the table that was received and takes it into use.
    ///
    /// # Errors
    /// [`Refusal::NoUpload`], [`Refusal::Incomplete`]; after [`Refusal::Table`] or [`Refusal::Flash`] the upload is gone and the table
    /// that was in use still is.
    pub fn commit(&mut self) -> Result<(), Refusal> {
        let upload = self.upload.take().ok_or(Refusal::NoUpload)?;
        let Upload { header, received } = upload.state();
        if received < header.length {
            self.upload = Some(upload);
            return Err(Refusal::Incomplete {
                received,
                length: header.length,
            });
        }
        let slot = upload.slot;
        let committed = match upload.checked() {
            Ok(renewed) => self
                .write(self.start_of(slot), &renewed.to_bytes())
                .and_then(|()| {
                    // The CRC is that of what was written and read back.
                    self.note(slot, Self::entries_checked);
                    match self.contents_of(slot) {
                        Contents::Valid(_) => Ok(()),
                        Contents::Damaged(why) => Err(Refusal::Table(why)),
                        Contents::Empty => Err(Refusal::Flash),
                    }
                }),
            Err(why) => Err(Refusal::Table(why)),
        };
        match committed {
            Ok(()) => self.in_use = Some(slot),
            Err(_) => self.forget(slot),
        }
        committed
    }

    /// Gives the upload up.
    ///
    /// # Errors
    /// [`Refusal::NoUpload`].
    pub fn abort(&mut self) -> Result<(), Refusal> {
        let slot = self.upload.take().ok_or(Refusal::NoUpload)?.slot;
        self.forget(slot);
        Ok(())
    }

    /// The memory, when the storage is no longer needed.
    pub fn into_memory(self) -> M {
        self.memory
    }

    fn slot_length(&self) -> u32 {
        let length = (self.memory.capacity() / SLOTS) as u32;
        length - length % Self::PAGE
    }

    fn start_of(&self, slot: usize) -> u32 {
        slot as u32 * self.slot_length()
    }

    fn journal(&self, slot: usize) -> Journal<M> {
        Journal::new(self.start_of(slot) + self.slot_capacity(), self.slot_capacity())
    }

    /// The bytes of a slot before the journal.
    fn slot_bytes(&self, slot: usize) -> &[u8] {
        let start = self.start_of(slot) as usize;
        let end = start + self.slot_capacity() as usize;
        self.memory.mapped().get(start..end).unwrap_or_default()
    }

    /// The table in a slot, as long as its header says.
    fn table_bytes(&self, slot: usize) -> Option<&[u8]> {
        let bytes = self.slot_bytes(slot);
        let header = Header::read(bytes).ok()?;
        bytes.get(..header.length as usize)
    }

    fn erase(&mut self, from: u32, length: u32) -> Result<(), Refusal> {
        self.memory.erase(from, from + length).map_err(|_| Refusal::Flash)
    }

    /// Writes and reads back.
    fn write(&mut self, offset: u32, words: &[u8]) -> Result<(), Refusal> {
        self.memory.write(offset, words).map_err(|_| Refusal::Flash)?;
        let range = offset as usize..offset as usize + words.len();
        if self.memory.mapped().get(range) == Some(words) {
            Ok(())
        } else {
            Err(Refusal::Flash)
        }
    }
}
