//! Access to a device: serial line, client of the protocol, and a simulated device without hardware.

mod client;
mod error;
mod feed;
mod flash_file;
pub mod port;
pub mod pseudo_terminal;
mod simulated;
mod upload;
mod virtual_cell;
mod virtual_spindle;

#[cfg(test)]
mod tests;

pub use client::{Client, Event};
pub use error::DeviceError;
pub use flash_file::FlashFileError;
pub use simulated::{Pace, Setup, SimulatedDevice, SimulatedPort};
pub use upload::Uploaded;
pub use virtual_cell::VirtualCell;

use std::path::Path;

use port::{Port, SIMULATED, SerialLine};

/// Opens the port `name`: a serial port, or `simulated` for a simulated device whose virtual spindle repeats cuts. The
/// file `state`, if given, keeps the memory of the simulated device.
///
/// # Errors
/// The port does not exist or cannot be opened, or the simulated device cannot be started, for example because the file
/// `state` cannot be used.
pub fn open(name: &str, state: Option<&Path>) -> Result<Box<dyn Port>, DeviceError> {
    if name != SIMULATED {
        return Ok(Box::new(SerialLine::open(name)?));
    }
    let cell = VirtualCell::new()?;
    let setup = Setup {
        state,
        teeth: cell.teeth()?,
        pace: Pace::RealTime,
    };
    let device = SimulatedDevice::start(setup, cell.endless_cuts())?;
    Ok(Box::new(SimulatedPort::open(device)?))
}
