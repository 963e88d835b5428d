//! Reader of MAT-files of levels 5 and 7.3: numbers, text, structures and cells.
//!
//! The longer dimension of a matrix is time: the columns of an N × 3 matrix are channels, and the rows of a 3 × N
//! matrix. The columns of a square matrix are channels. [`records`] finds the records in the variables, whichever level
//! the file has.
//!
//! Objects, logical and sparse arrays, arrays of more than two dimensions, and in level 7.3 complex ones are skipped.
//!
//! The length of the file bounds the allocated memory, whatever sizes its headers state; 64 MiB of values are allowed
//! for any file.

mod level_5;
mod level_7_3;
mod memory;
mod records;
mod source;
mod value;

use std::fs::File;
use std::io::BufReader;
use std::path::Path;

use super::RecordingError;
use super::raw::Raw;
use crate::file::FileError;
use crate::hdf5::{Bytes, Hdf5};
use memory::ValueMemory;
use source::CHUNK;
use value::Item;

/// Reads the records of a MAT-file; [`records`] states what is a record.
pub(super) fn read(path: &Path) -> Result<Vec<Raw>, RecordingError> {
    let unreadable = |cause| FileError::Read {
        path: path.into(),
        cause,
    };
    let mut file = File::open(path).map_err(unreadable)?;
    let length = file.metadata().map_err(unreadable)?.len();
    let found = items(&mut file, length).and_then(records::records);
    found.map_err(|what| RecordingError::Content {
        path: path.into(),
        what,
    })
}

/// Reads the variables of a MAT-file of `length` bytes, except those that are skipped.
fn items(file: &mut dyn Bytes, length: u64) -> Result<Vec<Item>, String> {
    let mut memory = ValueMemory::new(length);
    if let Some(mut hdf5) = Hdf5::open(file, length).map_err(|fault| fault.to_string())? {
        return level_7_3::items(&mut hdf5, &mut memory);
    }
    file.rewind().map_err(|error| error.to_string())?;
    level_5::items(&mut BufReader::with_capacity(CHUNK, file), length, &mut memory)
}

#[cfg(test)]
mod level_7_3_tests;
#[cfg(test)]
mod tests;
