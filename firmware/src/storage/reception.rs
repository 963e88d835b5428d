//! Reception of an uploaded lobe table: erases pages, writes words and marks the progress in the journal.

use quietcut_core::lobes::Header;
use quietcut_core::lobes::format::HEADER_LENGTH;
use quietcut_core::protocol::Refusal;
use quietcut_core::protocol::message::SLOTS;

use super::TableMemory;
use super::contents::Contents;
use super::journal::Journal;
use super::memory::ERASED;
use super::progress::Progress;
use super::slots::Storage;

impl<M: TableMemory> Storage<M> {
    /// The unfinished upload that the journal of an empty slot records, if there is one of a known schema that fits
    /// into the slot.
    pub(super) fn unfinished(&self) -> Option<Progress> {
        let empty = |&slot: &usize| matches!(self.contents_of(slot), Contents::Empty);
        (0..SLOTS).filter(empty).find_map(|slot| {
            let (header, received) = self.journal(slot).read(self.memory.mapped())?;
            let fits = Header::knows(header.schema) && header.length <= self.slot_capacity();
            let payload = self.slot_bytes(slot).get(HEADER_LENGTH..received as usize)?;
            fits.then(|| Progress::resumed(slot, header, self.next_generation(), payload))
        })
    }

    /// Discards the upload into a slot by erasing its journal.
    ///
    /// An error of the erase is ignored; the upload may then be resumed at the next start.
    pub(super) fn discard(&mut self, slot: usize) {
        let journal = self.journal(slot).start();
        let _ = self.erase(journal, Self::PAGE);
    }

    /// Appends received bytes of the table: writes whole flash words at once and keeps the rest in the tail.
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

    /// Writes whole flash words at an offset of the table slot. Erases each page before its first word is written.
    fn program(&mut self, upload: &mut Progress, offset: u32, words: &[u8]) -> Result<(), Refusal> {
        let start = self.start_of(upload.slot);
        let end = offset + words.len() as u32;
        while upload.erased_to < end {
            let erased = self.erase(start + upload.erased_to, Self::PAGE);
            if upload.erased_to == 0 {
                // The first page of the slot may have held the header of an old table, which this erase has removed.
                self.examine(upload.slot);
            }
            erased?;
            upload.erased_to += Self::PAGE;
        }
        self.write(start + offset, words)
    }

    /// Marks the number of written bytes in the journal.
    ///
    /// A loss of power may have left this mark partly written. It is then not written again; a later mark also covers
    /// these bytes.
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
