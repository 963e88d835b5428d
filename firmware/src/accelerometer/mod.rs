//! Accelerometers with a sample queue: the interface for the acquisition, and the drivers.

use heapless::Vec;
use quietcut_core::acceleration::{Counts, MAX_BLOCK_SAMPLES, Sensor};

pub mod iis3dwb;
#[cfg(test)]
pub(crate) mod iis3dwb_model;

/// An accelerometer that samples with its own clock into a queue, and has a watermark line.
///
/// The line rises when the level of the queue reaches [`watermark`](Self::watermark) samples from below.
pub trait Accelerometer {
    /// Error of the driver.
    type Error;

    /// The properties of the sensor that the signal chain uses.
    fn sensor(&self) -> Sensor;

    /// Level of the sensor's queue, in samples, at which the watermark line rises.
    fn watermark(&self) -> u16;

    /// Resets and configures the sensor and empties its queue. Returns once the samples have settled.
    fn start(&mut self) -> Result<(), Self::Error>;

    /// Moves the samples that the sensor's queue holds at the beginning of the read to `samples`, oldest first, until
    /// `samples` is full.
    ///
    /// `samples` is cleared first. After an error the state of the queue is unknown, and [`start`](Self::start) is
    /// required.
    fn read(&mut self, samples: &mut Vec<Counts, MAX_BLOCK_SAMPLES>) -> Result<Queue, Self::Error>;
}

/// The state of the sensor's sample queue at one read.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Queue {
    /// Level of the sensor's queue at the beginning of the read, in samples.
    pub level: u16,
    /// True if the sensor's queue has overflowed since the beginning of the preceding read, so that samples are lost.
    pub overrun: bool,
    /// Number of samples missing between the sample read last and the first of this read; `None` if the sensor does not
    /// number its samples, if no sample was read before since the start, and if this read gives no sample.
    pub gap: Option<Gap>,
}

/// A number of missing samples, known from the sensor's count only up to multiples of `modulus`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Gap {
    /// Missing samples modulo `modulus`.
    pub remainder: u8,
    /// Number of samples after which the sensor's count of its samples wraps.
    pub modulus: u8,
}
