//! Numbers with 90 % intervals in the answers of `quietcut identify`.

use serde::Serialize;

use quietcut_numerics::statistics::NINETY_PERCENT;

/// Estimated value of one parameter with its 90 % interval.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub(super) struct Figure {
    pub(super) value: f64,
    pub(super) ci90: [f64; 2],
}

impl Figure {
    pub(super) fn new(value: f64, deviation: f64) -> Self {
        let half = NINETY_PERCENT * deviation;
        Self {
            value,
            ci90: [value - half, value + half],
        }
    }
}
