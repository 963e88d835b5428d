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
    /// lock. Modulo the number of teeth it is the index of the tooth. After 49 days at 1000 tooth periods per second it
    /// starts again from 0, at a whole revolution.
    pub tooth: u32,
    /// Acceleration along x, y and z at this angle, in m/s².
    pub meters_per_second2: [f32; 3],
}

/// Largest number of points of the stroboscopic map ([`Strobe`]) from one block.
pub const MAX_BLOCK_STROBES: usize = 32;

/// Appends a point to the stroboscopic map: the acceleration at the first of the fixed spindle angles of a tooth
/// period.
pub(super) fn show(strobes: &mut Vec<Strobe, MAX_BLOCK_STROBES>, band: Band, passed: &Passed, teeth: u8) {
    let [x, y, z, ..] = passed.passing;
    let strobe = Strobe {
        band,
        tooth: shown_number(passed.tooth, teeth),
        meters_per_second2: [x, y, z],
    };
    // The push cannot fail: the map of one block has fewer points than its capacity.
    let _ = strobes.push(strobe);
}

/// The number of a tooth period in 32 bits: the remainder by the largest multiple of the number of teeth.
fn shown_number(tooth: u64, teeth: u8) -> u32 {
    let teeth = u64::from(teeth.max(1));
    let end = (1_u64 << 32) / teeth * teeth;
    (tooth % end) as u32
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_number_of_a_tooth_period_wraps_at_a_revolution() {
        for teeth in 1..=12 {
            for tooth in (u64::from(u32::MAX) - 30)..(u64::from(u32::MAX) + 30) {
                let shown = shown_number(tooth, teeth);
                assert_eq!(u64::from(shown) % u64::from(teeth), tooth % u64::from(teeth));
            }
        }
    }
}
