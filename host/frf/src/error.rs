//! Errors of FRF tables and of FRF measurements.

use std::path::PathBuf;

use quietcut_recording::RecordingError;
use quietcut_recording::file::FileError;

/// Error of reading an FRF table or of measuring FRFs; every message names the file.
#[derive(Debug, thiserror::Error)]
pub enum FrfError {
    /// The file does not exist, or cannot be read or written.
    #[error(transparent)]
    File(#[from] FileError),
    /// A recording that cannot be read or lacks a required channel.
    #[error(transparent)]
    Recording(RecordingError),
    /// A line of the file is malformed.
    #[error("{}, line {line}: {what}", path.display())]
    Line {
        /// The file.
        path: PathBuf,
        /// Number of the line, from 1.
        line: u64,
        /// The fault, and the expected content.
        what: String,
    },
    /// A column of the file has an unknown name or unit.
    #[error("{}, column \"{column}\": {what}", path.display())]
    Column {
        /// The file.
        path: PathBuf,
        /// The header of the column.
        column: String,
        /// The fault, and the expected content.
        what: String,
    },
    /// The content of the file or the given values are not a valid table.
    #[error("{}: {what}", path.display())]
    Content {
        /// The file, or the origin of the values.
        path: PathBuf,
        /// The fault, and the expected content.
        what: String,
    },
}
