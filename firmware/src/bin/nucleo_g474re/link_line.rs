//! The link's port: LPUART1 by DMA, with a queue of bytes each way between its tasks and the device.

use core::convert::Infallible;

use embassy_stm32::mode::Async;
use embassy_stm32::usart::{RingBufferedUartRx, UartTx};
use embassy_sync::blocking_mutex::raw::CriticalSectionRawMutex;
use embassy_sync::pipe::Pipe;
use embedded_io::{ErrorType, Read, ReadReady, Write, WriteReady};

use crate::WORK;

/// Bytes to the device: 22 ms of the line, while a page of flash is erased.
static RECEIVED: Pipe<CriticalSectionRawMutex, 2048> = Pipe::new();
/// Bytes to the host.
static SENT: Pipe<CriticalSectionRawMutex, 2048> = Pipe::new();

/// Passes on what the host sends.
#[embassy_executor::task]
pub(crate) async fn receive(mut port: RingBufferedUartRx<'static>) {
    let mut bytes = [0; 128];
    loop {
        match port.read(&mut bytes).await {
            Ok(count) => {
                RECEIVED.write_all(bytes.get(..count).unwrap_or_default()).await;
                WORK.signal(());
            }
            // The frame in which bytes are missing is found out by its checksum.
            Err(error) => defmt::warn!("link: {}", error),
        }
    }
}

/// Sends what the device has for the host.
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

/// The link as the device sees it.
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
    /// Takes what is there: 0 bytes where nothing is.
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
    /// Takes as many bytes as there is room for.
    fn write(&mut self, bytes: &[u8]) -> Result<usize, Infallible> {
        Ok(SENT.try_write(bytes).unwrap_or(0))
    }

    fn flush(&mut self) -> Result<(), Infallible> {
        Ok(())
    }
}
