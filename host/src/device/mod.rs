//! The device: the line to it, the client that talks over the line, and a simulated device that needs no hardware.

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

/// Opens a port by its name: a serial port, or the simulated device, whose memory is kept in the file `state` where one
/// is given and whose virtual spindle cuts without end.
///
/// # Errors
/// Where there is no such port, or it may not be used.
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
    let device = SimulatedDevice::start(setup, cell.cuts_for_ever())?;
    Ok(Box::new(SimulatedPort::open(device)?))
}
