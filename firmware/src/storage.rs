//! Lobe tables in flash: two slots, so that power may fail at any moment and a whole table is left.
//!
//! The memory is divided into two equal slots. A slot is
//!
//! ```text
//! ├ header │ payload ……………………………………………………… │ journal ┤
//!   32 bytes, written last                       one page
//! ```
//!
//! and what stands before the journal is a table, byte for byte as [`quietcut_core::lobes::format`] has it, but with a
//! generation of its own. At the start the valid table with the newest generation is taken into use, so the order of an
//! upload is: erase the *other* slot and write the payload, page by page from the header's on, check it, write the header.
//! Until the last word of the header stands, the slot is not valid and the old table stays.
//!
//! The journal remembers across a power cut which table was on its way and how far it was: an upload goes on at the
//! page it had reached.
//!
//! No request erases more than one page, so that none holds the device up for longer than that takes.

mod contents;
mod examination;
mod journal;
mod memory;
mod progress;
mod reception;
mod requests;
mod slots;

pub use memory::TableMemory;
pub use slots::Storage;
