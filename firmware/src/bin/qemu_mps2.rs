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

use core::cell::RefCell;
use core::sync::atomic::{AtomicU32, Ordering};

use cortex_m::interrupt::{self, Mutex};
use cortex_m::peripheral::NVIC;
use cortex_m_rt::{entry, exception};
use heapless::{Deque, Vec};
use quietcut_firmware::stimulus::{MAX_FRAME_BYTES, MEMORY_BYTES, REFUSED, STORE_OFFSET, Stimulus, TAKEN};

const LINK: Uart = Uart { base: 0x4000_4000 };
const LOG: Uart = Uart { base: 0x4000_5000 };
const SPINDLE: Uart = Uart { base: 0x4000_6000 };
const IDLE_TURNS_BEFORE_SLEEP: u32 = 2000;
const PSRAM_BASE: usize = 0x2100_0000;

#[entry]
fn main() -> ! {
    Clock::start();
    LOG.open(false);
    LINK.open(true);
    SPINDLE.open(true);
    // SAFETY: the handlers of these interrupts share data with this function through mutexes only.
    unsafe {
        NVIC::unmask(Irq::LINK);
        NVIC::unmask(Irq::SPINDLE);
        NVIC::unmask(Irq::CLOCK);
    }
    defmt::info!("quietcut on mps2-an386");

    let mut frame: Vec<u8, MAX_FRAME_BYTES> = Vec::new();
    let mut blocks = 0_u32;
    let mut idle_turns = 0_u32;
    loop {
        let mut idle = true;
        while let Some(byte) = LINK_BYTES.take(LINK) {
            idle = false;
            LINK.send(&[byte]);
        }
        while let Some(byte) = SPINDLE_BYTES.take(SPINDLE) {
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
        // To wake from sleep takes the emulator longer than to pass a byte: stay awake within a message.
        if idle_turns > IDLE_TURNS_BEFORE_SLEEP {
            sleep();
        }
    }
}

fn take_stimulus(stimulus: &Stimulus, blocks: &mut u32) -> u8 {
    if let Stimulus::Block(_) = stimulus {
        *blocks += 1;
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

/// A serial port of the CMSDK: data, state, control, interrupt flags and divider by word.
#[derive(Clone, Copy)]
struct Uart {
    base: usize,
}

impl Uart {
    const DATA: usize = 0;
    const STATE: usize = 1;
    const CONTROL: usize = 2;
    const INTERRUPT: usize = 3;
    const DIVIDER: usize = 4;

    const TX_FULL: u32 = 1;
    const RX_FULL: u32 = 2;
    const TX_ON: u32 = 1;
    const RX_ON: u32 = 2;
    const RX_INTERRUPT_ON: u32 = 8;

    fn read(self, register: usize) -> u32 {
        // SAFETY: `base` is one of the three ports above and `register` one of the constants.
        unsafe { ((self.base + 4 * register) as *const u32).read_volatile() }
    }

    fn write(self, register: usize, value: u32) {
        // SAFETY: as in `read`; no register of a port writes to memory.
        unsafe { ((self.base + 4 * register) as *mut u32).write_volatile(value) }
    }

    fn open(self, receive: bool) {
        // 16 is the smallest divider; the emulator sends at once whatever it says.
        self.write(Self::DIVIDER, 16);
        let receiver = if receive {
            Self::RX_ON | Self::RX_INTERRUPT_ON
        } else {
            0
        };
        self.write(Self::CONTROL, Self::TX_ON | receiver);
    }

    fn send(self, bytes: &[u8]) {
        for &byte in bytes {
            while self.read(Self::STATE) & Self::TX_FULL != 0 {}
            self.write(Self::DATA, u32::from(byte));
        }
    }

    fn receive(self) -> Option<u8> {
        (self.read(Self::STATE) & Self::RX_FULL != 0).then(|| self.read(Self::DATA) as u8)
    }

    fn interrupt_on_receive(self, on: bool) {
        let receiver = if on {
            Self::RX_ON | Self::RX_INTERRUPT_ON
        } else {
            Self::RX_ON
        };
        self.write(Self::CONTROL, Self::TX_ON | receiver);
    }
}

/// Bytes on their way from a receive interrupt to the main loop.
///
/// Where the queue is full the byte stays in the port and its interrupt is turned off: the emulator
/// then holds back the sender, and nothing is lost.
struct Received(Mutex<RefCell<Deque<u8, 4096>>>);

static LINK_BYTES: Received = Received(Mutex::new(RefCell::new(Deque::new())));
static SPINDLE_BYTES: Received = Received(Mutex::new(RefCell::new(Deque::new())));

impl Received {
    fn take(&self, port: Uart) -> Option<u8> {
        interrupt::free(|token| {
            let mut queue = self.0.borrow(token).borrow_mut();
            let full = queue.is_full();
            let byte = queue.pop_front();
            if full {
                drop(queue);
                self.fill(port);
                port.interrupt_on_receive(true);
            }
            byte
        })
    }

    fn is_empty(&self) -> bool {
        interrupt::free(|token| self.0.borrow(token).borrow().is_empty())
    }

    fn fill(&self, port: Uart) {
        // The flag goes first: a byte that comes after the last look raises it again.
        port.write(Uart::INTERRUPT, 2);
        interrupt::free(|token| {
            let mut queue = self.0.borrow(token).borrow_mut();
            while !queue.is_full() {
                let Some(byte) = port.receive() else { return };
                // Cannot fail: the queue is not full.
                let _ = queue.push_back(byte);
            }
            port.interrupt_on_receive(false);
        });
    }
}

/// The interrupts of this board that are used.
#[derive(Clone, Copy)]
struct Irq(u16);

impl Irq {
    const LINK: Self = Self(0);
    const SPINDLE: Self = Self(4);
    const CLOCK: Self = Self(8);
}

// SAFETY: the numbers are those of the board's interrupt controller.
unsafe impl cortex_m::interrupt::InterruptNumber for Irq {
    fn number(self) -> u16 {
        self.0
    }
}

/// Takes every interrupt: without a device crate all of them have this one handler.
// SAFETY: the handler touches shared data through mutexes and atomics only, so that it may interrupt anything.
#[exception]
unsafe fn DefaultHandler(number: i16) {
    match number {
        0 => LINK_BYTES.fill(LINK),
        4 => SPINDLE_BYTES.fill(SPINDLE),
        8 => Clock::wrap(),
        other => defmt::panic!("interrupt {=i16} has no handler", other),
    }
}

/// The board's timer 0, which counts 25 MHz down from 2³² − 1, and how often it came round.
struct Clock;

static CLOCK_WRAPS: AtomicU32 = AtomicU32::new(0);

impl Clock {
    const BASE: usize = 0x4000_0000;
    const CONTROL: usize = Self::BASE;
    const VALUE: usize = Self::BASE + 4;
    const RELOAD: usize = Self::BASE + 8;
    const INTERRUPT: usize = Self::BASE + 12;
    const TICKS_PER_MICROSECOND: u32 = 25;

    fn start() {
        // SAFETY: registers of timer 0, which nothing else uses.
        unsafe {
            (Self::RELOAD as *mut u32).write_volatile(u32::MAX);
            (Self::VALUE as *mut u32).write_volatile(u32::MAX);
            // Count, and interrupt on zero.
            (Self::CONTROL as *mut u32).write_volatile(0b1001);
        }
    }

    fn wrap() {
        // SAFETY: clears the interrupt flag of timer 0.
        unsafe { (Self::INTERRUPT as *mut u32).write_volatile(1) };
        CLOCK_WRAPS.store(
            CLOCK_WRAPS.load(Ordering::Relaxed).wrapping_add(1),
            Ordering::Relaxed,
        );
    }

    fn ticks() -> u32 {
        // SAFETY: reads the value of timer 0.
        u32::MAX - unsafe { (Self::VALUE as *const u32).read_volatile() }
    }

    fn microseconds() -> u64 {
        loop {
            let wraps = CLOCK_WRAPS.load(Ordering::Relaxed);
            let ticks = Self::ticks();
            if CLOCK_WRAPS.load(Ordering::Relaxed) == wraps {
                return ((u64::from(wraps) << 32) | u64::from(ticks))
                    / u64::from(Self::TICKS_PER_MICROSECOND);
            }
        }
    }
}

defmt::timestamp!("{=u64:us}", Clock::microseconds());

mod logger {
    //! defmt frames on the log port.

    use core::cell::UnsafeCell;
    use core::sync::atomic::{AtomicBool, Ordering};

    use super::LOG;

    #[defmt::global_logger]
    struct Logger;

    struct State {
        encoder: UnsafeCell<defmt::Encoder>,
        restore: UnsafeCell<critical_section::RestoreState>,
    }

    // SAFETY: both cells are touched between `acquire` and `release` only, with interrupts off on a
    // single core; `TAKEN` stops a second taker.
    unsafe impl Sync for State {}

    static TAKEN: AtomicBool = AtomicBool::new(false);
    static STATE: State = State {
        encoder: UnsafeCell::new(defmt::Encoder::new()),
        restore: UnsafeCell::new(critical_section::RestoreState::invalid()),
    };

    fn send(bytes: &[u8]) {
        LOG.send(bytes);
    }

    // SAFETY: `acquire` turns interrupts off and refuses a second taker; `release` undoes it.
    unsafe impl defmt::Logger for Logger {
        fn acquire() {
            // SAFETY: released by `release`, which defmt calls once after each `acquire`.
            let restore = unsafe { critical_section::acquire() };
            // A log statement inside a log statement: nothing can be told in the log about it.
            assert!(!TAKEN.swap(true, Ordering::Relaxed));
            // SAFETY: interrupts are off and nobody else holds the logger.
            unsafe {
                *STATE.restore.get() = restore;
                (*STATE.encoder.get()).start_frame(send);
            }
        }

        unsafe fn flush() {}

        unsafe fn release() {
            // SAFETY: the logger is held, see `acquire`.
            unsafe {
                (*STATE.encoder.get()).end_frame(send);
                TAKEN.store(false, Ordering::Relaxed);
                critical_section::release(*STATE.restore.get());
            }
        }

        unsafe fn write(bytes: &[u8]) {
            // SAFETY: the logger is held, see `acquire`.
            unsafe { (*STATE.encoder.get()).write(bytes, send) };
        }
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
