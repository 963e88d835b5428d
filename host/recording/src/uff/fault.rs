//! What is wrong with a file.

use std::path::Path;

use super::source::SourceError;
use crate::RecordingError;
use crate::file::FileError;

/// What is wrong with a file.
#[derive(Debug)]
pub(super) enum Fault {
    Io(std::io::Error),
    Line { line: u64, what: String },
}

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
