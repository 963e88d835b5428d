//! The emulated board: QEMU's `mps2-an386`, a Cortex-M4F.
//!
//! | port | what |
//! |---|---|
//! | UART0 | the link to the host |
//! | UART1 | log frames of defmt |
//! | UART2 | simulated sensor and tachometer, see [`quietcut_firmware::stimulus`] |
//! | PSRAM, in a file of the host | flash for the lobe tables, then stored stimuli |
//!
//! The emulated clock does not run in real time, so samples and edges carry their own time stamps.
#![no_std]
#![no_main]
#![deny(clippy::undocumented_unsafe_blocks)]

mod clock;
mod cost;
mod flash;
mod logger;
mod spindle;
mod uart;

use cortex_m::peripheral::NVIC;
use cortex_m_rt::{entry, exception};
use quietcut_core::acceleration::Sensor;
use quietcut_core::monitor::State;
use quietcut_firmware::defaults;
use quietcut_firmware::device::{Device, Identity};
use static_cell::ConstStaticCell;

use crate::clock::BoardClock;
use crate::cost::Cost;
use crate::flash::Flash;
use crate::spindle::Spindle;
use crate::uart::{LINK, LOG, SPINDLE};

const IDENTITY: Identity = Identity {
    board: "qemu-mps2",
    sensor: None,
};

/// Number of polls of the ports without an event before the board sleeps. The emulator takes longer to wake the board
/// than to pass a byte, so the board stays awake within a message.
const IDLE_POLLS_BEFORE_SLEEP: u32 = 2000;

/// Memory for the state of the signal chain, which the device resets. A value with all bits zero takes no space in the
/// program image.
static STATE: ConstStaticCell<State> = ConstStaticCell::new(NO_BITS);

// SAFETY: the compiler refuses a constant whose bits are not a valid value of its type.
const NO_BITS: State = unsafe { core::mem::zeroed() };

#[entry]
fn main() -> ! {
    // SAFETY: no interrupt is enabled, and no other function of the program has run.
    let cost = unsafe { Cost::watch() };
    clock::start();
    LOG.open(false);
    LINK.open(true);
    SPINDLE.open(true);
    // SAFETY: the handler of this interrupt and this function share an atomic only.
    unsafe { NVIC::unmask(Irq::Clock) };
    // SAFETY: `take` may be called once, and this is its only call.
    let flash = unsafe { Flash::take() };

    let settings = defaults::settings(Sensor::IIS3DWB_16G);
    let Ok(mut device) = Device::new(IDENTITY, settings, STATE.take(), flash, BoardClock) else {
        defmt::panic!("the settings of this board cannot be")
    };
    let mut line = LINK;
    let mut spindle = Spindle::new(cost);
    defmt::info!("quietcut on mps2-an386");

    let mut idle_turns = 0_u32;
    loop {
        let Ok(mut is_busy) = spindle.cost.of_request(|| device.poll(&mut line));
        while let Some(byte) = SPINDLE.receive() {
            is_busy = true;
            if let Some(answer) = spindle.take(byte, &mut device, &mut line) {
                SPINDLE.send(&[answer]);
            }
        }
        idle_turns = if is_busy { 0 } else { idle_turns.saturating_add(1) };
        if idle_turns > IDLE_POLLS_BEFORE_SLEEP && device.outgoing().is_empty() {
            sleep();
        }
    }
}

/// Sleeps until a byte arrives at a serial port, unless one is waiting.
///
/// The ports' interrupts are enabled in this function only, while interrupts are masked globally. A pending interrupt
/// is not served, but ends the sleep, also if it occurs between the check and the sleep.
fn sleep() {
    cortex_m::interrupt::disable();
    for (port, irq) in [(LINK, Irq::Link), (SPINDLE, Irq::Spindle)] {
        port.clear_interrupt();
        NVIC::unpend(irq);
        // SAFETY: interrupts are masked globally, so that the handler does not run.
        unsafe { NVIC::unmask(irq) };
    }
    if !LINK.has_received() && !SPINDLE.has_received() {
        cortex_m::asm::wfi();
    }
    for irq in [Irq::Link, Irq::Spindle] {
        NVIC::mask(irq);
    }
    // SAFETY: this ends the global mask set above; no other critical section is open here.
    unsafe { cortex_m::interrupt::enable() };
}

/// Numbers of those interrupts of the emulated board that the program uses.
#[derive(Clone, Copy)]
enum Irq {
    Link = 0,
    Spindle = 4,
    Clock = 8,
}

// SAFETY: the numbers are those of the board's interrupt controller, each used once.
unsafe impl cortex_m::interrupt::InterruptNumber for Irq {
    fn number(self) -> u16 {
        self as u16
    }
}

/// Handler of all interrupts of the emulated board, for which there is no crate with a named handler for each.
// SAFETY: the handler touches shared data through an atomic only, so that it may interrupt anything.
#[exception]
unsafe fn DefaultHandler(number: i16) {
    const CLOCK: i16 = Irq::Clock as i16;
    match number {
        CLOCK => clock::wrap(),
        other => defmt::panic!("interrupt {=i16} has no handler", other),
    }
}

/// Logs the panic and ends the emulator with a non-zero status.
#[panic_handler]
fn panic(info: &core::panic::PanicInfo) -> ! {
    defmt::error!("{}", defmt::Display2Format(info));
    loop {
        cortex_m_semihosting::debug::exit(cortex_m_semihosting::debug::EXIT_FAILURE);
    }
}
