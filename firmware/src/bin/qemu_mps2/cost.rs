//! Cost of the device: stack depth, and processing time of blocks and of polls of the link.
//!
//! The memory below the stack is filled with a pattern at the start. Later the overwritten part gives the stack
//! depth. Times come from the board's timer. If the emulator counts instructions (`-icount shift=6`), one instruction
//! takes 64 ns.

use crate::{clock, flash};

/// Largest stack depth of the device that can be measured, in bytes: the size of the whole RAM of the real board.
const PAINTED_BYTES: usize = 128 * 1024;
/// Number of bytes below the stack pointer that are not filled with the pattern, because the filling function uses
/// them.
const SPARED_BYTES: usize = 256;
const PAINT: u32 = 0xdead_beef;

/// Costs of the device measured so far: stack depth, number of blocks with their total and largest processing time,
/// and largest times of a poll of the link.
pub(crate) struct Cost {
    /// Value of the stack pointer when the memory below it was filled with the pattern.
    top: usize,
    blocks: u32,
    ticks: u64,
    most_ticks: u32,
    /// Largest processing time of a poll of the link without its flash operations, in ticks of 40 ns. A poll performs
    /// at most one request if the host waits for each reply.
    request_ticks: u32,
    /// Largest time of the flash operations during one poll of the link, in ticks of 40 ns.
    flash_ticks: u32,
}

impl Cost {
    /// Starts the measurement of stack depth and times. The stack frame of the caller does not count: the caller is the
    /// main function, which holds the device. The real board holds the device in static memory.
    ///
    /// # Safety
    /// Interrupts must be disabled, and the stack at most some kilobytes deep.
    #[inline(never)]
    pub(crate) unsafe fn watch() -> Self {
        let top = cortex_m::register::msp::read() as usize;
        for word in (top - PAINTED_BYTES..top - SPARED_BYTES).step_by(4) {
            // SAFETY: the memory between static variables and stack pointer is unused.
            unsafe { (word as *mut u32).write_volatile(PAINT) };
        }
        Self {
            top,
            blocks: 0,
            ticks: 0,
            most_ticks: 0,
            request_ticks: 0,
            flash_ticks: 0,
        }
    }

    /// Runs `work`, the processing of a block of samples, and records its time.
    pub(crate) fn of_block(&mut self, work: impl FnOnce()) {
        let start = clock::ticks();
        work();
        let ticks = clock::ticks().wrapping_sub(start);
        self.blocks += 1;
        self.ticks += u64::from(ticks);
        self.most_ticks = self.most_ticks.max(ticks);
    }

    /// Runs `work`, a poll of the link, and records its time.
    pub(crate) fn of_request<T>(&mut self, work: impl FnOnce() -> T) -> T {
        let (start, flash_start) = (clock::ticks(), flash::busy_ticks());
        let done = work();
        let flash_ticks = flash::busy_ticks().wrapping_sub(flash_start);
        let ticks = clock::ticks().wrapping_sub(start);
        self.request_ticks = self.request_ticks.max(ticks.saturating_sub(flash_ticks));
        self.flash_ticks = self.flash_ticks.max(flash_ticks);
        done
    }

    /// Writes the stack depth, the number of blocks, their total and largest processing time, and the largest times
    /// of a poll of the link to the log.
    pub(crate) fn log(&self) {
        defmt::info!(
            "cost: {=usize} bytes of stack; {=u32} blocks took {=u64} ticks, one at most {=u32}; a request at most {=u32}, and the flash {=u32}",
            self.stack_bytes(),
            self.blocks,
            self.ticks,
            self.most_ticks,
            self.request_ticks,
            self.flash_ticks
        );
    }

    fn stack_bytes(&self) -> usize {
        let is_painted = |word: &usize| {
            // SAFETY: the address is in RAM, at most `PAINTED_BYTES` below the stack pointer at the start of the
            // measurement.
            unsafe { (*word as *const u32).read_volatile() == PAINT }
        };
        let painted = (self.top - PAINTED_BYTES..self.top)
            .step_by(4)
            .take_while(is_painted)
            .count();
        PAINTED_BYTES - 4 * painted
    }
}
