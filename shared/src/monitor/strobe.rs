//! Points of the stroboscopic map for display.

use heapless::Vec;
use serde::{Deserialize, Serialize};

use super::Band;
use crate::synchronous::Passed;

/// A point of the stroboscopic map: the acceleration at the same angle of each tooth period.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Strobe {
    /// The band of the acceleration.
    pub band: Band,
    /// Number of the tooth period, counted from angle 0 of the tachometer, which lies 1024 revolutions before its
    /// lock. Modulo the number of teeth it is the index of the tooth.
    pub tooth: u32,
    /// Acceleration along x, y and z at this angle, in m/s².
    pub meters_per_second2: [f32; 3],
}

/// Largest number of points of the stroboscopic map ([`Strobe`]) from one block.
pub const MAX_BLOCK_STROBES: usize = 32;

/// Appends a point to the stroboscopic map: the acceleration at the first of the fixed spindle angles of a tooth
/// period.
pub(super) fn show(strobes: &mut Vec<Strobe, MAX_BLOCK_STROBES>, band: Band, passed: &Passed) {
    let [x, y, z, ..] = passed.passing;
    let strobe = Strobe {
        band,
        tooth: passed.tooth as u32,
        meters_per_second2: [x, y, z],
    };
    // The push cannot fail: the map of one block has fewer points than its capacity.
    let _ = strobes.push(strobe);
}
