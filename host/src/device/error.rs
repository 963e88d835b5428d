//! Errors between host and device: port, line, protocol, lobe table, state file of the simulated device.

use std::io;
use std::time::Duration;

use quietcut_core::lobes::TableError;
use quietcut_core::monitor::SettingsError;
use quietcut_core::protocol::{FrameError, Refusal};

use super::FlashFileError;
use crate::case::CaseError;

/// Failure of a connection or of a request to a device.
#[derive(Debug, thiserror::Error)]
pub enum DeviceError {
    /// The serial port does not exist.
    #[error("{port}: there is no such serial port; {present}, or use `simulated`")]
    NoPort {
        /// Requested port.
        port: String,
        /// Existing ports, as a phrase.
        present: String,
    },
    /// The port exists but cannot be opened.
    #[error("{port}: cannot open it as a serial port: {cause}")]
    Open {
        /// Name of the port.
        port: String,
        /// Error of the operating system.
        cause: String,
    },
    /// The port disappeared while it was in use.
    #[error("{port}: the device is gone: unplugged, or switched off; plug it in and run the command again")]
    Unplugged {
        /// Name of the port.
        port: String,
    },
    /// Sending or receiving on the open line failed, or took too long.
    #[error("{port}: cannot send to the device: {cause}")]
    Line {
        /// Name of the port.
        port: String,
        /// Error of the operating system.
        cause: io::Error,
    },
    /// The pseudo-terminal of the simulated device cannot be created.
    #[error("cannot make a pseudo-terminal for the simulated device: {cause}")]
    PseudoTerminal {
        /// Error of the operating system.
        cause: serialport::Error,
    },
    /// The state file of the simulated device cannot be used.
    #[error(transparent)]
    FlashFile(#[from] FlashFileError),
    /// The settings of the simulated device are invalid.
    #[error("the simulated device cannot have {error}")]
    Settings {
        /// Reason.
        error: SettingsError,
    },
    /// The case of the virtual cell is invalid, which is a defect of quietcut.
    #[error(transparent)]
    Cell(#[from] CaseError),
    /// No reply arrived in time.
    #[error("{port}: no answer to {request} within {:.1} s, asked {attempts} times; is it a quietcut device?", waited.as_secs_f64())]
    NoAnswer {
        /// Name of the port.
        port: String,
        /// Name of the request.
        request: &'static str,
        /// Total waiting time.
        waited: Duration,
        /// Number of times that the host sent the request.
        attempts: u32,
    },
    /// No usable reply arrived after all attempts, and at least one frame from or to the device was damaged, unknown to
    /// the receiver or out of order.
    #[error(
        "{port}: no usable answer to {request}, asked {attempts} times: {error}; check the cable and that nothing else uses the port"
    )]
    Frames {
        /// Name of the port.
        port: String,
        /// Name of the request.
        request: &'static str,
        /// Number of times that the host sent the request.
        attempts: u32,
        /// Fault of the last faulty frame.
        error: FrameError,
    },
    /// The device uses another version of the protocol.
    #[error(
        "{port}: the device uses protocol version {theirs}, this command version {ours}; bring both to the same release"
    )]
    Version {
        /// Name of the port.
        port: String,
        /// Protocol version of the host.
        ours: u8,
        /// Protocol version of the device.
        theirs: u8,
    },
    /// The device refuses the request.
    #[error("{port}: the device refuses the {request}: {refusal}")]
    Refused {
        /// Name of the port.
        port: String,
        /// Name of the request.
        request: &'static str,
        /// Reason of the refusal.
        refusal: Refusal,
    },
    /// The reply of the device is not of the kind that belongs to the request.
    #[error("{port}: the device answers `{reply}` to {request}: it does not keep to the protocol")]
    Unexpected {
        /// Name of the port.
        port: String,
        /// Name of the request.
        request: &'static str,
        /// Name of the reply.
        reply: &'static str,
    },
    /// The lobe table is invalid.
    #[error("{error}")]
    Table {
        /// Reason.
        error: TableError,
    },
    /// The request of the host is larger than a frame of the protocol.
    #[error("the {request} does not fit a frame: a fault in quietcut itself")]
    TooLarge {
        /// Name of the request.
        request: &'static str,
    },
}

impl DeviceError {
    /// Converts a failure to open a port into a device error.
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

    /// Converts a failure of a serial line in use into a device error.
    pub(super) fn line(port: &str, error: io::Error) -> Self {
        match error.kind() {
            // Errors of an unplugged USB serial port and of a closed pseudo-terminal.
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
