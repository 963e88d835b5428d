//! Reader of MAT-files of level 7.3, which are HDF5 files.
//!
//! A variable is a member of the root group, and its attribute `MATLAB_class` states its class. A matrix is a dataset
//! with the dimensions in reverse order, so that its values follow one another as in level 5. A text is a dataset of
//! codes of letters, a cell array a dataset of references to objects, a structure a group with its fields, and a
//! structure array a group of datasets with a reference for each element. Source: MATLAB's files of level 7.3, and
//! `hdf5storage`, which writes the same; MathWorks publishes no description.

use super::memory::{DEPTH_MAX, ValueMemory};
use super::source::SMALL_MAX;
use super::value::{Channels, Item, Value, text_of_codes};
use crate::hdf5::{Dataset, Datatype, Fault, Hdf5, Link, Object};

/// Classes of real numbers.
const NUMBERS: &[&str] = &[
    "double", "single", "int8", "uint8", "int16", "uint16", "int32", "uint32", "int64", "uint64",
];

/// Attributes of values that are skipped: sparse matrices, objects and function handles, and empty arrays, whose
/// dataset holds their dimensions.
const SKIPPED: &[&str] = &["MATLAB_sparse", "MATLAB_object_decode", "MATLAB_empty"];

/// Reads the variables of a MAT-file of level 7.3, except those that are skipped. MATLAB's own groups begin with `#`.
pub(super) fn items(file: &mut Hdf5<'_>, memory: &mut ValueMemory) -> Result<Vec<Item>, String> {
    let links = file.root_links().map_err(|fault| fault.to_string())?;
    let mut reader = Reader { file, memory };
    let mut items = Vec::new();
    for Link { name, address } in links {
        if !name.starts_with('#') {
            items.extend(reader.value(&name, address, 0)?);
        }
    }
    Ok(items)
}

/// A file, and the memory that its values may still take.
struct Reader<'r, 'f> {
    file: &'r mut Hdf5<'f>,
    memory: &'r mut ValueMemory,
}

/// Message about a fault of variable `name`.
fn of(name: &str) -> impl Fn(Fault) -> String {
    move |fault| format!("variable \"{name}\": {fault}")
}

impl Reader<'_, '_> {
    /// The value of the object at an address, `depth` levels inside others; `None` unless it has two dimensions at most
    /// and holds real numbers that are not logical, a text of at most [`SMALL_MAX`] bytes, or a structure or cell less
    /// than [`DEPTH_MAX`] levels inside others.
    fn value(&mut self, name: &str, address: u64, depth: usize) -> Result<Option<Item>, String> {
        let object = self.file.object(address).map_err(of(name))?;
        for attribute in SKIPPED {
            if self.file.has_attribute(&object, attribute).map_err(of(name))? {
                return Ok(None);
            }
        }
        let class = self
            .file
            .text_attribute(&object, "MATLAB_class")
            .map_err(of(name))?;
        let class = class.as_deref();
        let value = if object.is_group().map_err(of(name))? {
            match class {
                None | Some("struct") if depth < DEPTH_MAX => self.structure(name, &object, depth)?,
                _ => None,
            }
        } else {
            let dataset = self.file.dataset(&object).map_err(of(name))?;
            match class {
                Some("cell") if depth < DEPTH_MAX => self.cells(name, &dataset, depth)?,
                Some("char") => self.text(name, &dataset)?,
                Some(class) if NUMBERS.contains(&class) => self.numbers(name, &dataset)?,
                None => self.numbers(name, &dataset)?,
                _ => None,
            }
        };
        Ok(value.map(|value| Item {
            name: name.into(),
            value,
        }))
    }

    /// The channels of a dataset of real numbers.
    fn numbers(&mut self, name: &str, dataset: &Dataset) -> Result<Option<Value>, String> {
        if !matches!(dataset.value_type.datatype, Datatype::Number { .. }) {
            return Ok(None);
        }
        let (columns, rows) = match *dataset.dimensions.as_slice() {
            [] => (1, 1),
            [length] => (1, length),
            [columns, rows] => (columns, rows),
            _ => return Ok(None),
        };
        self.memory.take(name, dataset.stored_count())?;
        // Memory is taken after the file was found to hold the values.
        let stored = self.file.stored(dataset).map_err(of(name))?;
        let mut channels = Channels::zeros(rows as usize, columns as usize);
        let read = self
            .file
            .numbers(&stored, |index, value| channels.set(index as usize, value));
        read.map_err(of(name))?;
        Ok(Some(Value::Numbers(channels.named(name.into()))))
    }

    /// The text of a dataset of codes of letters; `None` if it is too long.
    fn text(&mut self, name: &str, dataset: &Dataset) -> Result<Option<Value>, String> {
        let Datatype::Number { number, .. } = dataset.value_type.datatype else {
            return Ok(None);
        };
        let size = number.size() as u64;
        if dataset.dimensions.len() > 2 || dataset.stored_count() > SMALL_MAX / size {
            return Ok(None);
        }
        self.memory.take(name, dataset.stored_count())?;
        let stored = self.file.stored(dataset).map_err(of(name))?;
        let mut codes = vec![0; dataset.count() as usize];
        let read = self.file.numbers(&stored, |index, code| {
            if let Some(place) = codes.get_mut(index as usize) {
                *place = code as u32;
            }
        });
        read.map_err(of(name))?;
        Ok(Some(Value::Text(text_of_codes(&codes, size == 1))))
    }

    /// The addresses in a dataset of references of `name`; an error if they are more than the file may have.
    fn addresses(&mut self, name: &str, dataset: &Dataset) -> Result<Vec<Option<u64>>, String> {
        let count = usize::try_from(dataset.stored_count()).unwrap_or(usize::MAX);
        self.memory.take_elements(name, count)?;
        let stored = self.file.stored(dataset).map_err(of(name))?;
        self.file.references(&stored).map_err(of(name))
    }

    /// The elements of a cell array, each with one field without name.
    fn cells(&mut self, name: &str, dataset: &Dataset, depth: usize) -> Result<Option<Value>, String> {
        let mut elements = Vec::new();
        for address in self.addresses(name, dataset)? {
            let found = match address {
                Some(address) => self.value("", address, depth + 1)?,
                None => None,
            };
            elements.push(found.into_iter().collect());
        }
        Ok(Some(Value::Elements(elements)))
    }

    /// The elements of a structure, or of a structure array: then each field is a dataset without class, of references
    /// to its value in each element.
    fn structure(&mut self, name: &str, object: &Object, depth: usize) -> Result<Option<Value>, String> {
        let links = self.fields(name, object)?;
        let mut elements: Vec<Vec<Item>> = Vec::new();
        let mut single = Vec::new();
        for Link { name: field, address } in links {
            let Some(dataset) = self.array_field(&field, address)? else {
                self.memory.take_elements(name, 1)?;
                single.extend(self.value(&field, address, depth + 1)?);
                continue;
            };
            for (index, address) in self.addresses(&field, &dataset)?.into_iter().enumerate() {
                let found = match address {
                    Some(address) => self.value(&field, address, depth + 1)?,
                    None => None,
                };
                if elements.len() <= index {
                    elements.push(Vec::new());
                }
                elements[index].extend(found);
            }
        }
        if elements.is_empty() {
            elements.push(single);
        }
        Ok(Some(Value::Elements(elements)))
    }

    /// The dataset of a field of a structure array; `None` if the object at the address is a value itself.
    fn array_field(&mut self, field: &str, address: u64) -> Result<Option<Dataset>, String> {
        let object = self.file.object(address).map_err(of(field))?;
        let is_value = object.is_group().map_err(of(field))?
            || self
                .file
                .text_attribute(&object, "MATLAB_class")
                .map_err(of(field))?
                .is_some();
        if is_value {
            return Ok(None);
        }
        let dataset = self.file.dataset(&object).map_err(of(field))?;
        Ok((dataset.value_type.datatype == Datatype::Reference).then_some(dataset))
    }

    /// Fields of a structure in the order of its declaration, which `MATLAB_fields` states; HDF5 sorts them by name.
    fn fields(&mut self, name: &str, object: &Object) -> Result<Vec<Link>, String> {
        let mut links = self.file.links(object).map_err(of(name))?;
        let declared = self
            .file
            .texts_attribute(object, "MATLAB_fields")
            .map_err(of(name))?;
        let declared = declared.unwrap_or_default();
        let place = |link: &Link| {
            let place = declared.iter().position(|name| *name == link.name);
            place.unwrap_or(declared.len())
        };
        links.sort_by_cached_key(place);
        Ok(links)
    }
}
