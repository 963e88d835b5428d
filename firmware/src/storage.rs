//! Lobe tables in flash. After the first upload one of two slots always holds a complete table, so that power may
//! fail at any moment.
//!
//! The memory is divided into two equal slots. A slot is
//!
//! ```text
//! ├ header │ payload ……………………………………………………… │ journal ┤
//!   32 bytes, written last                       one page
//! ```
//!
//! The bytes before the journal are a table as specified in [`quietcut_core::lobes::format`], with a generation
//! number of the device. At start-up the valid table with the newest generation is in use.
//!
//! An upload goes to the slot that is *not* in use, in this order: erase and write page by page, check the CRC, write
//! the header, check the entries. The last word of its header makes the slot valid, if its entries are. Until then
//! the old table stays in use.
//!
//! The journal stores which table is being uploaded and, page by page (in a large slot after every few pages), how
//! many bytes are written. After a loss of power the upload continues after the last pages that the journal marks as
//! written.
//!
//! No request erases more than one page. This limits the time for which a request waits for the flash.

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
