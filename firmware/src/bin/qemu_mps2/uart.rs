//! The board's serial ports, and the queues that their receive interrupts fill.

use core::cell::RefCell;

use cortex_m::interrupt::{self, Mutex};
use heapless::Deque;

/// A serial port of the CMSDK: data, state, control, interrupt flags and divider by word.
#[derive(Clone, Copy)]
pub(crate) struct Uart {
    pub(crate) base: usize,
}

/// UART0.
pub(crate) const LINK: Uart = Uart { base: 0x4000_4000 };
/// UART1.
pub(crate) const LOG: Uart = Uart { base: 0x4000_5000 };
/// UART2.
pub(crate) const SPINDLE: Uart = Uart { base: 0x4000_6000 };

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
    const RX_INTERRUPT: u32 = 2;

    /// Turns the port on, for sending only or for both directions.
    pub(crate) fn open(self, receive: bool) {
        // 16 is the smallest divider; the emulator sends at once whatever it says.
        self.write(Self::DIVIDER, 16);
        self.write(Self::CONTROL, Self::TX_ON);
        if receive {
            self.interrupt_on_receive(true);
            // Only a read tells QEMU to look at its end again: else the first byte waits for a second.
            self.read(Self::DATA);
        }
    }

    pub(crate) fn send(self, bytes: &[u8]) {
        for &byte in bytes {
            while self.read(Self::STATE) & Self::TX_FULL != 0 {}
            self.write(Self::DATA, u32::from(byte));
        }
    }

    fn receive(self) -> Option<u8> {
        (self.read(Self::STATE) & Self::RX_FULL != 0).then(|| self.read(Self::DATA) as u8)
    }

    fn interrupt_on_receive(self, on: bool) {
        let interrupt = if on { Self::RX_INTERRUPT_ON } else { 0 };
        self.write(Self::CONTROL, Self::TX_ON | Self::RX_ON | interrupt);
    }

    fn read(self, register: usize) -> u32 {
        // SAFETY: `base` is one of the three ports above and `register` one of their registers.
        unsafe { ((self.base + 4 * register) as *const u32).read_volatile() }
    }

    fn write(self, register: usize, value: u32) {
        // SAFETY: as in `read`; no register of a port makes it write to memory.
        unsafe { ((self.base + 4 * register) as *mut u32).write_volatile(value) }
    }
}

/// Bytes on their way from a receive interrupt to the main loop.
///
/// Where the queue is full the byte stays in the port and its interrupt is turned off: the emulator
/// then holds back the sender, and nothing is lost.
pub(crate) struct Received<const BASE: usize>(Mutex<RefCell<Deque<u8, 4096>>>);

impl<const BASE: usize> Received<BASE> {
    const PORT: Uart = Uart { base: BASE };

    pub(crate) const fn new() -> Self {
        Self(Mutex::new(RefCell::new(Deque::new())))
    }

    /// The oldest byte that has not been taken.
    pub(crate) fn take(&self) -> Option<u8> {
        let (byte, was_full) = interrupt::free(|token| {
            let mut queue = self.0.borrow(token).borrow_mut();
            let was_full = queue.is_full();
            (queue.pop_front(), was_full)
        });
        if was_full {
            self.fill();
            Self::PORT.interrupt_on_receive(true);
        }
        byte
    }

    pub(crate) fn is_empty(&self) -> bool {
        interrupt::free(|token| self.0.borrow(token).borrow().is_empty())
    }

    /// Serves the receive interrupt.
    pub(crate) fn fill(&self) {
        interrupt::free(|token| {
            // The flag goes first: a byte that comes after the last look raises it again.
            Self::PORT.write(Uart::INTERRUPT, Uart::RX_INTERRUPT);
            let mut queue = self.0.borrow(token).borrow_mut();
            while !queue.is_full() {
                let Some(byte) = Self::PORT.receive() else { return };
                // Cannot fail: the queue is not full.
                let _ = queue.push_back(byte);
            }
            Self::PORT.interrupt_on_receive(false);
        });
    }
}
