//! The requests of the host about lobe tables: list the slots, upload a table.

use quietcut_core::lobes::format::{HEADER_LENGTH, SCHEMA};
use quietcut_core::lobes::{Header, LobeTable, TableError};
use quietcut_core::protocol::message::SLOTS;
use quietcut_core::protocol::{Refusal, Slot, Upload};

use super::TableMemory;
use super::contents::Contents;
use super::journal::Journal;
use super::memory::MAX_WRITE_SIZE;
use super::progress::Progress;
use super::slots::Storage;

impl<M: TableMemory> Storage<M> {
    /// Examines the flash memory for lobe tables. The newest valid table becomes the table in use, and an unfinished
    /// upload is resumed.
    ///
    /// A memory of fewer than four pages cannot hold tables.
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

    /// The lobe table in use; `None` if there is none.
    pub fn table(&self) -> Option<LobeTable<'_>> {
        LobeTable::reopen(self.table_bytes(self.in_use?)?).ok()
    }

    /// The content of each slot.
    pub fn slots(&self) -> [Slot; SLOTS] {
        core::array::from_fn(|slot| match (&self.upload, self.contents_of(slot)) {
            (Some(upload), _) if upload.slot == slot => Slot::Unfinished(upload.state()),
            (_, Contents::Empty) => Slot::Empty,
            (_, Contents::Damaged(why)) => Slot::Damaged(why),
            (_, Contents::Valid(header)) if self.in_use == Some(slot) => Slot::InUse(header),
            (_, Contents::Valid(header)) => Slot::Valid(header),
        })
    }

    /// The progress of the upload of a lobe table.
    ///
    /// # Errors
    /// [`Refusal::NoUpload`] if there is no upload.
    pub fn upload(&self) -> Result<Upload, Refusal> {
        self.upload.as_ref().map(Progress::state).ok_or(Refusal::NoUpload)
    }

    /// Begins the upload of the table with this header into the slot that is not in use. Resumes it if a part of the
    /// same table is already there.
    ///
    /// # Errors
    /// [`Refusal::Table`]: the schema of the header is unknown, or the stated length leaves no byte after the header.
    /// [`Refusal::TableTooLong`]: the table does not fit into the slot. [`Refusal::Flash`]: the flash memory fails.
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
        // The journal is written first, because it names the table of which the slot holds a part. Pages of the slot
        // are erased when the upload reaches them.
        self.erase(journal.start(), Self::PAGE)?;
        let record = Journal::<M>::record(&header);
        self.write(journal.start(), &record)?;
        let upload = Progress::resumed(slot, header, self.next_generation(), &[]);
        let state = upload.state();
        self.upload = Some(upload);
        Ok(state)
    }

    /// Receives a chunk of the uploaded lobe table.
    ///
    /// # Errors
    /// [`Refusal::NoUpload`]. [`Refusal::ChunkOffset`]: the chunk does not begin after the received bytes, or exceeds
    /// the table. [`Refusal::Flash`] ends the upload, and [`begin`](Self::begin) then starts it again from the first
    /// byte of the table.
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

    /// Checks the uploaded lobe table and puts it in use.
    ///
    /// # Errors
    /// [`Refusal::NoUpload`], [`Refusal::Incomplete`]; after [`Refusal::Table`] or [`Refusal::Flash`] the upload is
    /// discarded and the previous table stays in use.
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
                    // The CRC of the table was computed from bytes that were written and read back, so only its entries
                    // need a check.
                    self.record_contents(slot, Self::entries_checked);
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
            Err(_) => self.discard(slot),
        }
        committed
    }

    /// Aborts the upload of a lobe table.
    ///
    /// # Errors
    /// [`Refusal::NoUpload`] if there is no upload.
    pub fn abort(&mut self) -> Result<(), Refusal> {
        let slot = self.upload.take().ok_or(Refusal::NoUpload)?.slot;
        self.discard(slot);
        Ok(())
    }

    /// Returns the flash memory and drops the storage.
    pub fn into_memory(self) -> M {
        self.memory
    }
}
