//! Why no table can be made.

use quietcut_core::lobes::TableError;

use crate::error::StabilityError;

/// Why no table can be made.
#[derive(Debug, thiserror::Error)]
pub enum BuildError {
    /// There is no case.
    #[error("a table needs at least one case")]
    NoCase,
    /// Stability cannot be computed.
    #[error(transparent)]
    Stability(#[from] StabilityError),
    /// The cases belong to different tools.
    #[error("{}: {found} teeth; a table is for one tool, and the first case has {expected}", path.display())]
    Teeth {
        /// The case file.
        path: std::path::PathBuf,
        /// Its number of teeth.
        found: usize,
        /// That of the first case.
        expected: usize,
    },
    /// What was asked for does not fit a case.
    #[error("{}: {what}", path.display())]
    NotPossible {
        /// The case file.
        path: std::path::PathBuf,
        /// What does not fit, and what would.
        what: &'static str,
    },
    /// The table format does not take it: two layers for the same cut, for instance.
    #[error(
        "the table cannot be written: {0}; each layer must have its own feed, feed direction, immersion or posture"
    )]
    Format(TableError),
}
