//! Logger of the emulated board: sends the frames of the logging library defmt to the log port.

use core::cell::UnsafeCell;
use core::sync::atomic::{AtomicBool, Ordering};

use crate::uart::LOG;

#[defmt::global_logger]
struct Logger;

struct State {
    encoder: UnsafeCell<defmt::Encoder>,
    restore: UnsafeCell<critical_section::RestoreState>,
}

// SAFETY: both cells are accessed only between `acquire` and `release`, with interrupts off on a single core. `TAKEN`
// excludes a second access.
unsafe impl Sync for State {}

static TAKEN: AtomicBool = AtomicBool::new(false);
static STATE: State = State {
    encoder: UnsafeCell::new(defmt::Encoder::new()),
    restore: UnsafeCell::new(critical_section::RestoreState::invalid()),
};

fn send(bytes: &[u8]) {
    LOG.send(bytes);
}

// SAFETY: `acquire` turns interrupts off and refuses a second caller; `release` undoes both.
unsafe impl defmt::Logger for Logger {
    fn acquire() {
        // SAFETY: `release` ends the critical section; the logging library calls it once after each `acquire`.
        let restore = unsafe { critical_section::acquire() };
        // A log statement within another one is a fault of the program and stops it.
        assert!(!TAKEN.swap(true, Ordering::Relaxed));
        // SAFETY: interrupts are off and no other code has acquired the logger.
        unsafe {
            *STATE.restore.get() = restore;
            (*STATE.encoder.get()).start_frame(send);
        }
    }

    unsafe fn flush() {}

    unsafe fn release() {
        // SAFETY: interrupts have been off since `acquire`, so no other code uses the encoder.
        unsafe {
            (*STATE.encoder.get()).end_frame(send);
            TAKEN.store(false, Ordering::Relaxed);
            critical_section::release(*STATE.restore.get());
        }
    }

    unsafe fn write(bytes: &[u8]) {
        // SAFETY: interrupts have been off since `acquire`, so no other code uses the encoder.
        unsafe { (*STATE.encoder.get()).write(bytes, send) };
    }
}
