//! Counts the instructions of pieces of the signal chain on the emulated Cortex-M4F.
//!
//! Run with `-icount shift=6`: the emulator then advances its clock by 64 ns per instruction, and
//! SysTick, at 25 MHz, by 1.6 ticks. Every count is printed as one line `NAME COUNT`; an empty
//! piece is subtracted. Instructions are not cycles; compare only counts of one compiler version.
#![no_std]
#![no_main]
#![deny(clippy::undocumented_unsafe_blocks)]

use core::hint::black_box;

use cortex_m::peripheral::SYST;
use cortex_m::peripheral::syst::SystClkSource;
use cortex_m_rt::entry;
use cortex_m_semihosting::{debug, hprintln};

#[entry]
fn main() -> ! {
    let Some(peripherals) = cortex_m::Peripherals::take() else {
        fail()
    };
    let mut counter = Counter::start(peripherals.SYST);

    let mut sum = 0_u32;
    counter.print("loop-of-1000-additions", || {
        for i in 0..1000_u32 {
            sum = black_box(sum.wrapping_add(i));
        }
    });
    black_box(sum);

    loop {
        debug::exit(debug::EXIT_SUCCESS);
    }
}

/// Counts instructions by SysTick.
struct Counter {
    timer: SYST,
    empty_ticks: u32,
}

impl Counter {
    /// SysTick counts down 24 bits: 10.4 million instructions at most.
    const MAX_TICKS: u32 = 0x00ff_ffff;

    fn start(mut timer: SYST) -> Self {
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

    /// Prints how many instructions `piece` took.
    fn print(&mut self, name: &str, piece: impl FnOnce()) {
        let ticks = self.ticks(piece).saturating_sub(self.empty_ticks);
        // 1.6 ticks per instruction.
        hprintln!("{} {}", name, (u64::from(ticks) * 5 + 4) / 8);
    }
}

fn fail() -> ! {
    loop {
        debug::exit(debug::EXIT_FAILURE);
    }
}

#[panic_handler]
fn panic(info: &core::panic::PanicInfo) -> ! {
    hprintln!("{}", info);
    fail()
}
