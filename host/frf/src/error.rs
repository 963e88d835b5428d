//! Errors of FRF tables and of FRF measurements.

use std::path::PathBuf;

use quietcut_recording::RecordingError;
use quietcut_recording::file::FileError;

/// Error of reading, writing or evaluating an FRF table, or of measuring FRFs; every message names the file or the
/// origin.
#[derive(Debug, thiserror::Error)]
pub enum FrfError {
    /// A file cannot be read or written, or is not UTF-8 text.
    #[error(transparent)]
    File(#[from] FileError),
    /// A recording lacks a channel that the measurement needs; or the file of a table or its sidecar has a fault that
    /// neither `File` nor `Line` holds.
    #[error(transparent)]
    Recording(RecordingError),
    /// A fault in one line of a text file or in one data set of a UFF file.
    #[error("{}, line {line}: {what}", path.display())]
    Line {
        /// The file.
        path: PathBuf,
        /// Number of this line in the file, or of the line with the number 58 of the data set, from 1.
        line: u64,
        /// Description of the fault, in most cases with the content expected there.
        what: String,
    },
    /// A fault of the name or the unit of one column of an FRF table in a text file.
    #[error("{}, column \"{column}\": {what}", path.display())]
    Column {
        /// The file.
        path: PathBuf,
        /// Name of the column in the file.
        column: String,
        /// Description of the fault, in most cases with the name or unit expected there.
        what: String,
    },
    /// Any other fault: the values are no valid table, or recordings, tables or settings do not allow the evaluation.
    #[error("{}: {what}", path.display())]
    Content {
        /// Path of the file that the message is about, or a name for the origin of values that are not from a file.
        path: PathBuf,
        /// Description of the fault.
        what: String,
    },
}
