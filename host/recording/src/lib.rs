//! Recordings: channels with name, unit and rate, and what the file beside them says.
//!
//! Forces act on the structure. A rising edge of `tacho` is immersion angle 0 of tooth 1. Samples are in SI units.

mod assemble;
mod blocks;
mod csv;
mod error;
pub mod file;
mod formats;
mod mat;
mod raw;
mod recording;
mod segment;
mod sidecar;
mod spindle_angle;
pub mod uff;
mod unit;
mod wav;

pub use blocks::{Sensed, Speed};
pub use error::RecordingError;
pub use formats::WRITTEN;
pub use recording::{Channel, Recording};
pub use segment::Segment;
pub use sidecar::{Kind, RecordedChannel, RecordedCut, RecordedPosture, Sidecar};
pub use spindle_angle::SpindleAngle;
pub use uff::UffForm;
pub use unit::{Quantity, Sensitivity, Unit, UnknownUnit};

#[cfg(test)]
mod tests;
