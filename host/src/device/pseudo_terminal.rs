//! Pseudo-terminal: a serial port without hardware. The host opens one end by its path; the simulated device uses the
//! other end.

use std::io::{self, Read, Write};
use std::time::Duration;

use serialport::{SerialPort, TTYPort};

use super::DeviceError;

/// Device end of a pseudo-terminal.
pub struct PseudoTerminal {
    path: String,
    device_end: TTYPort,
    /// Host end of the pseudo-terminal. It is kept open without a lock, so that a host can open, close and reopen the
    /// port.
    _host_end: TTYPort,
}

impl PseudoTerminal {
    /// Creates a pseudo-terminal.
    ///
    /// # Errors
    /// The operating system has no free pseudo-terminal or no free handles.
    pub fn new() -> Result<Self, DeviceError> {
        let failed = |cause| DeviceError::PseudoTerminal { cause };
        let (device_end, host_end) = TTYPort::pair().map_err(failed)?;
        // The cloned handles of the pseudo-terminal close in child processes; inherited originals would keep the line
        // open there.
        let device_end = device_end.try_clone_native().map_err(failed)?;
        let host_end = host_end.try_clone_native().map_err(failed)?;
        let path = host_end.name().unwrap_or_default();
        Ok(Self {
            path,
            device_end,
            _host_end: host_end,
        })
    }

    /// Creates a second handle of the pseudo-terminal, so that one thread can receive while another sends.
    ///
    /// # Errors
    /// The operating system has no free handles.
    pub fn try_clone(&self) -> Result<Self, DeviceError> {
        let failed = |cause| DeviceError::PseudoTerminal { cause };
        Ok(Self {
            path: self.path.clone(),
            device_end: self.device_end.try_clone_native().map_err(failed)?,
            _host_end: self._host_end.try_clone_native().map_err(failed)?,
        })
    }

    /// Path of the host end.
    pub fn path(&self) -> &str {
        &self.path
    }

    /// Reads bytes that the host has sent, waiting at most `timeout` for the first one; returns their number, 0 if none
    /// arrived.
    pub fn receive(&mut self, into: &mut [u8], timeout: Duration) -> io::Result<usize> {
        self.device_end.set_timeout(timeout)?;
        match self.device_end.read(into) {
            Err(error) if matches!(error.kind(), io::ErrorKind::TimedOut | io::ErrorKind::Interrupted) => {
                Ok(0)
            }
            other => other,
        }
    }

    /// Sends as many bytes as the line accepts, waiting at most `timeout` until it accepts any; returns their number, 0
    /// if it accepts none.
    pub fn send(&mut self, bytes: &[u8], timeout: Duration) -> io::Result<usize> {
        self.device_end.set_timeout(timeout)?;
        match self.device_end.write(bytes) {
            Err(error) if matches!(error.kind(), io::ErrorKind::TimedOut | io::ErrorKind::Interrupted) => {
                Ok(0)
            }
            other => other,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::device::port::{Port, SerialLine};

    const SOON: Duration = Duration::from_secs(2);

    #[test]
    fn bytes_of_all_values_pass_both_ways_and_again_after_a_reopen() {
        let mut terminal = PseudoTerminal::new().unwrap();
        let all: Vec<u8> = (0..=255).collect();
        for _ in 0..2 {
            let mut host = SerialLine::open(terminal.path()).unwrap();
            host.send(&all, SOON).unwrap();
            let mut there = Vec::new();
            let mut buffer = [0; 64];
            while there.len() < all.len() {
                let count = terminal.receive(&mut buffer, SOON).unwrap();
                assert!(count > 0);
                there.extend_from_slice(&buffer[..count]);
            }
            assert_eq!(there, all);
            assert_eq!(terminal.send(&all, SOON).unwrap(), all.len());
            let mut back = Vec::new();
            while back.len() < all.len() {
                let count = host.receive(&mut buffer, SOON).unwrap();
                assert!(count > 0);
                back.extend_from_slice(&buffer[..count]);
            }
            assert_eq!(back, all);
            assert_eq!(host.receive(&mut buffer, Duration::from_millis(1)).unwrap(), 0);
        }
    }

    #[test]
    fn a_line_whose_device_is_gone_says_so() {
        let terminal = PseudoTerminal::new().unwrap();
        let mut host = SerialLine::open(terminal.path()).unwrap();
        drop(terminal);
        let gone = host.receive(&mut [0; 8], SOON);
        assert!(matches!(gone, Err(DeviceError::Unplugged { .. })), "{gone:?}");
        let gone = host.send(&[0; 8], SOON);
        assert!(matches!(gone, Err(DeviceError::Unplugged { .. })), "{gone:?}");
    }

    #[test]
    fn a_port_that_is_not_there_is_named() {
        let error = SerialLine::open("/dev/no-such-port").err().unwrap();
        assert!(matches!(error, DeviceError::NoPort { .. }), "{error}");
        assert!(error.to_string().contains("/dev/no-such-port"), "{error}");
        let error = SerialLine::open("/dev/null").err().unwrap();
        assert!(matches!(error, DeviceError::Open { .. }), "{error}");
    }
}
