//! Values of a dataset of an HDF5 file.

use super::datatype::{self, Datatype, Type};
use super::fault::Fault;
use super::file::Hdf5;
use super::filters::Filters;
use super::object::Object;
use super::storage::Storage;
use super::tree::{self, Kind};

/// Kinds of messages of a dataset.
const DIMENSIONS: u16 = 0x1;
const DATATYPE: u16 = 0x3;
const LAYOUT: u16 = 0x8;
const FILTERS: u16 = 0xb;

/// Bytes of a dataset that are read at once; a choice. A multiple of the size of every number.
const BLOCK: u64 = 1 << 16;

/// A dataset: type, dimensions and place of its values.
#[derive(Debug)]
pub(crate) struct Dataset {
    pub(crate) value_type: Type,
    /// Dimensions of the dataset, the slowest first: those of a MATLAB matrix in reverse order.
    pub(crate) dimensions: Vec<u64>,
    layout: Layout,
    filters: Filters,
}

/// Place of the values of a dataset.
#[derive(Debug)]
enum Layout {
    /// In the header.
    Compact(Vec<u8>),
    /// In one block at this address; `None` if no value was written.
    Contiguous(Option<u64>),
    /// In chunks of these dimensions, at the leaves of the tree at this address; `None` if no value was written.
    Chunked { tree: Option<u64>, chunk: Vec<u64> },
}

impl Dataset {
    /// Reads what the header of a dataset states.
    fn read(storage: &Storage<'_>, object: &Object) -> Result<Self, Fault> {
        let part = |kind, part| object.message(kind)?.ok_or(Fault::Short { part });
        let value_type =
            Type::read(storage.cursor(part(DATATYPE, "a dataset without type")?, "the type of a dataset"))?;
        let dimensions = part(DIMENSIONS, "a dataset without dimensions")?;
        let dimensions = datatype::dimensions(storage.cursor(dimensions, "the dimensions of a dataset"))?;
        let layout = Layout::read(
            storage,
            part(LAYOUT, "a dataset without layout")?,
            dimensions.len(),
        )?;
        let filters = object.message(FILTERS)?;
        let filters = filters.map_or(Ok(Filters::default()), |message| Filters::read(storage, message))?;
        Ok(Self {
            value_type,
            dimensions,
            layout,
            filters,
        })
    }

    /// Number of values; the largest integer if it exceeds every file.
    pub(crate) fn count(&self) -> u64 {
        datatype::count(&self.dimensions)
    }

    /// Number of values for which memory and time are needed to read the dataset: those of whole chunks.
    pub(crate) fn stored_count(&self) -> u64 {
        match &self.layout {
            Layout::Chunked { chunk, .. } => self.chunks(chunk).saturating_mul(datatype::count(chunk)),
            _ => self.count(),
        }
    }

    /// Number of chunks of the dataset.
    fn chunks(&self, chunk: &[u64]) -> u64 {
        let along: Vec<u64> = self
            .dimensions
            .iter()
            .zip(chunk)
            .map(|(&length, &chunk)| length.div_ceil(chunk.max(1)))
            .collect();
        datatype::count(&along)
    }
}

impl Layout {
    /// Reads the layout of a dataset with `rank` dimensions.
    fn read(storage: &Storage<'_>, message: &[u8], rank: usize) -> Result<Self, Fault> {
        let mut cursor = storage.cursor(message, "the layout of a dataset");
        let version = cursor.byte()?;
        // Versions 1 and 2 have the number of dimensions before the class, for chunks one more than that of the dataset.
        let mut lengths = match version {
            1 | 2 => Some(usize::from(cursor.byte()?)),
            _ => None,
        };
        let class = cursor.byte()?;
        if lengths.is_some() {
            cursor.skip(5)?;
        }
        match (version, class) {
            (1..=4, 0) => {
                let length = match lengths {
                    Some(lengths) => {
                        cursor.skip(4 * lengths)?;
                        cursor.unsigned(4)? as usize
                    }
                    None => cursor.short()?,
                };
                Ok(Self::Compact(cursor.take(length)?.to_vec()))
            }
            (1..=4, 1) => Ok(Self::Contiguous(cursor.address()?)),
            (1..=3, 2) => {
                if version == 3 {
                    lengths = Some(usize::from(cursor.byte()?));
                }
                let tree = cursor.address()?;
                if lengths != Some(rank + 1) {
                    return Err(Fault::Value {
                        part: "the number of dimensions of chunks",
                        value: lengths.unwrap_or_default() as u64,
                    });
                }
                let chunk: Result<Vec<u64>, Fault> = (0..rank).map(|_| cursor.unsigned(4)).collect();
                let chunk = chunk?;
                match chunk.contains(&0) {
                    true => Err(Fault::Value {
                        part: "the length of a chunk",
                        value: 0,
                    }),
                    false => Ok(Self::Chunked { tree, chunk }),
                }
            }
            _ => Err(Fault::Unsupported {
                what: format!(
                    "the storage layout {version}.{class} of HDF5, which its version 1.10 introduced"
                ),
            }),
        }
    }
}

/// Values of a dataset as they stand in the file: each of them was written, and lies within the file.
pub(crate) struct Stored<'d> {
    dataset: &'d Dataset,
    place: Place<'d>,
}

/// Place of values that were written.
enum Place<'d> {
    Header(&'d [u8]),
    Block(u64),
    Chunks { chunks: Vec<Chunk>, lengths: [u64; 2] },
}

/// One chunk of a dataset of one or two dimensions. A dataset of one dimension is one row.
struct Chunk {
    /// Row and column of the first value.
    first: [u64; 2],
    address: u64,
    /// Bytes in the file.
    stored: u64,
    /// Filters that were left out: bit 0 is the first.
    omitted: u64,
}

impl Hdf5<'_> {
    /// Type, dimensions and place of the values of a dataset.
    pub(crate) fn dataset(&self, object: &Object) -> Result<Dataset, Fault> {
        Dataset::read(&self.storage, object)
    }

    /// Finds the values of a dataset. The caller bounds [`Dataset::stored_count`] before.
    ///
    /// # Errors
    /// Values were never written or lie beyond the end of the file; compressed values are fewer bytes than deflate can
    /// give; values in chunks have more than two dimensions.
    pub(crate) fn stored<'d>(&mut self, dataset: &'d Dataset) -> Result<Stored<'d>, Fault> {
        let length = dataset.count().saturating_mul(dataset.value_type.size as u64);
        let place = match &dataset.layout {
            _ if length == 0 => Place::Header(&[]),
            Layout::Compact(bytes) => match bytes.get(..usize::try_from(length).unwrap_or(usize::MAX)) {
                Some(bytes) => Place::Header(bytes),
                None => return Err(Fault::Short { part: "a dataset" }),
            },
            Layout::Contiguous(Some(address)) => {
                self.storage.offset(*address, length)?;
                Place::Block(*address)
            }
            Layout::Chunked {
                tree: Some(tree),
                chunk,
            } => self.chunks(dataset, *tree, chunk)?,
            Layout::Contiguous(None) | Layout::Chunked { tree: None, .. } => {
                return Err(Fault::Unwritten {
                    found: 0,
                    expected: dataset.count(),
                    what: "values",
                });
            }
        };
        Ok(Stored { dataset, place })
    }

    /// Finds the chunks of a dataset: all chunks of its grid in ascending order, row after row.
    fn chunks<'d>(&mut self, dataset: &Dataset, tree: u64, chunk: &[u64]) -> Result<Place<'d>, Fault> {
        let (Some(whole), Some(lengths)) = (pair(&dataset.dimensions), pair(chunk)) else {
            return Err(Fault::Unsupported {
                what: "a dataset in chunks with more than two dimensions".into(),
            });
        };
        let rank = chunk.len();
        let length = datatype::count(chunk).saturating_mul(dataset.value_type.size as u64);
        let mut chunks: Vec<Chunk> = Vec::new();
        tree::leaves(
            &mut self.storage,
            tree,
            Kind::Chunks(rank),
            &mut |mut key, address| {
                let (stored, omitted) = (key.unsigned(4)?, key.unsigned(4)?);
                let first: Result<Vec<u64>, Fault> = (0..rank).map(|_| key.unsigned(8)).collect();
                let first = match *first?.as_slice() {
                    [row, column] => [row, column],
                    [column] => [0, column],
                    _ => [0, 0],
                };
                // Ascending places on the grid, as many as it has, are all of its places.
                let ascends = chunks.last().is_none_or(|last| last.first < first);
                let is_on_grid = (0..2).all(|k| first[k] % lengths[k] == 0 && first[k] < whole[k]);
                if !ascends || !is_on_grid {
                    return Err(Fault::Value {
                        part: "the place of a chunk",
                        value: first[0],
                    });
                }
                if !dataset.filters.is_possible(stored, length) {
                    return Err(Fault::Value {
                        part: "the length of a stored chunk",
                        value: stored,
                    });
                }
                chunks.push(Chunk {
                    first,
                    address,
                    stored,
                    omitted,
                });
                Ok(())
            },
        )?;
        let expected = dataset.chunks(chunk);
        match chunks.len() as u64 == expected {
            true => Ok(Place::Chunks { chunks, lengths }),
            false => Err(Fault::Unwritten {
                found: chunks.len() as u64,
                expected,
                what: "chunks",
            }),
        }
    }

    /// Passes each number of a dataset to `take`, with its index in the order of the dimensions, of which the last runs
    /// fastest. Numbers come in the order of the file.
    ///
    /// # Errors
    /// The dataset has no numbers, or a chunk is damaged.
    pub(crate) fn numbers(
        &mut self,
        stored: &Stored<'_>,
        mut take: impl FnMut(u64, f64),
    ) -> Result<(), Fault> {
        let Datatype::Number {
            number,
            is_big_endian,
        } = stored.dataset.value_type.datatype
        else {
            return Err(Fault::Unsupported {
                what: "a dataset that holds no numbers".into(),
            });
        };
        self.blocks(stored, &mut |first, bytes| {
            let mut index = first;
            number.decode(bytes, is_big_endian, |value| {
                take(index, value);
                index += 1;
            });
        })
    }

    /// Addresses of the objects to which a dataset refers, in its order; `None` for a reference to none.
    ///
    /// # Errors
    /// The dataset has no references to objects, or a chunk is damaged.
    pub(crate) fn references(&mut self, stored: &Stored<'_>) -> Result<Vec<Option<u64>>, Fault> {
        let Type { datatype, size } = stored.dataset.value_type;
        if datatype != Datatype::Reference || size != self.storage.address_size {
            return Err(Fault::Unsupported {
                what: "a reference of another kind than to an object".into(),
            });
        }
        let mut found = vec![None; usize::try_from(stored.dataset.count()).unwrap_or(usize::MAX)];
        self.blocks(stored, &mut |first, bytes| {
            for (offset, bytes) in bytes.chunks_exact(size).enumerate() {
                let address = bytes
                    .iter()
                    .rev()
                    .fold(0, |value, &byte| value << 8 | u64::from(byte));
                if let Some(place) = found.get_mut(first as usize + offset) {
                    *place = (address != 0).then_some(address);
                }
            }
        })?;
        Ok(found)
    }

    /// Passes the bytes of a dataset in blocks of adjacent values to `take`, each with the index of its first value.
    fn blocks(&mut self, stored: &Stored<'_>, take: &mut dyn FnMut(u64, &[u8])) -> Result<(), Fault> {
        let dataset = stored.dataset;
        let size = dataset.value_type.size as u64;
        match &stored.place {
            Place::Header(bytes) => take(0, bytes),
            Place::Block(address) => {
                let length = dataset.count() * size;
                let block = (BLOCK / size).max(1) * size;
                let mut at = 0;
                while at < length {
                    let bytes = self.storage.data(address + at, block.min(length - at))?;
                    take(at / size, &bytes);
                    at += block;
                }
            }
            Place::Chunks { chunks, lengths } => {
                let whole = pair(&dataset.dimensions).unwrap_or_default();
                for chunk in chunks {
                    let bytes = self.chunk(dataset, chunk, lengths[0] * lengths[1] * size)?;
                    let [row, column] = chunk.first;
                    // Values beyond the dimensions of the dataset fill the last chunks up.
                    let within = (lengths[1].min(whole[1] - column) * size) as usize;
                    let lines = bytes.chunks_exact((lengths[1] * size) as usize);
                    for (line, row) in lines.zip(row..whole[0]) {
                        take(row * whole[1] + column, &line[..within]);
                    }
                }
            }
        }
        Ok(())
    }

    /// The bytes of one chunk, `length` of them.
    fn chunk(&mut self, dataset: &Dataset, chunk: &Chunk, length: u64) -> Result<Vec<u8>, Fault> {
        let bytes = self.storage.data(chunk.address, chunk.stored)?;
        let size = dataset.value_type.size;
        let undone = dataset.filters.undo(bytes, chunk.omitted, length as usize, size);
        undone.map_err(|what| Fault::Filter {
            at: self.storage.at(chunk.address),
            what,
        })
    }
}

/// Numbers of rows and columns of one or two dimensions: one dimension is one row. `None` for none or more.
fn pair(values: &[u64]) -> Option<[u64; 2]> {
    match *values {
        [columns] => Some([1, columns]),
        [rows, columns] => Some([rows, columns]),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use std::io::Cursor;

    use super::*;

    fn layout(message: &[u8], rank: usize) -> Result<Layout, Fault> {
        let mut file = Cursor::new(Vec::new());
        Layout::read(&Storage::new(&mut file, 0, 0), message, rank)
    }

    /// Messages by the tables of the specification. MATLAB 7.4 writes version 2.
    #[test]
    fn layouts_of_each_version_are_read() {
        let address = 0x0201_u64.to_le_bytes();
        let [two, three, four, eight] = [2_u32, 3, 4, 8].map(u32::to_le_bytes);
        for version in [1, 2] {
            let head = |class| vec![version, 3, class, 0, 0, 0, 0, 0];
            let contiguous = [&head(1)[..], &address, &three, &four, &eight].concat();
            assert!(matches!(
                layout(&contiguous, 2),
                Ok(Layout::Contiguous(Some(0x0201)))
            ));
            let chunked = [&head(2)[..], &address, &three, &four, &eight].concat();
            assert!(
                matches!(layout(&chunked, 2), Ok(Layout::Chunked { tree: Some(0x0201), chunk }) if chunk == [3, 4])
            );
            let compact = [&head(0)[..], &three, &four, &eight, &two, &[7, 9]].concat();
            assert!(matches!(layout(&compact, 2), Ok(Layout::Compact(bytes)) if bytes == [7, 9]));
        }
        let contiguous = [&[3, 1][..], &[0xff; 8]].concat();
        assert!(matches!(layout(&contiguous, 2), Ok(Layout::Contiguous(None))));
        let chunked = [&[3, 2, 3][..], &address, &three, &four, &eight].concat();
        assert!(matches!(layout(&chunked, 2), Ok(Layout::Chunked { chunk, .. }) if chunk == [3, 4]));
        assert!(
            layout(&chunked, 3)
                .is_err_and(|fault| fault.to_string().contains("number of dimensions of chunks is 3"))
        );
        assert!(matches!(layout(&[3, 0, 2, 0, 7, 9], 1), Ok(Layout::Compact(bytes)) if bytes == [7, 9]));
        assert!(layout(&[4, 2], 1).is_err_and(|fault| fault.to_string().contains("4.2")));
    }
}
