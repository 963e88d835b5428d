//! The emulated board: QEMU's `mps2-an386`, a Cortex-M4F.
//!
//! | port | what |
//! |---|---|
//! | UART0 | the link to the host |
//! | UART1 | log frames of defmt |
//! | UART2 | simulated sensor and tachometer, see [`quietcut_firmware::stimulus`] |
//! | PSRAM, in a file of the host | flash for the lobe tables, then stored stimuli |
//!
//! The processor's clock is not the host's: samples and edges carry their own time stamps.
#![no_std]
#![no_main]
#![deny(clippy::undocumented_unsafe_blocks)]

mod clock;
mod flash;
mod logger;
mod stack;
mod uart;

use cortex_m::peripheral::NVIC;
use cortex_m_rt::{entry, exception};
use heapless::Vec;
use quietcut_firmware::stimulus::{MAX_FRAME_BYTES, MEMORY_BYTES, REFUSED, STORE_OFFSET, Stimulus, TAKEN};

use crate::flash::{Flash, PSRAM_BASE};
use crate::uart::{LINK, LOG, Received, SPINDLE};

/// To wake from sleep takes the emulator longer than to pass a byte: stay awake within a message.
const IDLE_TURNS_BEFORE_SLEEP: u32 = 2000;

static LINK_BYTES: Received<{ LINK.base }> = Received::new();
static SPINDLE_BYTES: Received<{ SPINDLE.base }> = Received::new();

#[entry]
fn main() -> ! {
    // SAFETY: no interrupt is on, and this is the first function.
    unsafe { stack::paint() };
    clock::start();
    LOG.open(false);
    LINK.open(true);
    SPINDLE.open(true);
    // SAFETY: the handlers of these interrupts share data with this function through mutexes only.
    unsafe {
        NVIC::unmask(Irq::Link);
        NVIC::unmask(Irq::Spindle);
        NVIC::unmask(Irq::Clock);
    }
    // SAFETY: the only call.
    let _flash = unsafe { Flash::take() };
    defmt::info!("quietcut on mps2-an386");

    let mut frame: Vec<u8, MAX_FRAME_BYTES> = Vec::new();
    let mut blocks = 0_u32;
    let mut idle_turns = 0_u32;
    loop {
        let mut idle = true;
        while let Some(byte) = LINK_BYTES.take() {
            idle = false;
            LINK.send(&[byte]);
        }
        while let Some(byte) = SPINDLE_BYTES.take() {
            idle = false;
            let overlong = frame.push(byte).is_err();
            if byte == 0 || overlong {
                let answer = match postcard::from_bytes_cobs::<Stimulus>(&mut frame) {
                    Ok(Stimulus::Stored { bytes }) => take_stored(bytes as usize, &mut blocks),
                    Ok(stimulus) => take_stimulus(&stimulus, &mut blocks),
                    Err(_) => REFUSED,
                };
                SPINDLE.send(&[answer]);
                frame.clear();
            }
        }
        idle_turns = if idle { idle_turns.saturating_add(1) } else { 0 };
        if idle_turns > IDLE_TURNS_BEFORE_SLEEP {
            sleep();
        }
    }
}

fn take_stimulus(stimulus: &Stimulus, blocks: &mut u32) -> u8 {
    match stimulus {
        Stimulus::Block(_) => *blocks += 1,
        Stimulus::AskStack => defmt::info!("stack: {=usize} bytes at most", stack::most_bytes()),
        Stimulus::Edge(_) | Stimulus::Stored { .. } => {}
    }
    TAKEN
}

fn take_stored(bytes: usize, blocks: &mut u32) -> u8 {
    if bytes > MEMORY_BYTES - STORE_OFFSET {
        return REFUSED;
    }
    // SAFETY: the range lies within the PSRAM, no section is linked there, and the host does not
    // write to it between its message and our answer.
    let mut rest = unsafe { core::slice::from_raw_parts((PSRAM_BASE + STORE_OFFSET) as *const u8, bytes) };
    while !rest.is_empty() {
        match postcard::take_from_bytes::<Stimulus>(rest) {
            Ok((Stimulus::Stored { .. }, _)) | Err(_) => return REFUSED,
            Ok((stimulus, after)) => {
                take_stimulus(&stimulus, blocks);
                rest = after;
            }
        }
    }
    TAKEN
}

/// Waits for an interrupt unless bytes came in meanwhile.
///
/// With interrupts off an interrupt that comes between the look and the wait is not lost: the wait
/// ends at once and the interrupt is served when they are on again.
fn sleep() {
    cortex_m::interrupt::disable();
    if LINK_BYTES.is_empty() && SPINDLE_BYTES.is_empty() {
        cortex_m::asm::wfi();
    }
    // SAFETY: ends the section begun above; no other critical section is open here.
    unsafe { cortex_m::interrupt::enable() };
}

/// The interrupts of this board that are used, by their number.
#[derive(Clone, Copy)]
enum Irq {
    Link = 0,
    Spindle = 4,
    Clock = 8,
}

// SAFETY: the numbers are those of the board's interrupt controller, each once.
unsafe impl cortex_m::interrupt::InterruptNumber for Irq {
    fn number(self) -> u16 {
        self as u16
    }
}

/// Takes every interrupt: without a device crate all of them have this one handler.
// SAFETY: the handler touches shared data through mutexes and atomics only, so that it may interrupt anything.
#[exception]
unsafe fn DefaultHandler(number: i16) {
    const LINK: i16 = Irq::Link as i16;
    const SPINDLE: i16 = Irq::Spindle as i16;
    const CLOCK: i16 = Irq::Clock as i16;
    match number {
        LINK => LINK_BYTES.fill(),
        SPINDLE => SPINDLE_BYTES.fill(),
        CLOCK => clock::wrap(),
        other => defmt::panic!("interrupt {=i16} has no handler", other),
    }
}

/// Says why, and ends the emulator with a status other than 0.
#[panic_handler]
fn panic(info: &core::panic::PanicInfo) -> ! {
    defmt::error!("{}", defmt::Display2Format(info));
    loop {
        cortex_m_semihosting::debug::exit(cortex_m_semihosting::debug::EXIT_FAILURE);
    }
}
