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
//! upload is: erase the header of the *other* slot, write the payload page by page, check it, write the header. Until the last
//! word of the header stands, the slot is not valid and the old table stays.
//!
//! The journal remembers across a power cut which table was on its way and how far it was: an upload goes on at the
//! page it had reached.

mod journal;

use embedded_storage::nor_flash::NorFlash;
use heapless::Vec;
use quietcut_core::lobes::format::{HEADER_LENGTH, SCHEMA};
use quietcut_core::lobes::{Header, LobeTable, TableError};
use quietcut_core::protocol::message::SLOTS;
use quietcut_core::protocol::{Refusal, Slot, Upload};

use journal::Journal;

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

/// What is in the table part of a slot.
#[derive(Clone, Copy)]
enum Contents {
    Empty,
    Damaged(TableError),
    Valid(Header),
}

/// An upload under way.
struct Progress {
    slot: usize,
    /// Header of the file.
    header: Header,
    /// Bytes of the table that have come, its header included.
    received: u32,
    /// The slot is erased up to here, but for what is written already.
    erased_to: u32,
    /// Received bytes that do not fill a word of the flash yet.
    tail: Vec<u8, MAX_WRITE_SIZE>,
}

impl Progress {
    /// Goes on behind the first `received` bytes, which end with a page.
    fn resumed(slot: usize, header: Header, received: u32) -> Self {
        // The page that follows may be half written, the first one if no page was finished.
        let erased_to = if received == HEADER_LENGTH as u32 {
            0
        } else {
            received
        };
        Self {
            slot,
            header,
            received,
            erased_to,
            tail: Vec::new(),
        }
    }

    fn written(&self) -> u32 {
        self.received - self.tail.len() as u32
    }

    fn state(&self) -> Upload {
        Upload {
            header: self.header,
            received: self.received,
        }
    }
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
        if header.schema != SCHEMA {
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
        // The journal first: without it nothing in the slot counts as a part of a table.
        self.erase(journal.start(), Self::PAGE)?;
        self.erase(self.start_of(slot), Self::PAGE)?;
        self.examine(slot);
        let record = Journal::<M>::record(&header);
        self.write(journal.start(), &record)?;
        let mut upload = Progress::resumed(slot, header, HEADER_LENGTH as u32);
        upload.erased_to = Self::PAGE;
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
        let checked = self.payload(slot, &header).map_or(
            Err(TableError::Length {
                header: header.length,
                found: self.slot_capacity(),
            }),
            |payload| {
                header
                    .check_payload(payload)
                    .map(|()| header.with_generation(self.next_generation(), payload))
            },
        );
        let committed = match checked {
            Ok(renewed) => self
                .write(self.start_of(slot), &renewed.to_bytes())
                .and_then(|()| {
                    self.examine(slot);
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

    /// Gives the upload up.
    ///
    /// # Errors
    /// [`Refusal::NoUpload`].
    pub fn abort(&mut self) -> Result<(), Refusal> {
        let slot = self.upload.take().ok_or(Refusal::NoUpload)?.slot;
        self.discard(slot);
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

    fn contents_of(&self, slot: usize) -> Contents {
        self.contents.get(slot).copied().unwrap_or(Contents::Empty)
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

    fn payload(&self, slot: usize, header: &Header) -> Option<&[u8]> {
        self.slot_bytes(slot).get(HEADER_LENGTH..header.length as usize)
    }

    /// Looks what is in a slot.
    fn examine(&mut self, slot: usize) {
        let bytes = self.slot_bytes(slot);
        let is_empty = bytes.iter().take(HEADER_LENGTH).all(|&byte| byte == ERASED);
        let read = || {
            let header = Header::read(bytes)?;
            let table = bytes.get(..header.length as usize).ok_or(TableError::Length {
                header: header.length,
                found: bytes.len() as u32,
            })?;
            LobeTable::parse(table).map(|_| header)
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

    fn newest(&self) -> Option<usize> {
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

    fn next_generation(&self) -> u32 {
        match self.in_use.map(|slot| self.contents_of(slot)) {
            Some(Contents::Valid(header)) => header.generation.wrapping_add(1),
            _ => 1,
        }
    }

    /// The slot for the next upload: one that is not in use.
    fn free_slot(&self) -> usize {
        (0..SLOTS)
            .find(|&slot| self.in_use != Some(slot))
            .unwrap_or_default()
    }

    /// The upload that the journals know of.
    fn unfinished(&self) -> Option<Progress> {
        let empty = |&slot: &usize| matches!(self.contents_of(slot), Contents::Empty);
        (0..SLOTS).filter(empty).find_map(|slot| {
            let (header, received) = self.journal(slot).read(self.memory.mapped())?;
            let fits = header.schema == SCHEMA && header.length <= self.slot_capacity();
            fits.then(|| Progress::resumed(slot, header, received))
        })
    }

    /// Makes a slot empty. Where the flash does not let itself be erased, what is left is no valid table either.
    fn discard(&mut self, slot: usize) {
        let journal = self.journal(slot).start();
        let _ = self
            .erase(journal, Self::PAGE)
            .and_then(|()| self.erase(self.start_of(slot), Self::PAGE));
        self.examine(slot);
    }

    /// Writes data behind what has come: whole words at once, the rest waits in the tail.
    fn receive(&mut self, mut upload: Progress, mut data: &[u8]) -> Result<Progress, Refusal> {
        let journal = self.journal(upload.slot);
        while !data.is_empty() {
            let to_mark = journal.next_mark(upload.written()) - upload.written();
            let whole = data.len().min(to_mark as usize) / M::WRITE_SIZE * M::WRITE_SIZE;
            let (head, rest) = data.split_at(if upload.tail.is_empty() && whole > 0 {
                whole
            } else {
                1
            });
            data = rest;
            let at = upload.written();
            upload.received += head.len() as u32;
            if upload.tail.is_empty() && whole > 0 {
                self.program(&mut upload, at, head)?;
            } else {
                upload.tail.extend_from_slice(head).map_err(|_| Refusal::Flash)?;
                if upload.received == upload.header.length {
                    while upload.tail.len() < M::WRITE_SIZE {
                        upload.tail.push(ERASED).map_err(|_| Refusal::Flash)?;
                    }
                }
                if upload.tail.len() == M::WRITE_SIZE {
                    let tail = core::mem::take(&mut upload.tail);
                    self.program(&mut upload, at, &tail)?;
                }
            }
            let is_complete = upload.received == upload.header.length;
            if is_complete || journal.is_at_mark(upload.written()) {
                self.mark(&journal, &upload)?;
            }
        }
        Ok(upload)
    }

    /// Writes whole words at an offset of the slot, erasing the pages they begin.
    fn program(&mut self, upload: &mut Progress, offset: u32, words: &[u8]) -> Result<(), Refusal> {
        let start = self.start_of(upload.slot);
        let end = offset + words.len() as u32;
        while upload.erased_to < end {
            self.erase(start + upload.erased_to, Self::PAGE)?;
            upload.erased_to += Self::PAGE;
        }
        self.write(start + offset, words)
    }

    /// Notes in the journal how much is written.
    ///
    /// A power cut may have left this very mark half written: then it stays as it is, and the next one says it too.
    fn mark(&mut self, journal: &Journal<M>, upload: &Progress) -> Result<(), Refusal> {
        let (offset, mark) = journal.mark(&upload.header, upload.written());
        let range = offset as usize..offset as usize + mark.len();
        let is_erased = self
            .memory
            .mapped()
            .get(range)
            .is_some_and(|bytes| bytes.iter().all(|&byte| byte == ERASED));
        if is_erased {
            self.write(offset, &mark)
        } else {
            Ok(())
        }
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
