//! The board's clock: timer 0, which counts down from 2³² − 1 at 25 MHz, extended by its number of wraps.

use core::sync::atomic::{AtomicU32, Ordering};

use quietcut_core::units::Nanoseconds;
use quietcut_firmware::device;

const CONTROL: usize = 0x4000_0000;
const VALUE: usize = CONTROL + 4;
const RELOAD: usize = CONTROL + 8;
const INTERRUPT: usize = CONTROL + 12;
const TICKS_PER_MICROSECOND: u32 = 25;

static WRAPS: AtomicU32 = AtomicU32::new(0);

pub(crate) fn start() {
    // SAFETY: the addresses are registers of timer 0, which no other code uses.
    unsafe {
        (RELOAD as *mut u32).write_volatile(u32::MAX);
        (VALUE as *mut u32).write_volatile(u32::MAX);
        // Enables timer 0 of the emulated board, and its interrupt when it reaches zero.
        (CONTROL as *mut u32).write_volatile(0b1001);
    }
}

/// Handles the interrupt of timer 0: counts a wrap of the timer.
pub(crate) fn wrap() {
    // SAFETY: clears the interrupt flag of timer 0.
    unsafe { (INTERRUPT as *mut u32).write_volatile(1) };
    WRAPS.store(WRAPS.load(Ordering::Relaxed).wrapping_add(1), Ordering::Relaxed);
}

/// Time since the start of timer 0 in ticks of 40 ns, modulo 2³².
pub(crate) fn ticks() -> u32 {
    // SAFETY: this only reads the value of timer 0.
    u32::MAX - unsafe { (VALUE as *const u32).read_volatile() }
}

/// Time since the start of timer 0, in microseconds.
pub(crate) fn microseconds() -> u64 {
    loop {
        let wraps = WRAPS.load(Ordering::Relaxed);
        let ticks = ticks();
        if WRAPS.load(Ordering::Relaxed) == wraps {
            return (u64::from(wraps) << 32 | u64::from(ticks)) / u64::from(TICKS_PER_MICROSECOND);
        }
    }
}

/// The clock of the board, from which the device takes the time.
pub(crate) struct BoardClock;

impl device::Clock for BoardClock {
    fn now(&self) -> Nanoseconds {
        Nanoseconds(microseconds() * 1000)
    }
}

/// Waits in a loop for `microseconds` microseconds.
pub(crate) fn wait_microseconds(microseconds: u32) {
    let start = ticks();
    while ticks().wrapping_sub(start) < microseconds * TICKS_PER_MICROSECOND {}
}

defmt::timestamp!("{=u64:us}", microseconds());
