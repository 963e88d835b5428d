//! The content of a table slot in flash, apart from its journal.

use quietcut_core::lobes::{Header, TableError};

/// The content of a table slot in flash, apart from its journal.
#[derive(Clone, Copy)]
pub(super) enum Contents {
    Empty,
    Damaged(TableError),
    Valid(Header),
}
