//! The device: the line to it, the client that talks over the line, and a simulated device that needs no hardware.

mod error;
pub mod port;
pub mod pseudo_terminal;

pub use error::DeviceError;
