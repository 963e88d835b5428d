//! The flash that tables are kept in.

use embedded_storage::nor_flash::NorFlash;
use quietcut_core::lobes::format::HEADER_LENGTH;

/// The largest [`NorFlash::WRITE_SIZE`] that is possible.
pub(super) const MAX_WRITE_SIZE: usize = HEADER_LENGTH;

/// What erased flash reads as.
pub(super) const ERASED: u8 = 0xFF;

/// Flash that can be read where it lies in the address space.
///
/// A word whose writing, or a page whose erasing, was cut short by a loss of power may read as anything, but reading it
/// must not fault: a memory with error correction that raises an interrupt there must return from it.
pub trait TableMemory: NorFlash {
    /// All bytes of the memory.
    fn mapped(&self) -> &[u8];
}
