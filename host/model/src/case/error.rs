//! Errors of a case file, and of tasks that a case does not allow.

use std::path::PathBuf;

use quietcut_recording::file::FileError;

use super::sections::Section;
use crate::effects::EffectError;

/// A case file that cannot be used, or not for the requested task. Every message names the file.
#[derive(Debug, thiserror::Error)]
pub enum CaseError {
    /// The file cannot be read.
    #[error(transparent)]
    File(#[from] FileError),
    /// A file that is not TOML or, outside of the tables `[extension.NAME]`, an unknown key, a missing key or a value
    /// of the wrong type.
    #[error("{}: line {line}, `{source_line}`: {message}", path.display())]
    Syntax {
        /// The file.
        path: PathBuf,
        /// Number of the line of the case file, from 1.
        line: usize,
        /// Text of the line.
        source_line: String,
        /// The fault: the message of the TOML parser, or all keys that the section lacks.
        message: String,
    },
    /// A value that is not possible, a key or extension that is not allowed, or a key that the other ones require.
    #[error("{}: line {line}, {key}: found {found}; {expected} is needed", path.display())]
    Value {
        /// The file.
        path: PathBuf,
        /// Line, from 1.
        line: usize,
        /// The refused or missing key with its table, such as `tool.teeth`.
        key: String,
        /// The refused value of the case file, or words for the fault.
        found: String,
        /// The expected value.
        expected: String,
    },
    /// Extensions of which a key is missing, or whose keys or values are not possible together.
    #[error("{}: line {line}: {error}", path.display())]
    Effect {
        /// The file.
        path: PathBuf,
        /// Line, from 1.
        line: usize,
        /// The fault.
        error: EffectError,
    },
    /// A section of the case that the requested task requires is missing.
    #[error("{}: there is no [{section}]; {what_for}{}", path.display(), keys_of(section))]
    MissingSection {
        /// The file.
        path: PathBuf,
        /// Name of the missing section: structure, tool, material or cut.
        section: &'static str,
        /// The task that needs the missing section, in words.
        what_for: &'static str,
    },
    /// An extension of the case that the requested computation cannot treat.
    #[error("{}: [extension.{name}] cannot be treated here: {reason}", path.display())]
    Extension {
        /// The file.
        path: PathBuf,
        /// Name of the extension.
        name: String,
        /// The reason why the computation cannot treat the extension.
        reason: String,
    },
}

/// Message part: the required keys of a missing section, with units and lines to paste; empty for `structure`.
fn keys_of(section: &str) -> String {
    Section::of(section).map_or_else(String::new, |section| format!("; {}", section.whole()))
}
