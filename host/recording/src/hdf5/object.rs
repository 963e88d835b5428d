//! Object headers of an HDF5 file: the messages that describe a group or a dataset.

use super::fault::Fault;
use super::storage::Storage;

/// Kind of a message with another block of messages.
const CONTINUATION: u16 = 0x10;

/// Largest number of blocks of messages of one object. A choice; objects of recordings have one to three.
const BLOCKS_MAX: usize = 1000;

/// Flag of a message whose content stands in another place of the file.
const SHARED: u8 = 2;

/// A group or a dataset of an HDF5 file.
#[derive(Debug)]
pub(crate) struct Object {
    messages: Vec<Message>,
}

/// One message of an object header.
#[derive(Debug)]
struct Message {
    kind: u16,
    flags: u8,
    content: Vec<u8>,
}

impl Object {
    /// Content of the first message of `kind`, `None` without one; an error if it stands in another place of the file.
    pub(super) fn message(&self, kind: u16) -> Result<Option<&[u8]>, Fault> {
        self.messages(kind).next().transpose()
    }

    /// Contents of the messages of `kind`.
    pub(super) fn messages(&self, kind: u16) -> impl Iterator<Item = Result<&[u8], Fault>> {
        let found = self.messages.iter().filter(move |message| message.kind == kind);
        found.map(|message| match message.flags & SHARED {
            0 => Ok(message.content.as_slice()),
            _ => Err(Fault::Unsupported {
                what: format!("a shared message of kind {} of HDF5", message.kind),
            }),
        })
    }

    /// Reads the header of the object at an address.
    pub(super) fn read(storage: &mut Storage<'_>, address: u64) -> Result<Self, Fault> {
        match storage.is_marked(address, "OHDR")? {
            true => Self::read_version_2(storage, address),
            false => Self::read_version_1(storage, address),
        }
    }

    fn read_version_1(storage: &mut Storage<'_>, address: u64) -> Result<Self, Fault> {
        /// Length of the head with its padding, bytes.
        const HEAD: u64 = 16;
        let head = storage.header(address, HEAD)?;
        let mut cursor = storage.cursor(&head, "the head of an object");
        let version = cursor.byte()?;
        if version != 1 {
            return Err(Fault::Value {
                part: "the version of an object header",
                value: u64::from(version),
            });
        }
        cursor.skip(1)?;
        let _messages = cursor.short()?;
        cursor.skip(4)?;
        let length = cursor.unsigned(4)?;
        let mut object = Self { messages: Vec::new() };
        let mut blocks = vec![(address.saturating_add(HEAD), length)];
        let mut read = 0;
        while let Some(&(address, length)) = blocks.get(read) {
            read += 1;
            let block = storage.header(address, length)?;
            let mut cursor = storage.cursor(&block, "a block of messages");
            while cursor.rest().len() >= 8 {
                let kind = cursor.short()? as u16;
                let length = cursor.short()?;
                let flags = cursor.byte()?;
                cursor.skip(3)?;
                let content = cursor.take(length)?;
                object.add(storage, kind, flags, content, &mut blocks)?;
            }
        }
        Ok(object)
    }

    fn read_version_2(storage: &mut Storage<'_>, address: u64) -> Result<Self, Fault> {
        /// Largest length of the head, bytes: mark, version, flags, four times, two limits and a length of 8 bytes.
        const HEAD_MAX: u64 = 4 + 1 + 1 + 16 + 4 + 8;
        let head = storage.header_up_to(address, HEAD_MAX)?;
        let mut cursor = storage.cursor(&head, "the head of an object");
        cursor.skip(5)?;
        let flags = cursor.byte()?;
        if flags & 0x20 != 0 {
            cursor.skip(16)?;
        }
        if flags & 0x10 != 0 {
            cursor.skip(4)?;
        }
        let length = cursor.unsigned(1 << (flags & 3))?;
        let mut object = Self { messages: Vec::new() };
        // Continued blocks begin with a mark of 4 bytes and end with a checksum of 4 bytes.
        let mut blocks = vec![(address.saturating_add(cursor.at as u64), length)];
        let mut read = 0;
        let head_of_message = if flags & 4 != 0 { 6 } else { 4 };
        while let Some(&(address, length)) = blocks.get(read) {
            let block = match read {
                0 => storage.header(address, length)?,
                _ => {
                    let mut block = storage.marked(address, length, "OCHK")?;
                    block.truncate(block.len().saturating_sub(4));
                    block
                }
            };
            let mut cursor = storage.cursor(&block, "a block of messages");
            if read > 0 {
                cursor.skip(4)?;
            }
            read += 1;
            // A gap at the end is shorter than the head of a message.
            while cursor.rest().len() >= head_of_message {
                let kind = u16::from(cursor.byte()?);
                let length = cursor.short()?;
                let flags = cursor.byte()?;
                cursor.skip(head_of_message - 4)?;
                let content = cursor.take(length)?;
                object.add(storage, kind, flags, content, &mut blocks)?;
            }
        }
        Ok(object)
    }

    /// Adds a message, or the block of messages to which it refers to `blocks`.
    fn add(
        &mut self,
        storage: &Storage<'_>,
        kind: u16,
        flags: u8,
        content: &[u8],
        blocks: &mut Vec<(u64, u64)>,
    ) -> Result<(), Fault> {
        if kind != CONTINUATION {
            self.messages.push(Message {
                kind,
                flags,
                content: content.to_vec(),
            });
            return Ok(());
        }
        let mut cursor = storage.cursor(content, "a continuation of an object");
        if let Some(address) = cursor.address()? {
            blocks.push((address, cursor.length()?));
        }
        match blocks.len() > BLOCKS_MAX {
            true => Err(Fault::Value {
                part: "the number of blocks of an object",
                value: blocks.len() as u64,
            }),
            false => Ok(()),
        }
    }
}
