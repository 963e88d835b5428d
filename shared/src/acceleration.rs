//! Raw acceleration: blocks of counts with sequence number, time stamp, clips and gaps.

use heapless::Vec;
use serde::{Deserialize, Serialize};

use crate::units::{Hertz, Nanoseconds};

/// The most samples in one block.
pub const MAX_BLOCK_SAMPLES: usize = 64;

/// Raw counts of the three axes x, y, z of the sensor at one instant.
pub type Counts = [i16; 3];

/// A block of consecutive samples as they come from the sensor.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Block {
    /// Counts up by one per block; a jump means lost blocks.
    pub sequence: u32,
    /// When the first sample of the block was taken, on the device's clock.
    pub time: Nanoseconds,
    /// Samples that the sensor or the link lost between the block before and this one.
    pub lost: u32,
    /// Samples of this block in which at least one axis stood at the end of its range.
    pub clipped: u16,
    /// The samples, oldest first.
    pub counts: Vec<Counts, MAX_BLOCK_SAMPLES>,
}

/// What is known of the accelerometer.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Sensor {
    /// The rate the sensor is meant to have; the true one is fitted from the time stamps.
    pub nominal_rate: Hertz,
    /// Acceleration of one count, in m/s².
    pub meters_per_second2_per_count: f32,
    /// White noise of one axis, in m/s² per √Hz: below it nothing is a signal.
    pub noise_meters_per_second2_per_root_hertz: f32,
}

impl Sensor {
    /// The IIS3DWB at ±16 g: 26 667 Hz, 0.488 mg per count, 75 µg/√Hz.
    pub const IIS3DWB_16G: Self = Self {
        nominal_rate: Hertz(26_667.0),
        meters_per_second2_per_count: 0.488e-3 * 9.806_65,
        noise_meters_per_second2_per_root_hertz: 75e-6 * 9.806_65,
    };
}

/// True where one axis stands at an end of the 16-bit range.
pub fn is_clipped(counts: Counts) -> bool {
    counts.iter().any(|&c| c == i16::MAX || c == i16::MIN)
}
