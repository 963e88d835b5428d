//! The spindle does not turn steadily: Ω = Ω₀(1 + δ·sin(2πf_m t + ψ)). The feed axis does.

use std::sync::Arc;

use super::{Effect, Kind};
use crate::{Fluctuation, Spindle};

pub(super) const KIND: Kind = Kind {
    name: "speed-fluctuation",
    keys: "delta, frequency_hz and phase_deg",
    build: |parameters| {
        let delta = match parameters.number("", below_one, BELOW_ONE)? {
            Some(delta) => delta,
            None => match parameters.number("delta", below_one, BELOW_ONE)? {
                Some(delta) => delta,
                None => parameters.needed("delta")?,
            },
        };
        let frequency_hz = match parameters.positive("frequency_hz")? {
            Some(frequency_hz) => frequency_hz,
            None => parameters.needed("frequency_hz")?,
        };
        Ok(Arc::new(SpeedFluctuation(Fluctuation {
            delta,
            frequency_hz,
            phase_rad: parameters.finite("phase_deg")?.unwrap_or(0.0).to_radians(),
        })))
    },
};

/// A spindle that stands or turns back is none.
fn below_one(delta: f64) -> bool {
    delta.abs() < 1.0
}

const BELOW_ONE: &str = "a number between -1 and 1";

#[derive(Clone, Copy, Debug)]
struct SpeedFluctuation(Fluctuation);

impl Effect for SpeedFluctuation {
    fn name(&self) -> &'static str {
        KIND.name
    }

    fn alter_spindle(&self, spindle: &mut Spindle) {
        *spindle = spindle.fluctuating(self.0);
    }
}
