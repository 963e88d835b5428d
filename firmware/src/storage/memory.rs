//! The flash memory in which the lobe tables are stored.

use embedded_storage::nor_flash::NorFlash;
use quietcut_core::lobes::format::HEADER_LENGTH;

/// Largest [`NorFlash::WRITE_SIZE`] that is supported: a flash word must not exceed the header of a lobe table.
pub(super) const MAX_WRITE_SIZE: usize = HEADER_LENGTH;

/// Value of an erased byte.
pub(super) const ERASED: u8 = 0xFF;

/// Memory-mapped flash.
///
/// After a loss of power during a write or an erase, the affected word or page may hold any value. Reading it must
/// not fail: if the error correction of the memory raises an interrupt, its handler must return.
pub trait TableMemory: NorFlash {
    /// All bytes of the flash memory, as mapped into the address space.
    fn mapped(&self) -> &[u8];
}
