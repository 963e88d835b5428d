//! What can go wrong between host and device.

use std::io;
use std::time::Duration;

/// A device that could not be reached, or did not do what it was asked to.
#[derive(Debug, thiserror::Error)]
pub enum DeviceError {
    /// There is no such port.
    #[error("{port}: there is no such serial port; {present}, or use `simulated`")]
    NoPort {
        /// The port that was asked for.
        port: String,
        /// The ports that are there, as a phrase.
        present: String,
    },
    /// The port is there and cannot be used.
    #[error("{port}: cannot open it as a serial port: {cause}")]
    Open {
        /// The port.
        port: String,
        /// What the system says.
        cause: String,
    },
    /// The line went away while it was in use.
    #[error("{port}: the device is gone: unplugged, or switched off; plug it in and run the command again")]
    Unplugged {
        /// The port.
        port: String,
    },
    /// The device does not take bytes.
    #[error("{port}: the line does not take bytes: {cause}")]
    Line {
        /// The port.
        port: String,
        /// What the system says.
        cause: io::Error,
    },
    /// The pseudo-terminal of the simulated device could not be made.
    #[error("cannot make a pseudo-terminal for the simulated device: {cause}")]
    PseudoTerminal {
        /// What the system says.
        cause: serialport::Error,
    },
    /// Nothing came in time.
    #[error("{port}: no answer to {request} within {:.1} s, asked {attempts} times; is it a quietcut device?", waited.as_secs_f64())]
    NoAnswer {
        /// The port.
        port: String,
        /// What was asked.
        request: &'static str,
        /// How long was waited in all.
        waited: Duration,
        /// How often it was asked.
        attempts: u32,
    },
}

impl DeviceError {
    /// The error for a port that could not be opened.
    pub(super) fn open(port: &str, error: &serialport::Error) -> Self {
        if error.kind() == serialport::ErrorKind::Io(io::ErrorKind::NotFound) {
            let present = match serialport::available_ports() {
                Ok(ports) if !ports.is_empty() => {
                    let names: Vec<_> = ports.into_iter().map(|port| port.port_name).collect();
                    format!("there are {}", names.join(", "))
                }
                _ => "there is none on this computer".into(),
            };
            return Self::NoPort {
                port: port.into(),
                present,
            };
        }
        Self::Open {
            port: port.into(),
            cause: error.to_string(),
        }
    }

    /// The error for a line that failed while it was in use.
    pub(super) fn line(port: &str, error: io::Error) -> Self {
        match error.kind() {
            // What a USB serial port that was pulled out, and a pseudo-terminal whose other end is closed, say.
            io::ErrorKind::BrokenPipe | io::ErrorKind::NotConnected | io::ErrorKind::Other => {
                Self::Unplugged { port: port.into() }
            }
            _ => Self::Line {
                port: port.into(),
                cause: error,
            },
        }
    }
}
