//! An HDF5 file: its superblock, and access to its objects.

use super::fault::Fault;
use super::group::{self, Link};
use super::object::Object;
use super::storage::{Bytes, Storage};

/// First bytes of the superblock of an HDF5 file.
const MARK: &[u8] = b"\x89HDF\r\n\x1a\n";

/// Largest offset at which the superblock is sought, bytes; it stands at 0, 512, 1024, 2048 and so on, after a block of
/// the user. A choice: MATLAB takes 512.
const USER_BLOCK_MAX: u64 = 1 << 16;

/// An HDF5 file.
pub(crate) struct Hdf5<'a> {
    pub(super) storage: Storage<'a>,
    root: u64,
}

impl<'a> Hdf5<'a> {
    /// Opens a file of `length` bytes; `None` if it is no HDF5 file.
    pub(crate) fn open(reader: &'a mut dyn Bytes, length: u64) -> Result<Option<Self>, Fault> {
        let mut base = 0;
        loop {
            let mut storage = Storage::new(&mut *reader, length, base);
            if storage.header_up_to(0, MARK.len() as u64)? == MARK {
                break;
            }
            base = (base * 2).max(512);
            if base > USER_BLOCK_MAX || base >= length {
                return Ok(None);
            }
        }
        let mut storage = Storage::new(reader, length, base);
        let root = superblock(&mut storage)?;
        Ok(Some(Self { storage, root }))
    }

    /// The object at an address.
    pub(crate) fn object(&mut self, address: u64) -> Result<Object, Fault> {
        Object::read(&mut self.storage, address)
    }

    /// Members of the root group.
    pub(crate) fn root_links(&mut self) -> Result<Vec<Link>, Fault> {
        let root = self.object(self.root)?;
        self.links(&root)
    }

    /// Members of a group in the order of the file, without those that are links to names or to other files.
    pub(crate) fn links(&mut self, object: &Object) -> Result<Vec<Link>, Fault> {
        group::links(&mut self.storage, object)
    }
}

/// Reads the superblock; returns the address of the root group.
fn superblock(storage: &mut Storage<'_>) -> Result<u64, Fault> {
    /// Largest length of a superblock, bytes.
    const LENGTH_MAX: u64 = 128;
    let bytes = storage.header_up_to(0, LENGTH_MAX)?;
    let sizes = |storage: &mut Storage<'_>, address: u8, length: u8| {
        for size in [address, length] {
            if !matches!(size, 2 | 4 | 8) {
                return Err(Fault::Value {
                    part: "the size of an address or a length",
                    value: u64::from(size),
                });
            }
        }
        (storage.address_size, storage.length_size) = (usize::from(address), usize::from(length));
        Ok(())
    };
    let part = "the superblock";
    let mut cursor = storage.cursor(&bytes, part);
    cursor.skip(MARK.len())?;
    let version = cursor.byte()?;
    let root = match version {
        0 | 1 => {
            cursor.skip(4)?;
            sizes(storage, cursor.byte()?, cursor.byte()?)?;
            // Reserved byte, ranks of trees and flags, and in version 1 a rank and two reserved bytes.
            let rest = 9 + if version == 1 { 4 } else { 0 };
            let read = cursor.at;
            let mut cursor = storage.cursor(&bytes[read..], part);
            cursor.skip(rest)?;
            // Base, free space, end of file, driver, and the name of the root group.
            cursor.skip(5 * storage.address_size)?;
            cursor.address()?
        }
        2 | 3 => {
            sizes(storage, cursor.byte()?, cursor.byte()?)?;
            let read = cursor.at;
            let mut cursor = storage.cursor(&bytes[read..], part);
            // Flags, base, extension, end of file.
            cursor.skip(1 + 3 * storage.address_size)?;
            cursor.address()?
        }
        _ => {
            return Err(Fault::Unsupported {
                what: format!("version {version} of HDF5"),
            });
        }
    };
    root.ok_or(Fault::Short { part })
}
