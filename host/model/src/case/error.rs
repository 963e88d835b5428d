//! Errors of a case file, with their line and the expected value.

use std::path::PathBuf;

use quietcut_recording::file::FileError;

use crate::effects::EffectError;

/// A case file that cannot be used. Every message names the file.
#[derive(Debug, thiserror::Error)]
pub enum CaseError {
    /// The file cannot be read.
    #[error(transparent)]
    File(#[from] FileError),
    /// Not TOML, a key that does not belong, a key that is missing, or a value of the wrong type.
    #[error("{}: line {line}, `{source_line}`: {message}", path.display())]
    Syntax {
        /// The file.
        path: PathBuf,
        /// Line, from 1.
        line: usize,
        /// That line.
        source_line: String,
        /// What the parser found, and what it would have taken.
        message: String,
    },
    /// A value that no machine, tool or cut can have.
    #[error("{}: line {line}, {key}: found {found}; {expected} is needed", path.display())]
    Value {
        /// The file.
        path: PathBuf,
        /// Line, from 1.
        line: usize,
        /// The key, with its table: `tool.teeth`.
        key: String,
        /// The value as read.
        found: String,
        /// The expected value.
        expected: String,
    },
    /// Values of extensions that are not possible beside each other, or a key that is missing.
    #[error("{}: line {line}: {error}", path.display())]
    Effect {
        /// The file.
        path: PathBuf,
        /// Line, from 1.
        line: usize,
        /// The fault.
        error: EffectError,
    },
    /// A missing table that the task requires.
    #[error("{}: there is no [{section}]; {what_for}", path.display())]
    MissingSection {
        /// The file.
        path: PathBuf,
        /// The table: structure, tool, material, cut.
        section: &'static str,
        /// Why it is needed.
        what_for: &'static str,
    },
    /// An extension of the model that cannot be treated by what is asked for.
    #[error("{}: [extension.{name}] cannot be treated here: {reason}", path.display())]
    Extension {
        /// The file.
        path: PathBuf,
        /// Name of the extension.
        name: String,
        /// Why not, and what can be done instead.
        reason: String,
    },
}
