//! Byte stream to and from a device.

use std::io::{self, Read, Write};
use std::time::Duration;

use super::DeviceError;

/// Port name of the simulated device.
pub const SIMULATED: &str = "simulated";

/// Bit rate of the serial line, bit/s, as configured on the board; a pseudo-terminal ignores it.
const BAUD_RATE: u32 = 921_600;

/// Byte stream to and from one device.
pub trait Port: Send {
    /// Name of the port for messages.
    fn name(&self) -> &str;

    /// Sends all bytes; an error if the line accepts none for `timeout`.
    fn send(&mut self, bytes: &[u8], timeout: Duration) -> Result<(), DeviceError>;

    /// Reads available bytes, waiting at most `timeout` for the first one; returns their number, 0 if none arrived.
    fn receive(&mut self, into: &mut [u8], timeout: Duration) -> Result<usize, DeviceError>;
}

/// Number of attempts to open a port that is in use: a choice. A starting child process holds a copy of the lock of its
/// parent for a short time.
const TRIES: usize = 6;
/// Pause between two attempts to open a port that is in use: a choice.
const BETWEEN_TRIES: Duration = Duration::from_millis(50);

/// Serial port of this computer.
pub struct SerialLine {
    name: String,
    line: Box<dyn serialport::SerialPort>,
}

impl SerialLine {
    /// Opens the port `name`, such as `/dev/ttyACM0`.
    ///
    /// # Errors
    /// The port does not exist, is in use, or is not accessible.
    pub fn open(name: &str) -> Result<Self, DeviceError> {
        let mut tries_left = TRIES;
        loop {
            tries_left -= 1;
            match serialport::new(name, BAUD_RATE).open() {
                Ok(line) => {
                    return Ok(Self {
                        name: name.into(),
                        line,
                    });
                }
                Err(error) if error.kind() == serialport::ErrorKind::NoDevice && tries_left > 0 => {
                    std::thread::sleep(BETWEEN_TRIES);
                }
                Err(error) => return Err(DeviceError::open(name, &error)),
            }
        }
    }
}

impl Port for SerialLine {
    fn name(&self) -> &str {
        &self.name
    }

    fn send(&mut self, bytes: &[u8], timeout: Duration) -> Result<(), DeviceError> {
        self.line
            .set_timeout(timeout)
            .map_err(|error| DeviceError::line(&self.name, error.into()))?;
        self.line
            .write_all(bytes)
            .map_err(|error| DeviceError::line(&self.name, error))
    }

    fn receive(&mut self, into: &mut [u8], timeout: Duration) -> Result<usize, DeviceError> {
        self.line
            .set_timeout(timeout)
            .map_err(|error| DeviceError::line(&self.name, error.into()))?;
        match self.line.read(into) {
            // A readable port without bytes has been unplugged.
            Ok(0) => Err(DeviceError::Unplugged {
                port: self.name.clone(),
            }),
            Ok(count) => Ok(count),
            Err(error) if matches!(error.kind(), io::ErrorKind::TimedOut | io::ErrorKind::Interrupted) => {
                Ok(0)
            }
            Err(error) => Err(DeviceError::line(&self.name, error)),
        }
    }
}
