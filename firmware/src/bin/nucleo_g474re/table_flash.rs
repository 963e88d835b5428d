//! The flash of the two table slots: the second bank of the internal flash, as defined in `memory.x`.
//!
//! The program runs from the first bank, so processor and interrupts continue while a page of the second is erased or
//! written (RM0440, chapter 3: read-while-write). Only the caller waits. The flash driver of embassy-stm32 disables
//! the data cache meanwhile and clears it. embassy-stm32 refuses to start if the option bytes select single-bank
//! mode.
//!
//! Not yet confirmed on a board, and not testable in an emulator: sampling continues during a page erase, and a
//! double word left half written by a loss of power raises the interrupt of [`pass_over_damage`] only.

use embassy_stm32::flash::{Blocking, Error, FLASH_BASE, Flash};
use embassy_stm32::pac;
use embedded_storage::nor_flash::{ErrorType, NorFlash, ReadNorFlash};
use quietcut_firmware::storage::TableMemory;

unsafe extern "C" {
    /// Linker symbol whose address is the start of the first table slot.
    static __table_slots_start: u8;
    /// Linker symbol whose address is the end of the second table slot.
    static __table_slots_end: u8;
}

/// The flash of both table slots, from the start of the first to the end of the second.
pub(crate) struct TableFlash {
    flash: Flash<'static, Blocking>,
    /// Offset of the first table slot from the start of the flash memory.
    start: u32,
    bytes: u32,
}

impl TableFlash {
    pub(crate) fn new(flash: Flash<'static, Blocking>) -> Self {
        let start = (&raw const __table_slots_start).addr();
        let end = (&raw const __table_slots_end).addr();
        Self {
            flash,
            start: (start - FLASH_BASE) as u32,
            bytes: (end - start) as u32,
        }
    }

    /// Offset from the start of the flash memory of `length` bytes at `offset` within the table slots; an error if they
    /// reach beyond the slots.
    fn place(&self, offset: u32, length: usize) -> Result<u32, Error> {
        let end = u32::try_from(length)
            .ok()
            .and_then(|length| offset.checked_add(length));
        match end {
            Some(end) if end <= self.bytes => Ok(self.start + offset),
            _ => Err(Error::Size),
        }
    }
}

/// Handles the non-maskable interrupt on reading a double word with a two-bit error, which a loss of power during a
/// write can leave behind.
///
/// The bytes are used as read, and the CRC of the table detects them. Returns false if the interrupt has another cause.
pub(crate) fn pass_over_damage() -> bool {
    let is_damage = pac::FLASH.eccr().read().eccd();
    if is_damage {
        // Writing a one to the bit clears the flag of the flash error.
        pac::FLASH.eccr().modify(|register| register.set_eccd(true));
    }
    is_damage
}

impl TableMemory for TableFlash {
    fn mapped(&self) -> &[u8] {
        // SAFETY: `memory.x` reserves these addresses for the table slots. Any byte value is valid, and the
        // bytes are written through `self` only.
        unsafe { core::slice::from_raw_parts(&raw const __table_slots_start, self.bytes as usize) }
    }
}

impl ErrorType for TableFlash {
    type Error = Error;
}

impl ReadNorFlash for TableFlash {
    const READ_SIZE: usize = <Flash<'static, Blocking> as ReadNorFlash>::READ_SIZE;

    fn read(&mut self, offset: u32, bytes: &mut [u8]) -> Result<(), Error> {
        let place = self.place(offset, bytes.len())?;
        self.flash.blocking_read(place, bytes)
    }

    fn capacity(&self) -> usize {
        self.bytes as usize
    }
}

impl NorFlash for TableFlash {
    const WRITE_SIZE: usize = <Flash<'static, Blocking> as NorFlash>::WRITE_SIZE;
    const ERASE_SIZE: usize = <Flash<'static, Blocking> as NorFlash>::ERASE_SIZE;

    fn erase(&mut self, from: u32, to: u32) -> Result<(), Error> {
        let length = to.checked_sub(from).ok_or(Error::Size)?;
        let place = self.place(from, length as usize)?;
        self.flash.blocking_erase(place, place + length)
    }

    fn write(&mut self, offset: u32, bytes: &[u8]) -> Result<(), Error> {
        let place = self.place(offset, bytes.len())?;
        self.flash.blocking_write(place, bytes)
    }
}
