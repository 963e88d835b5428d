//! The bytes to and from a device.

use std::io::{self, Read, Write};
use std::time::Duration;

use super::DeviceError;

/// The name of the port that needs no hardware.
pub const SIMULATED: &str = "simulated";

/// Bits per second on a real serial line, as the board has it; a pseudo-terminal does not care.
const BAUD_RATE: u32 = 921_600;

/// The bytes to and from one device.
pub trait Port: Send {
    /// The name people know it by.
    fn name(&self) -> &str;

    /// Sends all bytes, within `timeout`.
    fn send(&mut self, bytes: &[u8], timeout: Duration) -> Result<(), DeviceError>;

    /// Takes what has come, waiting at most `timeout` for the first byte; 0 where nothing came.
    fn receive(&mut self, into: &mut [u8], timeout: Duration) -> Result<usize, DeviceError>;
}

/// How often a port that is in use is tried, and after how long again: a process that is being started holds a copy of the lock of
/// its parent until its own program runs.
const TRIES: usize = 6;
const BETWEEN_TRIES: Duration = Duration::from_millis(50);

/// A serial port of this computer.
pub struct SerialLine {
    name: String,
    line: Box<dyn serialport::SerialPort>,
}

impl SerialLine {
    /// Opens the port called `name`, such as `/dev/ttyACM0`.
    ///
    /// # Errors
    /// Where there is no such port, it is in use, or may not be used; the message says which.
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
            // A line that is ready and has nothing has been pulled out.
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
