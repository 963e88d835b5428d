//! Members of groups of an HDF5 file.

use super::fault::Fault;
use super::object::Object;
use super::storage::Storage;
use super::tree::{self, Kind};

/// Kinds of messages of a group: symbol table, links in a heap, one link.
const SYMBOL_TABLE: u16 = 0x11;
const LINK_INFO: u16 = 0x2;
const LINK: u16 = 0x6;

/// Name of a member of a group, and the address of its object header.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Link {
    pub(crate) name: String,
    pub(crate) address: u64,
}

impl Object {
    /// True if the object is a group.
    pub(crate) fn is_group(&self) -> Result<bool, Fault> {
        for kind in [SYMBOL_TABLE, LINK_INFO, LINK] {
            if self.message(kind)?.is_some() {
                return Ok(true);
            }
        }
        Ok(false)
    }
}

/// Members of group `object` in the order of the file, without those that are links to names or to other files.
pub(super) fn links(storage: &mut Storage<'_>, object: &Object) -> Result<Vec<Link>, Fault> {
    if let Some(table) = object.message(SYMBOL_TABLE)? {
        let mut cursor = storage.cursor(table, "a symbol table");
        let (tree, heap) = (cursor.address()?, cursor.address()?);
        return match (tree, heap) {
            (Some(tree), Some(heap)) => symbols(storage, tree, heap),
            _ => Ok(Vec::new()),
        };
    }
    if let Some(info) = object.message(LINK_INFO)? {
        let cursor = storage.cursor(info, "the information about links");
        cursor.refuse_heap(
            8,
            "a group with more than 8 members in the form of HDF5 1.8 and later",
        )?;
    }
    let mut links = Vec::new();
    for message in object.messages(LINK) {
        links.extend(link(storage, message?)?);
    }
    Ok(links)
}

/// The link in a message; `None` if it is a link to a name or to another file.
fn link(storage: &Storage<'_>, message: &[u8]) -> Result<Option<Link>, Fault> {
    let mut cursor = storage.cursor(message, "a link");
    cursor.skip(1)?;
    let flags = cursor.byte()?;
    let kind = if flags & 8 != 0 { cursor.byte()? } else { 0 };
    if flags & 4 != 0 {
        cursor.skip(8)?;
    }
    if flags & 0x10 != 0 {
        cursor.skip(1)?;
    }
    let length = cursor.unsigned(1 << (flags & 3))?;
    let name = cursor.take(usize::try_from(length).unwrap_or(usize::MAX))?;
    if kind != 0 {
        return Ok(None);
    }
    Ok(cursor.address()?.map(|address| Link {
        name: String::from_utf8_lossy(name).into_owned(),
        address,
    }))
}

/// Links of a symbol table with its tree and its heap of names.
fn symbols(storage: &mut Storage<'_>, tree: u64, heap: u64) -> Result<Vec<Link>, Fault> {
    let names = names(storage, heap)?;
    let mut tables = Vec::new();
    tree::leaves(storage, tree, Kind::Group, &mut |_, address| {
        tables.push(address);
        Ok(())
    })?;
    let entry_length = 2 * storage.address_size + 24;
    let mut links = Vec::new();
    for table in tables {
        let head = storage.marked(table, 8, "SNOD")?;
        let count = storage.cursor(&head[6..], "a symbol table").short()?;
        let entries = storage.header(table.saturating_add(8), (count * entry_length) as u64)?;
        for entry in entries.chunks_exact(entry_length) {
            let mut cursor = storage.cursor(entry, "an entry of a symbol table");
            // The name of a member is never at an undefined offset.
            let name = cursor.address()?.unwrap_or(u64::MAX);
            let Some(address) = cursor.address()? else {
                continue;
            };
            // Cache type 2 is a link to a name.
            if cursor.unsigned(4)? == 2 {
                continue;
            }
            let rest = usize::try_from(name).ok().and_then(|name| names.get(name..));
            let rest = rest.ok_or(Fault::Value {
                part: "the offset of the name of a member",
                value: name,
            })?;
            let end = rest.iter().position(|&byte| byte == 0).unwrap_or(rest.len());
            links.push(Link {
                name: String::from_utf8_lossy(&rest[..end]).into_owned(),
                address,
            });
        }
    }
    Ok(links)
}

/// The bytes of the local heap at an address, which holds the names of the members of a group.
fn names(storage: &mut Storage<'_>, address: u64) -> Result<Vec<u8>, Fault> {
    let length = 8 + 2 * storage.length_size + storage.address_size;
    let head = storage.marked(address, length as u64, "HEAP")?;
    let mut cursor = storage.cursor(&head, "a heap of names");
    cursor.skip(8)?;
    let length = cursor.length()?;
    let _free = cursor.length()?;
    match cursor.address()? {
        Some(address) => storage.header(address, length),
        None => Ok(Vec::new()),
    }
}
