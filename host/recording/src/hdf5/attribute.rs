//! Attributes of an object of an HDF5 file.

use super::cursor::Cursor;
use super::datatype::{self, Datatype, Type};
use super::fault::Fault;
use super::file::Hdf5;
use super::object::Object;
use super::storage::Storage;

/// Kinds of messages: an attribute, and the information about attributes that stand in a heap.
const ATTRIBUTE: u16 = 0xc;
const ATTRIBUTE_INFO: u16 = 0x15;

/// An attribute with its values as bytes.
struct Attribute<'a> {
    name: &'a [u8],
    value_type: Type,
    dimensions: Vec<u64>,
    values: &'a [u8],
}

impl<'a> Attribute<'a> {
    /// Reads an attribute; `None` if its type or dimensions stand in another place of the file.
    fn read(storage: &Storage<'_>, message: &'a [u8]) -> Result<Option<Self>, Fault> {
        let mut cursor = storage.cursor(message, "an attribute");
        let (version, flags) = (cursor.byte()?, cursor.byte()?);
        let lengths = [cursor.short()?, cursor.short()?, cursor.short()?];
        match version {
            1 => {}
            2 | 3 if flags & 3 != 0 => return Ok(None),
            2 => {}
            3 => cursor.skip(1)?,
            _ => {
                return Err(Fault::Value {
                    part: "the version of an attribute",
                    value: u64::from(version),
                });
            }
        }
        let mut part = |length: usize| -> Result<&'a [u8], Fault> {
            let start = cursor.at;
            let bytes = cursor.take(length)?;
            if version == 1 {
                cursor.pad(start, 8)?;
            }
            Ok(bytes)
        };
        let (name, value_type, dimensions) = (part(lengths[0])?, part(lengths[1])?, part(lengths[2])?);
        let end = name.iter().position(|&byte| byte == 0).unwrap_or(name.len());
        Ok(Some(Self {
            name: &name[..end],
            value_type: Type::read(storage.cursor(value_type, "the type of an attribute"))?,
            dimensions: datatype::dimensions(storage.cursor(dimensions, "the dimensions of an attribute"))?,
            values: cursor.rest(),
        }))
    }
}

impl Hdf5<'_> {
    /// The attribute of an object with this name.
    fn attribute<'o>(&self, object: &'o Object, name: &str) -> Result<Option<Attribute<'o>>, Fault> {
        if let Some(info) = object.message(ATTRIBUTE_INFO)? {
            let cursor = self.storage.cursor(info, "the information about attributes");
            cursor.refuse_heap(
                2,
                "an object with more than 8 attributes in the form of HDF5 1.8 and later",
            )?;
        }
        for message in object.messages(ATTRIBUTE) {
            if let Some(found) = Attribute::read(&self.storage, message?)?
                && found.name == name.as_bytes()
            {
                return Ok(Some(found));
            }
        }
        Ok(None)
    }

    /// True if the object has an attribute with this name and any value but 0.
    pub(crate) fn has_attribute(&self, object: &Object, name: &str) -> Result<bool, Fault> {
        let found = self.attribute(object, name)?;
        Ok(found.is_some_and(|found| found.values.iter().any(|&byte| byte != 0)))
    }

    /// Text of an attribute; `None` if the object has no attribute with this name that is a text.
    pub(crate) fn text_attribute(&mut self, object: &Object, name: &str) -> Result<Option<String>, Fault> {
        let Some(found) = self.attribute(object, name)? else {
            return Ok(None);
        };
        let bytes = match found.value_type.datatype {
            Datatype::Text => found.values.get(..found.value_type.size).map(<[u8]>::to_vec),
            Datatype::List => {
                let cursor = self.storage.cursor(found.values, "an attribute");
                Some(list(&mut self.storage, cursor, 1)?.concat())
            }
            _ => None,
        };
        Ok(bytes.map(|bytes| text(&bytes)))
    }

    /// Texts of an attribute that is a list of lists of letters; `None` if the object has no such attribute.
    pub(crate) fn texts_attribute(
        &mut self,
        object: &Object,
        name: &str,
    ) -> Result<Option<Vec<String>>, Fault> {
        match self.attribute(object, name)? {
            Some(found) if found.value_type.datatype == Datatype::List => {
                let cursor = self.storage.cursor(found.values, "an attribute");
                let lists = list(&mut self.storage, cursor, datatype::count(&found.dimensions))?;
                Ok(Some(lists.iter().map(|bytes| text(bytes)).collect()))
            }
            _ => Ok(None),
        }
    }
}

/// The text in bytes that a zero ends.
fn text(bytes: &[u8]) -> String {
    let end = bytes.iter().position(|&byte| byte == 0).unwrap_or(bytes.len());
    String::from_utf8_lossy(&bytes[..end]).into_owned()
}

/// The next `count` lists of bytes, which stand in global heaps.
fn list(storage: &mut Storage<'_>, mut cursor: Cursor<'_>, count: u64) -> Result<Vec<Vec<u8>>, Fault> {
    // The lists of one attribute stand in one heap, as a rule: it is read once.
    let mut heap: Option<(u64, Vec<u8>)> = None;
    let mut lists = Vec::new();
    for _ in 0..count {
        let length = cursor.unsigned(4)? as usize;
        let address = cursor.address()?.filter(|_| length > 0);
        let index = cursor.unsigned(4)?;
        let Some(address) = address else {
            lists.push(Vec::new());
            continue;
        };
        let bytes = match heap.take() {
            Some((known, bytes)) if known == address => bytes,
            _ => global_heap(storage, address)?,
        };
        let found = heap_object(storage, &bytes, index)?;
        lists.push(
            found
                .get(..length)
                .ok_or(Fault::Short {
                    part: "a list in a heap",
                })?
                .to_vec(),
        );
        heap = Some((address, bytes));
    }
    Ok(lists)
}

/// The bytes of the global heap at an address.
fn global_heap(storage: &mut Storage<'_>, address: u64) -> Result<Vec<u8>, Fault> {
    let length = 8 + storage.length_size;
    let head = storage.marked(address, length as u64, "GCOL")?;
    let length = storage.cursor(&head[8..], "a global heap").length()?;
    storage.header(address, length)
}

/// The object with number `index` of a global heap.
fn heap_object<'b>(storage: &Storage<'_>, heap: &'b [u8], index: u64) -> Result<&'b [u8], Fault> {
    let mut cursor = storage.cursor(heap, "a global heap");
    cursor.skip(8 + storage.length_size)?;
    loop {
        let found = cursor.short()? as u64;
        cursor.skip(6)?;
        let length = cursor.length()?;
        // Number 0 is the free rest of the heap.
        if found == 0 {
            return Err(Fault::Value {
                part: "the number of an object in a global heap",
                value: index,
            });
        }
        let start = cursor.at;
        let content = cursor.take(usize::try_from(length).unwrap_or(usize::MAX))?;
        if found == index {
            return Ok(content);
        }
        cursor.pad(start, 8)?;
    }
}
