//! Force and motion of a recording along one direction.

use super::Error;
use crate::recording::{Quantity, Recording};
use crate::structure::Direction;

/// Recorded force and motion along one direction.
pub(super) struct ForceAndMotion<'a> {
    pub(super) direction: Direction,
    pub(super) force: Vec<f64>,
    pub(super) motion: &'a [f64],
    pub(super) quantity: Quantity,
}

/// Force and motion of the first direction that has both; a displacement in any direction comes before a velocity, and
/// this before an acceleration. Without any recorded force, the first motion with zero force (free decay).
pub(super) fn force_and_motion(recording: &Recording) -> Result<ForceAndMotion<'_>, Error> {
    // A displacement channel has priority: integrating velocity or acceleration to displacement loses the low
    // frequencies.
    let order = [Quantity::Displacement, Quantity::Velocity, Quantity::Acceleration];
    for quantity in order {
        for direction in Direction::ALL {
            let prefix = match quantity {
                Quantity::Velocity => "v",
                Quantity::Acceleration => "a",
                _ => "",
            };
            let Some(motion) = recording.channel(&format!("{prefix}{direction}")) else {
                continue;
            };
            let force = recording.channel(&format!("f{direction}"));
            let driven = force.is_some();
            let any_force = recording.channels.iter().any(|c| c.quantity == Quantity::Force);
            if driven || !any_force {
                let force = force.map_or_else(|| vec![0.0; motion.samples.len()], |c| c.samples.clone());
                return Ok(ForceAndMotion {
                    direction,
                    force,
                    motion: &motion.samples,
                    quantity,
                });
            }
        }
    }
    Err(Error::input(recording.lacks(
        "a displacement, velocity or acceleration along a force, such as x beside fx",
    )))
}
