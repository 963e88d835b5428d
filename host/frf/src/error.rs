//! What can be wrong with a table of frequency response functions.

use std::path::PathBuf;

use quietcut_recording::RecordingError;
use quietcut_recording::file::FileError;

/// Why a table of frequency response functions cannot be read, or is none.
#[derive(Debug, thiserror::Error)]
pub enum FrfError {
    /// The file is not there or cannot be read or written.
    #[error(transparent)]
    File(#[from] FileError),
    /// A recording is wrong, or does not have what is asked of it.
    #[error(transparent)]
    Recording(RecordingError),
    /// A line of the file is wrong.
    #[error("{}, line {line}: {what}", path.display())]
    Line {
        /// The file.
        path: PathBuf,
        /// The line, from 1.
        line: u64,
        /// What was found, and what would be right.
        what: String,
    },
    /// A column of the file is wrong.
    #[error("{}, column \"{column}\": {what}", path.display())]
    Column {
        /// The file.
        path: PathBuf,
        /// The header of the column.
        column: String,
        /// What was found, and what would be right.
        what: String,
    },
    /// The file or the values do not make a table.
    #[error("{}: {what}", path.display())]
    Content {
        /// The file, or where the values came from.
        path: PathBuf,
        /// What was found, and what would be right.
        what: String,
    },
}
