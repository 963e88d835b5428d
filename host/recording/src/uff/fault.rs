//! Errors within a UFF file.

use std::path::Path;

use super::source::SourceError;
use crate::RecordingError;
use crate::file::FileError;

/// Error within a UFF file, before its path is added: a read error, or a fault in one line.
#[derive(Debug)]
pub(super) enum Fault {
    Io(std::io::Error),
    Line { line: u64, what: String },
}

/// A fault in line `line`; `what` describes the fault and the expected content.
pub(super) fn fault(line: u64, what: String) -> Fault {
    Fault::Line { line, what }
}

impl From<SourceError> for Fault {
    fn from(error: SourceError) -> Self {
        match error {
            SourceError::Io(error) => Self::Io(error),
            SourceError::Ends { found } => Self::Io(std::io::Error::new(
                std::io::ErrorKind::UnexpectedEof,
                format!("the file ends {found} bytes after the last line"),
            )),
        }
    }
}

impl Fault {
    /// Converts the error in a UFF file into one that names the path of the file.
    pub(super) fn of_file(self, path: &Path) -> RecordingError {
        match self {
            Self::Io(cause) => RecordingError::File(FileError::Read {
                path: path.into(),
                cause,
            }),
            Self::Line { line, what } => RecordingError::Line {
                path: path.into(),
                line,
                what,
            },
        }
    }
}
