//! The content of a slot's table area.

use quietcut_core::lobes::{Header, TableError};

/// The content of a slot's table area.
#[derive(Clone, Copy)]
pub(super) enum Contents {
    Empty,
    Damaged(TableError),
    Valid(Header),
}
