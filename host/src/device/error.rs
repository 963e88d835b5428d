//! What can go wrong between host and device.

use std::io;
use std::time::Duration;

use quietcut_core::lobes::TableError;
use quietcut_core::monitor::SettingsError;
use quietcut_core::protocol::{FrameError, Refusal};

use super::FlashFileError;
use crate::case::CaseError;

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
    /// The memory of the simulated device cannot be had.
    #[error(transparent)]
    FlashFile(#[from] FlashFileError),
    /// The simulated device cannot be set up like this.
    #[error("the simulated device cannot have {error}")]
    Settings {
        /// Why not.
        error: SettingsError,
    },
    /// The case of the virtual cell is wrong: a fault in quietcut itself.
    #[error(transparent)]
    Cell(#[from] CaseError),
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
    /// What came are not whole frames in their order, and asking again did not help.
    #[error(
        "{port}: no usable answer to {request}, asked {attempts} times: {error}; check the cable and that nothing else uses the port"
    )]
    Frames {
        /// The port.
        port: String,
        /// What was asked.
        request: &'static str,
        /// How often it was asked.
        attempts: u32,
        /// What was wrong the last time.
        error: FrameError,
    },
    /// The device speaks another version of the protocol.
    #[error(
        "{port}: the device speaks protocol version {theirs}, this command version {ours}; bring both to the same release"
    )]
    Version {
        /// The port.
        port: String,
        /// Version of this side.
        ours: u8,
        /// Version of the device.
        theirs: u8,
    },
    /// The device understood and does not do it.
    #[error("{port}: the device refuses the {request}: {refusal}")]
    Refused {
        /// The port.
        port: String,
        /// What was asked.
        request: &'static str,
        /// Why not.
        refusal: Refusal,
    },
    /// The device answers something else than it was asked.
    #[error("{port}: the device answers `{reply}` to {request}: it does not keep to the protocol")]
    Unexpected {
        /// The port.
        port: String,
        /// What was asked.
        request: &'static str,
        /// The kind of the reply.
        reply: &'static str,
    },
    /// The table is none.
    #[error("{error}")]
    Table {
        /// Why.
        error: TableError,
    },
    /// A request that fits no frame.
    #[error("the {request} does not fit a frame: a fault in quietcut itself")]
    TooLarge {
        /// The request.
        request: &'static str,
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
