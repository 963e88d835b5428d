//! B-trees of version 1: the members of a group, and the chunks of a dataset.

use super::cursor::Cursor;
use super::fault::Fault;
use super::storage::Storage;

/// Content of a tree.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Kind {
    /// Symbol tables of a group.
    Group,
    /// Chunks of a dataset of this number of dimensions.
    Chunks(usize),
}

impl Kind {
    fn code(self) -> u8 {
        match self {
            Self::Group => 0,
            Self::Chunks(_) => 1,
        }
    }

    /// Length of a key, bytes: the offset of a name; or the size of a chunk, its omitted filters, and its place in each
    /// dimension and within a value.
    fn key_length(self, storage: &Storage<'_>) -> usize {
        match self {
            Self::Group => storage.length_size,
            Self::Chunks(dimensions) => 4 + 4 + 8 * (dimensions + 1),
        }
    }
}

/// Passes the key and the address of each leaf of the tree at `address` to `take`.
pub(super) fn leaves(
    storage: &mut Storage<'_>,
    address: u64,
    kind: Kind,
    take: &mut dyn FnMut(Cursor<'_>, u64) -> Result<(), Fault>,
) -> Result<(), Fault> {
    // Nodes that are still to be read, each with its level if it is known.
    let mut nodes: Vec<(u64, Option<u8>)> = vec![(address, None)];
    while let Some((address, expected)) = nodes.pop() {
        let head_length = 8 + 2 * storage.address_size;
        let head = storage.marked(address, head_length as u64, "TREE")?;
        let mut cursor = storage.cursor(&head[4..], "a node of a tree");
        let (code, level, count) = (cursor.byte()?, cursor.byte()?, cursor.short()?);
        if code != kind.code() {
            return Err(Fault::Value {
                part: "the kind of a tree",
                value: u64::from(code),
            });
        }
        // Levels descend by one, so that a damaged tree ends.
        if expected.is_some_and(|expected| expected != level) {
            return Err(Fault::Value {
                part: "the level of a node of a tree",
                value: u64::from(level),
            });
        }
        let key_length = kind.key_length(storage);
        let entry_length = key_length + storage.address_size;
        let entries = storage.header(
            address.saturating_add(head_length as u64),
            (count * entry_length) as u64,
        )?;
        let mut below = Vec::new();
        for entry in entries.chunks_exact(entry_length) {
            let (key, child) = entry.split_at(key_length);
            let Some(child) = storage.cursor(child, "a node of a tree").address()? else {
                continue;
            };
            match level.checked_sub(1) {
                None => take(storage.cursor(key, "a key of a tree"), child)?,
                Some(level) => below.push((child, Some(level))),
            }
        }
        nodes.extend(below.into_iter().rev());
    }
    Ok(())
}
