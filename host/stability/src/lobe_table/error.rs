//! Errors of building a lobe table.

use quietcut_core::lobes::TableError;

use crate::error::StabilityError;

/// Reason why a lobe table cannot be built.
#[derive(Debug, thiserror::Error)]
pub enum BuildError {
    /// No case is given.
    #[error("a table needs at least one case")]
    NoCase,
    /// The stability of a case cannot be computed.
    #[error(transparent)]
    Stability(#[from] StabilityError),
    /// The cases have tools with different numbers of teeth.
    #[error("{}: {found} teeth; a table is for one tool, and the first case has {expected}", path.display())]
    Teeth {
        /// The case file.
        path: std::path::PathBuf,
        /// Number of teeth of the case whose tool differs.
        found: usize,
        /// Number of teeth of the tool of the first case.
        expected: usize,
    },
    /// The requested table does not fit a case.
    #[error("{}: {what}", path.display())]
    NotPossible {
        /// The case file.
        path: std::path::PathBuf,
        /// Reason why the request does not fit the case.
        what: &'static str,
    },
    /// The format of lobe tables refuses the content, such as two layers for the same cut.
    #[error(
        "the table cannot be written: {0}; each layer must have its own feed, feed direction, immersion or posture"
    )]
    Format(TableError),
}
