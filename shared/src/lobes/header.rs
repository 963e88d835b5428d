//! The header of a lobe table: schema, length, generation and CRC-32.

use serde::{Deserialize, Serialize};

use super::TableError;
use super::bytes::{array_at, saturate, u16_at, u32_at};
use super::format::{
    CRC_OFFSET, HEADER_LENGTH, LAYERS_OFFSET, MAGIC, SCHEMA, SCHEMA_ADDITIONS, SCHEMA_PLAIN,
};
use crate::checksum::{Crc32, crc32};

/// The first [`HEADER_LENGTH`] bytes of a lobe table.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Header {
    /// Schema of the lobe table. After [`read`](Self::read) it is one that this code [`knows`](Self::knows).
    pub schema: u16,
    /// Length of the whole lobe table in bytes, header included.
    pub length: u32,
    /// Generation number of the lobe table: incremented by the device with each upload; 0 in a file.
    pub generation: u32,
    /// CRC-32 of all bytes of the lobe table except the four of the CRC itself.
    pub crc: u32,
}

impl Header {
    /// True if this code can read lobe tables of this schema.
    pub const fn knows(schema: u16) -> bool {
        matches!(schema, SCHEMA_PLAIN | SCHEMA_ADDITIONS | SCHEMA)
    }

    /// Reads the header of a lobe table at the beginning of `bytes`. Refuses too few bytes, a wrong magic number, an
    /// unknown schema, and a length that is too small for a table.
    ///
    /// `bytes` may be longer than the table. The CRC is not checked here, but by [`check`](Self::check).
    pub fn read(bytes: &[u8]) -> Result<Self, TableError> {
        let too_short = TableError::TooShort {
            needed: LAYERS_OFFSET as u32,
            found: saturate(bytes.len()),
        };
        let magic = array_at(bytes, 0).ok_or(too_short)?;
        if magic != MAGIC {
            return Err(TableError::Magic { found: magic });
        }
        let schema = u16_at(bytes, 4).ok_or(too_short)?;
        if !Self::knows(schema) {
            return Err(TableError::Schema {
                found: schema,
                known: SCHEMA,
            });
        }
        let length = u32_at(bytes, 8).ok_or(too_short)?;
        if (length as usize) < LAYERS_OFFSET {
            return Err(TableError::TooShort {
                needed: LAYERS_OFFSET as u32,
                found: length,
            });
        }
        Ok(Self {
            schema,
            length,
            generation: u32_at(bytes, 12).ok_or(too_short)?,
            crc: u32_at(bytes, CRC_OFFSET).ok_or(too_short)?,
        })
    }

    /// Checks that `bytes` are exactly the lobe table of this header, including the CRC-32.
    pub fn check(&self, bytes: &[u8]) -> Result<(), TableError> {
        if bytes.len() as u64 != u64::from(self.length) {
            return Err(TableError::Length {
                header: self.length,
                found: saturate(bytes.len()),
            });
        }
        let payload = bytes.get(HEADER_LENGTH..).unwrap_or_default();
        self.check_payload(payload)?;
        // The CRC-32 was computed with zeros in the reserved bytes of the header, so these bytes must be zero.
        if bytes.get(..HEADER_LENGTH) == Some(&self.to_bytes()) {
            return Ok(());
        }
        let header = bytes.get(..CRC_OFFSET).unwrap_or_default();
        Err(TableError::Crc {
            header: self.crc,
            computed: crc32([header, payload]),
        })
    }

    /// Checks the CRC-32 of a lobe table; `payload` are the bytes after this header.
    pub fn check_payload(&self, payload: &[u8]) -> Result<(), TableError> {
        let computed = self.crc_with(payload);
        if computed == self.crc {
            Ok(())
        } else {
            Err(TableError::Crc {
                header: self.crc,
                computed,
            })
        }
    }

    /// This header of a lobe table with another generation number and the matching CRC-32. `payload` are the bytes
    /// after the header.
    pub fn with_generation(self, generation: u32, payload: &[u8]) -> Self {
        let renewed = Self { generation, ..self };
        Self {
            crc: renewed.crc_with(payload),
            ..renewed
        }
    }

    /// The bytes of the header.
    pub fn to_bytes(&self) -> [u8; HEADER_LENGTH] {
        let mut bytes = self.without_crc();
        if let Some(slot) = bytes.get_mut(CRC_OFFSET..) {
            slot.copy_from_slice(&self.crc.to_le_bytes());
        }
        bytes
    }

    fn without_crc(&self) -> [u8; HEADER_LENGTH] {
        let mut bytes = [0; HEADER_LENGTH];
        let fields = MAGIC
            .into_iter()
            .chain(self.schema.to_le_bytes())
            .chain([0, 0])
            .chain(self.length.to_le_bytes())
            .chain(self.generation.to_le_bytes());
        for (slot, byte) in bytes.iter_mut().zip(fields) {
            *slot = byte;
        }
        bytes
    }

    /// The CRC-32 over the header of the lobe table without its CRC field; the caller updates it with the bytes after
    /// the header.
    pub fn begin_crc(&self) -> Crc32 {
        let mut crc = Crc32::new();
        crc.update(self.without_crc().get(..CRC_OFFSET).unwrap_or_default());
        crc
    }

    fn crc_with(&self, payload: &[u8]) -> u32 {
        let mut crc = self.begin_crc();
        crc.update(payload);
        crc.value()
    }
}
