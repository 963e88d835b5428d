//! Counts instructions in the emulator.

use cortex_m::peripheral::SYST;
use cortex_m::peripheral::syst::SystClkSource;
use cortex_m_semihosting::{debug, hprintln};

/// Counter of instructions, with the timer SysTick.
pub(crate) struct Counter {
    timer: SYST,
    empty_ticks: u32,
}

impl Counter {
    /// Largest count of SysTick, which has 24 bits: 10.4 million instructions.
    const MAX_TICKS: u32 = 0x00ff_ffff;

    pub(crate) fn start(mut timer: SYST) -> Self {
        timer.set_clock_source(SystClkSource::Core);
        timer.set_reload(Self::MAX_TICKS);
        timer.clear_current();
        timer.enable_counter();
        let mut counter = Self {
            timer,
            empty_ticks: 0,
        };
        counter.empty_ticks = counter.ticks(|| ());
        counter
    }

    fn ticks(&mut self, piece: impl FnOnce()) -> u32 {
        self.timer.clear_current();
        let before = SYST::get_current();
        piece();
        let after = SYST::get_current();
        if self.timer.has_wrapped() {
            fail()
        }
        before.wrapping_sub(after) & Self::MAX_TICKS
    }

    /// Number of instructions of `piece`.
    pub(crate) fn count(&mut self, piece: impl FnOnce()) -> u64 {
        let ticks = self.ticks(piece).saturating_sub(self.empty_ticks);
        // One instruction takes 1.6 ticks.
        (u64::from(ticks) * 5 + 4) / 8
    }
}

/// Ends the emulator with a failure.
pub(crate) fn fail() -> ! {
    loop {
        debug::exit(debug::EXIT_FAILURE);
    }
}

#[panic_handler]
fn panic(info: &core::panic::PanicInfo) -> ! {
    hprintln!("{}", info);
    fail()
}
