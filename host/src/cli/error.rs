//! What a verb can fail with, and the exit status that belongs to it.

use std::error::Error as StdError;
use std::io;

use crate::case::CaseError;
use crate::device::DeviceError;
use crate::file::FileError;
use crate::lobe_table::BuildError;
use crate::plan::PlanError;
use crate::stability::StabilityError;
use crate::trial_cuts::TestCutsError;

type Cause = Box<dyn StdError + Send + Sync>;

/// Why a verb did not do what it was asked to.
///
/// The library's errors become one or the other here and nowhere else, by `From`.
#[derive(Debug)]
pub enum Error {
    /// Bad usage or bad input: exit status 2. The message names the file, the line or key, the value found and
    /// what would be right.
    Input(Cause),
    /// Anything else: exit status 1.
    Other(Cause),
    /// Whoever read standard output has stopped reading (`quietcut monitor … | head`): nothing is wrong.
    ReaderGone,
}

impl Error {
    /// Bad usage or bad input.
    pub fn input(cause: impl Into<Cause>) -> Self {
        Self::Input(cause.into())
    }

    /// Anything that is not the user's to mend.
    pub fn other(cause: impl Into<Cause>) -> Self {
        Self::Other(cause.into())
    }

    /// 2 for bad usage or input, 1 for anything else.
    pub fn exit_status(&self) -> u8 {
        match self {
            Self::Input(_) => 2,
            Self::Other(_) => 1,
            Self::ReaderGone => 0,
        }
    }
}

impl std::fmt::Display for Error {
    /// The message and, after colons, what caused it where the message does not say so itself.
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
            // The folder or the file that the user named is wrong.
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

impl From<StabilityError> for Error {
    fn from(error: StabilityError) -> Self {
        match error {
            StabilityError::BrokeDown { .. } => Self::other(error),
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

impl From<TestCutsError> for Error {
    fn from(error: TestCutsError) -> Self {
        match error {
            TestCutsError::File(cause) => cause.into(),
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
            // Port, cable, device or table: all of them the user's to mend.
            _ => Self::input(error),
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
    fn the_cause_is_said_once() {
        let error = Error::input(Outer(io::Error::other("line 3")));
        assert_eq!(error.to_string(), "case.toml: line 3");
        assert_eq!(error.exit_status(), 2);
        assert_eq!(Error::other("x").exit_status(), 1);
    }
}
