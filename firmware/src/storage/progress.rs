//! An upload under way: pages erased, words written, marks in the journal.

use heapless::Vec;
use quietcut_core::checksum::Crc32;
use quietcut_core::lobes::format::HEADER_LENGTH;
use quietcut_core::lobes::{Header, TableError};
use quietcut_core::protocol::message::SLOTS;
use quietcut_core::protocol::{Refusal, Upload};

use super::contents::Contents;
use super::journal::Journal;
use super::{ERASED, MAX_WRITE_SIZE, Storage, TableMemory};

/// An upload under way.
pub(super) struct Progress {
    pub(super) slot: usize,
    /// Header of the file.
    pub(super) header: Header,
    /// Bytes of the table that have come, its header included.
    pub(super) received: u32,
    /// The slot is erased up to here, but for what is written already.
    erased_to: u32,
    /// Received bytes that do not fill a word of the flash yet.
    tail: Vec<u8, MAX_WRITE_SIZE>,
    /// The header under which the table will stand in the slot, but for its CRC.
    renewed: Header,
    /// CRC-32 of what has come under both headers: to compute them at the end would hold the device up.
    crc: Crc32,
    renewed_crc: Crc32,
}

impl Progress {
    /// Goes on behind the bytes of the table that are in the slot: `payload`, behind the header, which ends with a page.
    pub(super) fn resumed(slot: usize, header: Header, generation: u32, payload: &[u8]) -> Self {
        let received = (HEADER_LENGTH + payload.len()) as u32;
        let renewed = Header { generation, ..header };
        let mut upload = Self {
            slot,
            header,
            received,
            // The page that follows may be half written, the first one if no page was finished.
            erased_to: if payload.is_empty() { 0 } else { received },
            tail: Vec::new(),
            renewed,
            crc: header.begin_crc(),
            renewed_crc: renewed.begin_crc(),
        };
        upload.sum(payload);
        upload
    }

    fn sum(&mut self, payload: &[u8]) {
        self.crc.update(payload);
        self.renewed_crc.update(payload);
    }

    /// The header for the slot, where all that has come is what the file's header says.
    pub(super) fn checked(&self) -> Result<Header, TableError> {
        let (header, computed) = (self.header.crc, self.crc.value());
        if header == computed {
            Ok(Header {
                crc: self.renewed_crc.value(),
                ..self.renewed
            })
        } else {
            Err(TableError::Crc { header, computed })
        }
    }

    fn written(&self) -> u32 {
        self.received - self.tail.len() as u32
    }

    pub(super) fn state(&self) -> Upload {
        Upload {
            header: self.header,
            received: self.received,
        }
    }
}

impl<M: TableMemory> Storage<M> {
    /// The upload that the journals know of.
    pub(super) fn unfinished(&self) -> Option<Progress> {
        let empty = |&slot: &usize| matches!(self.contents_of(slot), Contents::Empty);
        (0..SLOTS).filter(empty).find_map(|slot| {
            let (header, received) = self.journal(slot).read(self.memory.mapped())?;
            let fits = Header::knows(header.schema) && header.length <= self.slot_capacity();
            let payload = self.slot_bytes(slot).get(HEADER_LENGTH..received as usize)?;
            fits.then(|| Progress::resumed(slot, header, self.next_generation(), payload))
        })
    }

    /// Forgets the upload into a slot: without its journal, what has come is no part of a table.
    ///
    /// Where the flash does not let itself be erased, what is left is no valid table either.
    pub(super) fn forget(&mut self, slot: usize) {
        let journal = self.journal(slot).start();
        let _ = self.erase(journal, Self::PAGE);
    }

    /// Writes data behind what has come: whole words at once, the rest waits in the tail.
    pub(super) fn receive(&mut self, mut upload: Progress, mut data: &[u8]) -> Result<Progress, Refusal> {
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
            upload.sum(head);
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
            let erased = self.erase(start + upload.erased_to, Self::PAGE);
            if upload.erased_to == 0 {
                // The header of the table that was here is gone.
                self.examine(upload.slot);
            }
            erased?;
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
}
