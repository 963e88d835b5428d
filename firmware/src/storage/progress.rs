//! An upload under way: how much has come, and its CRC.

use heapless::Vec;
use quietcut_core::checksum::Crc32;
use quietcut_core::lobes::format::HEADER_LENGTH;
use quietcut_core::lobes::{Header, TableError};
use quietcut_core::protocol::Upload;

use super::memory::MAX_WRITE_SIZE;

/// An upload under way.
pub(super) struct Progress {
    pub(super) slot: usize,
    /// Header of the file.
    pub(super) header: Header,
    /// Bytes of the table that have come, its header included.
    pub(super) received: u32,
    /// The slot is erased up to here, but for what is written already.
    pub(super) erased_to: u32,
    /// Received bytes that do not fill a word of the flash yet.
    pub(super) tail: Vec<u8, MAX_WRITE_SIZE>,
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

    pub(super) fn sum(&mut self, payload: &[u8]) {
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
