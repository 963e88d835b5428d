//! The progress of the upload of a lobe table: received bytes and their CRC-32.

use heapless::Vec;
use quietcut_core::checksum::Crc32;
use quietcut_core::lobes::format::HEADER_LENGTH;
use quietcut_core::lobes::{Header, TableError};
use quietcut_core::protocol::Upload;

use super::memory::MAX_WRITE_SIZE;

/// The progress of an upload.
pub(super) struct Progress {
    pub(super) slot: usize,
    /// Header of the uploaded file.
    pub(super) header: Header,
    /// Number of received bytes of the uploaded table, header included.
    pub(super) received: u32,
    /// Offset in the table slot up to which the flash is erased or written.
    pub(super) erased_to: u32,
    /// Received bytes of the table that do not yet fill a flash word.
    pub(super) tail: Vec<u8, MAX_WRITE_SIZE>,
    /// The header of the uploaded table as it is written to the slot. It has the device's generation number, but
    /// not yet its own CRC.
    renewed: Header,
    /// Running CRC-32 of the received table with the header of the uploaded file. Computing it only at the end of the
    /// upload would delay the device.
    crc: Crc32,
    /// Running CRC-32 of the received table with the header that is written to the slot.
    renewed_crc: Crc32,
}

impl Progress {
    /// Begins or resumes an upload. `payload` are the bytes after the header of the table that are already in the
    /// slot: none, or those up to the last progress mark of the journal.
    pub(super) fn resumed(slot: usize, header: Header, generation: u32, payload: &[u8]) -> Self {
        let received = (HEADER_LENGTH + payload.len()) as u32;
        let renewed = Header { generation, ..header };
        let mut upload = Self {
            slot,
            header,
            received,
            // The flash page after the last complete one may be partly written. It is erased again.
            erased_to: if payload.is_empty() { 0 } else { received },
            tail: Vec::new(),
            renewed,
            crc: header.begin_crc(),
            renewed_crc: renewed.begin_crc(),
        };
        upload.sum(payload);
        upload
    }

    pub(super) fn sum(&mut self, payload: &[u8]) {
        self.crc.update(payload);
        self.renewed_crc.update(payload);
    }

    /// The header to write to the slot, if the received bytes of the table match the CRC in the file's header.
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

    pub(super) fn written(&self) -> u32 {
        self.received - self.tail.len() as u32
    }

    pub(super) fn state(&self) -> Upload {
        Upload {
            header: self.header,
            received: self.received,
        }
    }
}
