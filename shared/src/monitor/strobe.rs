//! The points of the stroboscopic map that are shown.

use heapless::Vec;
use serde::{Deserialize, Serialize};

use super::Band;
use crate::synchronous::Passed;

/// A point of the stroboscopic map: what the sensor felt when a tooth stood at a fixed angle.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Strobe {
    /// The band it was taken from.
    pub band: Band,
    /// Tooth passings since the tachometer locked. Its remainder by the number of teeth names the tooth.
    pub tooth: u32,
    /// Acceleration in the three axes, in m/s².
    pub meters_per_second2: [f32; 3],
}

/// The most [`Strobe`]s that one block makes.
pub const MAX_BLOCK_STROBES: usize = 32;

/// Adds a point of the stroboscopic map: what was felt at the first slot.
pub(super) fn show(strobes: &mut Vec<Strobe, MAX_BLOCK_STROBES>, band: Band, passed: &Passed) {
    let [x, y, z, ..] = passed.passing;
    let strobe = Strobe {
        band,
        tooth: passed.tooth as u32,
        meters_per_second2: [x, y, z],
    };
    // More than the capacity cannot come in one block; if they did, the last would be left out.
    let _ = strobes.push(strobe);
}
