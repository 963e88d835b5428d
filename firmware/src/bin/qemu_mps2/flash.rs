//! Emulated flash for the lobe tables in the board's non-volatile memory, with the timing and restrictions of the
//! real board's flash.
//!
//! A page has 2 KB, and an erase sets all its bits. A double word of 8 bytes is written once after each erase; only
//! zeros may overwrite it. An erase and a write take as long as on the STM32G474.

use core::sync::atomic::{AtomicU32, Ordering};

use embedded_storage::nor_flash::{
    ErrorType, NorFlash, NorFlashErrorKind, ReadNorFlash, check_erase, check_read, check_write,
};
use quietcut_firmware::stimulus::FLASH_BYTES;
use quietcut_firmware::storage::TableMemory;

use crate::clock;

/// Address at which the emulator maps the file of the non-volatile memory.
pub(crate) const PSRAM_BASE: usize = 0x2100_0000;

const PAGE_BYTES: usize = 2048;
const DOUBLE_WORD_BYTES: usize = 8;
const ERASE_PAGE_MICROSECONDS: u32 = 22_000;
const WRITE_DOUBLE_WORD_MICROSECONDS: u32 = 82;

static BUSY_TICKS: AtomicU32 = AtomicU32::new(0);

/// Total time for which the emulated flash was busy, in ticks of the board's clock, modulo 2³².
pub(crate) fn busy_ticks() -> u32 {
    BUSY_TICKS.load(Ordering::Relaxed)
}

fn be_busy(microseconds: u32) {
    let start = clock::ticks();
    clock::wait_microseconds(microseconds);
    let ticks = clock::ticks().wrapping_sub(start);
    BUSY_TICKS.store(busy_ticks().wrapping_add(ticks), Ordering::Relaxed);
}

/// The only handle of the emulated flash, created by [`Flash::take`].
pub(crate) struct Flash(());

impl Flash {
    /// # Safety
    /// Must be called at most once.
    pub(crate) unsafe fn take() -> Self {
        Self(())
    }

    fn word(offset: usize) -> *mut u64 {
        (PSRAM_BASE + offset) as *mut u64
    }
}

impl ErrorType for Flash {
    type Error = NorFlashErrorKind;
}

impl TableMemory for Flash {
    fn mapped(&self) -> &[u8] {
        // SAFETY: the non-volatile memory exists, may hold any bytes, and is written through `self` only.
        unsafe { core::slice::from_raw_parts(PSRAM_BASE as *const u8, FLASH_BYTES) }
    }
}

impl ReadNorFlash for Flash {
    const READ_SIZE: usize = 1;

    fn read(&mut self, offset: u32, bytes: &mut [u8]) -> Result<(), NorFlashErrorKind> {
        check_read(self, offset, bytes.len())?;
        let range = self
            .mapped()
            .get(offset as usize..)
            .and_then(|rest| rest.get(..bytes.len()));
        bytes.copy_from_slice(range.ok_or(NorFlashErrorKind::OutOfBounds)?);
        Ok(())
    }

    fn capacity(&self) -> usize {
        FLASH_BYTES
    }
}

impl NorFlash for Flash {
    const WRITE_SIZE: usize = DOUBLE_WORD_BYTES;
    const ERASE_SIZE: usize = PAGE_BYTES;

    fn erase(&mut self, from: u32, to: u32) -> Result<(), NorFlashErrorKind> {
        check_erase(self, from, to)?;
        for page in (from as usize..to as usize).step_by(PAGE_BYTES) {
            be_busy(ERASE_PAGE_MICROSECONDS);
            for offset in (page..page + PAGE_BYTES).step_by(DOUBLE_WORD_BYTES) {
                // SAFETY: the range was checked to lie in the emulated flash. The write is volatile, so that the words
                // reach the emulator's file in this order.
                unsafe { Self::word(offset).write_volatile(u64::MAX) };
            }
        }
        Ok(())
    }

    fn write(&mut self, offset: u32, bytes: &[u8]) -> Result<(), NorFlashErrorKind> {
        check_write(self, offset, bytes.len())?;
        for (offset, word) in (offset as usize..)
            .step_by(DOUBLE_WORD_BYTES)
            .zip(bytes.chunks_exact(DOUBLE_WORD_BYTES))
        {
            let word = word.try_into().map_or(0, u64::from_le_bytes);
            // SAFETY: the range of the read was checked to lie in the emulated flash.
            let erased = unsafe { Self::word(offset).read_volatile() } == u64::MAX;
            // The real flash refuses to overwrite a written double word, except with zeros.
            if !erased && word != 0 {
                return Err(NorFlashErrorKind::Other);
            }
            be_busy(WRITE_DOUBLE_WORD_MICROSECONDS);
            // SAFETY: the range of the write was checked to lie in the emulated flash.
            unsafe { Self::word(offset).write_volatile(word) };
        }
        Ok(())
    }
}
