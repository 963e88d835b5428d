//! Errors of the verbs (subcommands) of `quietcut`, and the exit status of each.

use std::error::Error as StdError;
use std::io;

use crate::case::CaseError;
use crate::device::DeviceError;
use crate::file::FileError;
use crate::lobe_table::BuildError;
use crate::machine::FolderError;
use crate::monitor::web::WebError;
use crate::plan::PlanError;
use crate::recording::cut_table::CutTableError;
use crate::stability::StabilityError;

type Cause = Box<dyn StdError + Send + Sync>;

/// The error with which a verb (subcommand) of `quietcut` ends.
///
/// The `From` conversions decide whether an error of the library is an input error.
#[derive(Debug)]
pub enum Error {
    /// Wrong usage or wrong input, which the user can correct: exit status 2.
    Input(Cause),
    /// Failure that the user cannot correct: exit status 1.
    Other(Cause),
    /// The reader of standard output has closed the pipe (`quietcut monitor … | head`): exit status 0.
    ReaderGone,
}

impl Error {
    /// Makes an error of usage or input, with exit status 2.
    pub fn input(cause: impl Into<Cause>) -> Self {
        Self::Input(cause.into())
    }

    /// Makes an error that the user cannot correct, with exit status 1.
    pub fn other(cause: impl Into<Cause>) -> Self {
        Self::Other(cause.into())
    }

    /// Exit status of the process: 2 for wrong usage or input, 1 for other errors, 0 if the reader of standard output
    /// has closed the pipe.
    pub fn exit_status(&self) -> u8 {
        match self {
            Self::Input(_) => 2,
            Self::Other(_) => 1,
            Self::ReaderGone => 0,
        }
    }
}

impl std::fmt::Display for Error {
    /// Writes the message of the error, followed after colons by each source error that the message does not already
    /// contain.
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let (Self::Input(cause) | Self::Other(cause)) = self else {
            return f.write_str("the reader of standard output has gone");
        };
        let mut message = cause.to_string();
        let mut source = cause.source();
        while let Some(inner) = source {
            let said = inner.to_string();
            if !message.contains(&said) {
                message = format!("{message}: {said}");
            }
            source = inner.source();
        }
        f.write_str(&message)
    }
}

impl StdError for Error {}

impl From<FileError> for Error {
    fn from(error: FileError) -> Self {
        match error {
            // The user gave the path of the file that cannot be read or is no text, so this is an input error.
            FileError::Read { .. } | FileError::NotText { .. } => Self::input(error),
            FileError::Write { ref cause, .. } => match cause.kind() {
                io::ErrorKind::NotFound
                | io::ErrorKind::PermissionDenied
                | io::ErrorKind::NotADirectory
                | io::ErrorKind::IsADirectory => Self::input(error),
                _ => Self::other(error),
            },
        }
    }
}

impl From<CaseError> for Error {
    fn from(error: CaseError) -> Self {
        match error {
            CaseError::File(cause) => cause.into(),
            other => Self::input(other),
        }
    }
}

impl From<FolderError> for Error {
    fn from(error: FolderError) -> Self {
        match error {
            FolderError::Case(cause) => cause.into(),
            other => Self::input(other),
        }
    }
}

impl From<StabilityError> for Error {
    fn from(error: StabilityError) -> Self {
        match error {
            StabilityError::BrokeDown { .. } | StabilityError::Eigenvalues { .. } => Self::other(error),
            _ => Self::input(error),
        }
    }
}

impl From<BuildError> for Error {
    fn from(error: BuildError) -> Self {
        match error {
            BuildError::Stability(error) => error.into(),
            _ => Self::input(error),
        }
    }
}

impl From<CutTableError> for Error {
    fn from(error: CutTableError) -> Self {
        match error {
            CutTableError::File(cause) => cause.into(),
            other => Self::input(other),
        }
    }
}

impl From<PlanError> for Error {
    fn from(error: PlanError) -> Self {
        match error {
            PlanError::Stability(error) => error.into(),
            _ => Self::input(error),
        }
    }
}

impl From<DeviceError> for Error {
    fn from(error: DeviceError) -> Self {
        match error {
            DeviceError::PseudoTerminal { .. } | DeviceError::TooLarge { .. } | DeviceError::Cell(_) => {
                Self::other(error)
            }
            // These errors concern the port, the cable, the device, the lobe table or the state file of the simulated
            // device, which the user can correct: they are input errors.
            _ => Self::input(error),
        }
    }
}

impl From<WebError> for Error {
    fn from(error: WebError) -> Self {
        match error {
            WebError::Bind { .. } => Self::input(error),
            WebError::Server(_) | WebError::Random { .. } => Self::other(error),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[derive(Debug, thiserror::Error)]
    #[error("case.toml")]
    struct Outer(#[source] io::Error);

    #[test]
    fn the_message_contains_the_source_error_once() {
        let error = Error::input(Outer(io::Error::other("line 3")));
        assert_eq!(error.to_string(), "case.toml: line 3");
        assert_eq!(error.exit_status(), 2);
        assert_eq!(Error::other("x").exit_status(), 1);
    }
}
