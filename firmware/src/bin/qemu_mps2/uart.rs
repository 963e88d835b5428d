//! The board's serial ports.
//!
//! Each port holds one byte per direction. The emulator stops the sender while a byte is not read, so that no byte is
//! lost. The ports are polled; their interrupts only wake the board.

use core::convert::Infallible;

use embedded_io::{ErrorType, Read, ReadReady, Write, WriteReady};

/// A serial port of type CMSDK. Its registers are data, state, control, interrupt flags and divider, one word each.
#[derive(Clone, Copy)]
pub(crate) struct Uart {
    base: usize,
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

    /// Enables the port, for sending only or, with `receive`, for both directions.
    pub(crate) fn open(self, receive: bool) {
        // 16 is the smallest divider of the baud rate; the emulator ignores the baud rate.
        self.write(Self::DIVIDER, 16);
        self.write(Self::CONTROL, Self::TX_ON);
        if receive {
            self.write(Self::CONTROL, Self::TX_ON | Self::RX_ON | Self::RX_INTERRUPT_ON);
            // Reading the data register makes QEMU check its input again. Without it the first byte arrives a second
            // later.
            self.read(Self::DATA);
        }
    }

    pub(crate) fn send(self, bytes: &[u8]) {
        for &byte in bytes {
            while !self.can_send() {}
            self.write(Self::DATA, u32::from(byte));
        }
    }

    pub(crate) fn receive(self) -> Option<u8> {
        self.has_received().then(|| self.read(Self::DATA) as u8)
    }

    pub(crate) fn has_received(self) -> bool {
        self.read(Self::STATE) & Self::RX_FULL != 0
    }

    fn can_send(self) -> bool {
        self.read(Self::STATE) & Self::TX_FULL == 0
    }

    /// Clears the flag of the receive interrupt of the serial port.
    pub(crate) fn clear_interrupt(self) {
        self.write(Self::INTERRUPT, Self::RX_INTERRUPT);
    }

    fn read(self, register: usize) -> u32 {
        // SAFETY: `base` is one of the three ports above and `register` one of their registers.
        unsafe { ((self.base + 4 * register) as *const u32).read_volatile() }
    }

    fn write(self, register: usize, value: u32) {
        // SAFETY: `base` is one of the three ports above and `register` one of their registers. No register of a port
        // makes it write to memory.
        unsafe { ((self.base + 4 * register) as *mut u32).write_volatile(value) }
    }
}

impl ErrorType for Uart {
    type Error = Infallible;
}

impl ReadReady for Uart {
    fn read_ready(&mut self) -> Result<bool, Infallible> {
        Ok(self.has_received())
    }
}

impl Read for Uart {
    /// Reads the bytes that have arrived at the port; returns 0 if there are none.
    fn read(&mut self, buffer: &mut [u8]) -> Result<usize, Infallible> {
        let bytes = core::iter::from_fn(|| self.receive());
        Ok(buffer
            .iter_mut()
            .zip(bytes)
            .map(|(place, byte)| *place = byte)
            .count())
    }
}

impl WriteReady for Uart {
    fn write_ready(&mut self) -> Result<bool, Infallible> {
        Ok(self.can_send())
    }
}

impl Write for Uart {
    fn write(&mut self, bytes: &[u8]) -> Result<usize, Infallible> {
        self.send(bytes);
        Ok(bytes.len())
    }

    fn flush(&mut self) -> Result<(), Infallible> {
        Ok(())
    }
}
