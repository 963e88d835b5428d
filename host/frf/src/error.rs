//! Errors of FRF tables and of FRF measurements.

use std::path::PathBuf;

use quietcut_recording::RecordingError;
use quietcut_recording::file::FileError;

/// Error of reading or writing an FRF table, or of measuring FRFs; every message names the file or the origin.
#[derive(Debug, thiserror::Error)]
pub enum FrfError {
    /// The file of an FRF table or a recording does not exist, or cannot be read or written.
    #[error(transparent)]
    File(#[from] FileError),
    /// A recording does not have the channels that the measurement needs.
    #[error(transparent)]
    Recording(RecordingError),
    /// A line of a text file, or a data set of a UFF file, is malformed.
    #[error("{}, line {line}: {what}", path.display())]
    Line {
        /// The file.
        path: PathBuf,
        /// Number of the malformed line, or of the first line of the malformed data set, in the file, from 1.
        line: u64,
        /// Description of the fault in the line, and the content expected there.
        what: String,
    },
    /// A column of an FRF table in a text file has an unknown name, or a unit that is unknown or does not fit.
    #[error("{}, column \"{column}\": {what}", path.display())]
    Column {
        /// The file.
        path: PathBuf,
        /// The header of the column.
        column: String,
        /// Description of the fault in the name or unit of the column, and the name or unit expected there.
        what: String,
    },
    /// The values are not a valid table, or the content of the files does not allow the requested evaluation.
    #[error("{}: {what}", path.display())]
    Content {
        /// Path of the file with the fault, or a name for the origin of values that are not from a file.
        path: PathBuf,
        /// Description of the fault.
        what: String,
    },
}
