//! What is in the table part of a slot.

use quietcut_core::lobes::{Header, TableError};

/// What is in the table part of a slot.
#[derive(Clone, Copy)]
pub(super) enum Contents {
    Empty,
    Damaged(TableError),
    Valid(Header),
}
