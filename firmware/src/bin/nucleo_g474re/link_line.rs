//! The serial port of the link: LPUART1 with DMA, and a queue of bytes in each direction between its tasks and the
//! device.

use core::convert::Infallible;

use embassy_stm32::mode::Async;
use embassy_stm32::usart::{RingBufferedUartRx, UartTx};
use embassy_sync::blocking_mutex::raw::CriticalSectionRawMutex;
use embassy_sync::pipe::Pipe;
use embedded_io::{ErrorType, Read, ReadReady, Write, WriteReady};

use crate::work::WORK;

/// Queue of bytes from host to device: 22 ms of bytes at 921 600 baud, the time of a page erase.
static RECEIVED: Pipe<CriticalSectionRawMutex, 2048> = Pipe::new();
/// Queue of bytes from device to host.
static SENT: Pipe<CriticalSectionRawMutex, 2048> = Pipe::new();

/// Task that passes the bytes received from the host to the device.
#[embassy_executor::task]
pub(crate) async fn receive(mut port: RingBufferedUartRx<'static>) {
    let mut bytes = [0; 128];
    loop {
        match port.read(&mut bytes).await {
            Ok(count) => {
                RECEIVED.write_all(bytes.get(..count).unwrap_or_default()).await;
                WORK.signal(());
            }
            // Lost bytes need no other handling: a frame with missing bytes is refused.
            Err(error) => defmt::warn!("link: {}", error),
        }
    }
}

/// Task that sends the bytes of the device to the host.
#[embassy_executor::task]
pub(crate) async fn send(mut port: UartTx<'static, Async>) {
    let mut bytes = [0; 256];
    loop {
        let count = SENT.read(&mut bytes).await;
        WORK.signal(());
        if let Err(error) = port.write(bytes.get(..count).unwrap_or_default()).await {
            defmt::warn!("link: {}", error);
        }
    }
}

/// The link's byte stream, from which the device reads and to which it writes.
pub(crate) struct LinkLine;

impl ErrorType for LinkLine {
    type Error = Infallible;
}

impl ReadReady for LinkLine {
    fn read_ready(&mut self) -> Result<bool, Infallible> {
        Ok(!RECEIVED.is_empty())
    }
}

impl Read for LinkLine {
    /// Reads bytes of the host that have arrived; returns 0 if there are none.
    fn read(&mut self, bytes: &mut [u8]) -> Result<usize, Infallible> {
        Ok(RECEIVED.try_read(bytes).unwrap_or(0))
    }
}

impl WriteReady for LinkLine {
    fn write_ready(&mut self) -> Result<bool, Infallible> {
        Ok(!SENT.is_full())
    }
}

impl Write for LinkLine {
    /// Moves bytes to the queue to the host without waiting; returns 0 if the queue is full.
    fn write(&mut self, bytes: &[u8]) -> Result<usize, Infallible> {
        Ok(SENT.try_write(bytes).unwrap_or(0))
    }

    fn flush(&mut self) -> Result<(), Infallible> {
        Ok(())
    }
}
