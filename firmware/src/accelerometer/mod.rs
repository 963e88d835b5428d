//! Accelerometers with a sample queue: what the acquisition needs of one, and the drivers.

use heapless::Vec;
use quietcut_core::acceleration::{Counts, MAX_BLOCK_SAMPLES, Sensor};

pub mod iis3dwb;
#[cfg(test)]
pub(crate) mod iis3dwb_model;

/// An accelerometer that samples by its own clock into a queue and raises a line at a watermark.
///
/// The line rises when the queue comes to hold [`watermark`](Self::watermark) samples, from below.
pub trait Accelerometer {
    /// What can go wrong.
    type Error;

    /// What the signal chain must know of it.
    fn sensor(&self) -> Sensor;

    /// How many samples in the queue raise the line.
    fn watermark(&self) -> u16;

    /// Resets and configures the sensor and empties its queue; returns when settled samples come in.
    fn start(&mut self) -> Result<(), Self::Error>;

    /// Takes samples from the queue, oldest first, until it is empty or `samples` is full.
    ///
    /// `samples` is emptied first. After an error the queue is in an unknown state: start again.
    fn read(&mut self, samples: &mut Vec<Counts, MAX_BLOCK_SAMPLES>) -> Result<Queue, Self::Error>;
}

/// The state of the queue at one read.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Queue {
    /// Samples that were in the queue when the read began.
    pub level: u16,
    /// True where the queue was full since the read before and the oldest samples were overwritten.
    pub overrun: bool,
    /// Samples missing between the last of the read before and the first of this one, where the
    /// sensor counts its samples.
    pub gap: Option<Gap>,
}

/// A number of missing samples that is known only up to multiples of `modulus`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Gap {
    /// Missing samples modulo `modulus`.
    pub remainder: u8,
    /// After how many samples the sensor's count comes round.
    pub modulus: u8,
}
