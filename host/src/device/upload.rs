//! Upload of a lobe table in chunks; it resumes an interrupted upload of the same table.

use quietcut_core::lobes::LobeTable;
use quietcut_core::lobes::format::HEADER_LENGTH;
use quietcut_core::protocol::message::MAX_CHUNK;
use quietcut_core::protocol::{Info, Refusal, Reply, Request, Upload};

use super::DeviceError;
use super::client::{Client, REPLY_AFTER_ERASE};

/// Number of new attempts to upload a lobe table after a restart of the device during the upload: a choice.
const RESTARTS: u32 = 3;

/// Result of an upload.
#[derive(Clone, Debug, PartialEq)]
pub struct Uploaded {
    /// Identity and memory slots of the device after the upload of the table.
    pub info: Info,
    /// Offset in the lobe table at which an interrupted upload was resumed, bytes; 0 if no upload was resumed.
    pub resumed_at: u32,
}

impl Client {
    /// Sends the table and activates it on the device. The device keeps its old table until the new one is complete and
    /// checked.
    ///
    /// At the start and after each chunk `progress` gets the number of received bytes and the total number of bytes.
    ///
    /// # Errors
    /// For example: the table is invalid, or the device does not answer, refuses the table, or restarts repeatedly.
    pub fn upload(
        &mut self,
        table: &LobeTable<'_>,
        mut progress: impl FnMut(u32, u32),
    ) -> Result<Uploaded, DeviceError> {
        let mut resumed_at = None;
        let mut restarts = 0;
        loop {
            match self.send_table(table, &mut resumed_at, &mut progress) {
                Err(DeviceError::Refused {
                    refusal: Refusal::HelloFirst | Refusal::NoUpload,
                    ..
                }) if restarts < RESTARTS => {
                    restarts += 1;
                    tracing::warn!("{}: the device was restarted; the upload goes on", self.port());
                    self.hello()?;
                }
                Err(error) => return Err(error),
                Ok(()) => {
                    let info = self.info()?;
                    return Ok(Uploaded {
                        info,
                        resumed_at: resumed_at.unwrap_or(0),
                    });
                }
            }
        }
    }

    fn send_table(
        &mut self,
        table: &LobeTable<'_>,
        resumed_at: &mut Option<u32>,
        progress: &mut impl FnMut(u32, u32),
    ) -> Result<(), DeviceError> {
        const BEGIN: &str = "begin of the upload";
        let header = table.header().map_err(|error| DeviceError::Table { error })?;
        let bytes = table.bytes();
        let begin = Request::UploadBegin(header);
        let mut received = match self.exchange(&begin, BEGIN, REPLY_AFTER_ERASE)? {
            Reply::Upload(Upload { received, .. }) => received,
            other => return Err(self.unexpected(BEGIN, &other)),
        };
        // The request that starts the upload already contains the header of the table: reception of the header alone is
        // no resumed upload.
        resumed_at.get_or_insert(if received > HEADER_LENGTH as u32 {
            received
        } else {
            0
        });
        progress(received, header.length);
        while received < header.length {
            received = self.send_chunk(bytes, received)?;
            progress(received, header.length);
        }
        self.command_within(&Request::UploadCommit, "table", REPLY_AFTER_ERASE)
    }

    /// Sends the chunk of the lobe table that begins at byte `offset`; returns the offset of the next chunk.
    fn send_chunk(&mut self, bytes: &[u8], offset: u32) -> Result<u32, DeviceError> {
        const CHUNK: &str = "piece of the table";
        let rest = bytes.get(offset as usize..).unwrap_or_default();
        let piece = rest.get(..MAX_CHUNK).unwrap_or(rest);
        let data = piece
            .try_into()
            .map_err(|_| DeviceError::TooLarge { request: CHUNK })?;
        match self.exchange(&Request::UploadChunk { offset, data }, CHUNK, REPLY_AFTER_ERASE) {
            Ok(Reply::Upload(Upload { received, .. })) if received > offset => Ok(received),
            Ok(other) => Err(self.unexpected(CHUNK, &other)),
            // The device refuses the chunk and states the offset that it expects: a reply was lost, or the device was
            // restarted. The upload goes on from there.
            Err(DeviceError::Refused {
                refusal: Refusal::ChunkOffset { expected, .. },
                ..
            }) if expected != offset && expected as usize <= bytes.len() => Ok(expected),
            Err(error) => Err(error),
        }
    }
}
