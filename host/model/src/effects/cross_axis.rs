//! A channel of motion reads p of another direction too.

use std::sync::Arc;

use super::sensor_gain::meant;
use super::{Effect, EffectError, Kind, Pickup};
use crate::structure::Direction;

pub(super) const KIND: Kind = Kind {
    name: "cross-axis",
    keys: "fraction, direction (the other one) and channel",
    build: |parameters| {
        Ok(Arc::new(CrossAxis {
            fraction: parameters.main("fraction")?,
            direction: parameters.direction("direction")?.ok_or(EffectError::Missing {
                name: "cross-axis".into(),
                key: "direction, the other one",
            })?,
            channel: parameters.text("channel")?,
        }))
    },
};

#[derive(Clone, Debug)]
struct CrossAxis {
    fraction: f64,
    direction: Direction,
    channel: Option<String>,
}

impl Effect for CrossAxis {
    fn name(&self) -> &'static str {
        KIND.name
    }

    fn alter_channel(&self, channel: &mut Pickup) {
        if let Some(axis) = self.direction.axis()
            && meant(self.channel.as_deref(), channel)
            // What reads that direction anyhow reads nothing of another.
            && (self.channel.is_some() || channel.weights[axis] == 0.0)
        {
            channel.weights[axis] += self.fraction;
        }
    }
}
