//! What the device costs: the depth of the stack, and the time that each block and each look at the link takes.
//!
//! The memory below the stack is painted at the start and looked at later. Time is that of the board's timer: where the emulator
//! counts instructions (`-icount shift=6`) one instruction is 64 ns of it.

use crate::{clock, flash};

/// More than the real board has in all.
const PAINTED_BYTES: usize = 128 * 1024;
/// The frame of the painting function itself.
const SPARED_BYTES: usize = 256;
const PAINT: u32 = 0xdead_beef;

/// Costs so far.
pub(crate) struct Cost {
    /// The stack pointer when the memory below it was painted.
    top: usize,
    blocks: u32,
    ticks: u64,
    most_ticks: u32,
    /// The longest look at the link, which may end with a request: without the time of the flash, and that of the flash.
    request_ticks: u32,
    flash_ticks: u32,
}

impl Cost {
    /// Begins to watch. The frame of the caller does not count: it is the main function's, which holds the device; the
    /// real board has that in static memory.
    ///
    /// # Safety
    /// No interrupt may be on, and the stack at most some kilobytes deep.
    #[inline(never)]
    pub(crate) unsafe fn watch() -> Self {
        let top = cortex_m::register::msp::read() as usize;
        for word in (top - PAINTED_BYTES..top - SPARED_BYTES).step_by(4) {
            // SAFETY: below the stack pointer, above all statics: nothing else is there.
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

    /// Does something with a block, and notes how long it takes.
    pub(crate) fn of_block(&mut self, work: impl FnOnce()) {
        let start = clock::ticks();
        work();
        let ticks = clock::ticks().wrapping_sub(start);
        self.blocks += 1;
        self.ticks += u64::from(ticks);
        self.most_ticks = self.most_ticks.max(ticks);
    }

    /// Looks at the link, does what the host asks, and notes how long that takes.
    pub(crate) fn of_request<T>(&mut self, work: impl FnOnce() -> T) -> T {
        let (start, flash_start) = (clock::ticks(), flash::busy_ticks());
        let done = work();
        let flash_ticks = flash::busy_ticks().wrapping_sub(flash_start);
        let ticks = clock::ticks().wrapping_sub(start);
        self.request_ticks = self.request_ticks.max(ticks.saturating_sub(flash_ticks));
        self.flash_ticks = self.flash_ticks.max(flash_ticks);
        done
    }

    /// Writes all to the log.
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
            // SAFETY: reads memory that exists, and was written.
            unsafe { (*word as *const u32).read_volatile() == PAINT }
        };
        let painted = (self.top - PAINTED_BYTES..self.top)
            .step_by(4)
            .take_while(is_painted)
            .count();
        PAINTED_BYTES - 4 * painted
    }
}
