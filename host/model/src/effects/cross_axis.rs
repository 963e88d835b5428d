//! A channel also reads a fraction p of the measured quantity in another direction (cross-axis sensitivity).

use std::sync::Arc;

use super::sensor_gain::acts_on;
use super::{Class, Effect, EffectName, EffectSpec, Locations, Parameter, Pickup, Treatment};
use crate::structure::Direction;

/// The specification.
pub(super) const CROSS_AXIS: EffectSpec = EffectSpec {
    id: EffectName::CrossAxis,
    name: "cross-axis",
    class: Class::Sensor,
    locations: Locations::ChannelsFromDirection,
    parameters: &[
        Parameter::number("fraction", "", "fraction of the other direction in the reading")
            .linear()
            .main(),
    ],
    treatment: Treatment::Sensor,
    candidates: &["one channel, from another direction"],
    shares_term_with: &[],
    summary: "a channel reads a fraction of another direction too",
    equation: "y = y_t + p·(the other direction)",
    shows: "the motion of the other direction, in phase, also where only that direction is driven",
    hidden_by: "another direction at rest; a cross receptance is reciprocal and not the same",
    source: "McConnell and Varoto, Vibration Testing (2008)",
    example: "fraction = 0.04\ndirection = \"y\"\nchannel = \"x\"",
    describing_function: None,
    build: |values| {
        Ok(Arc::new(CrossAxis {
            fraction: values.main("fraction")?,
            direction: values
                .direction()?
                .ok_or_else(|| values.missing("direction, the other one"))?,
            channel: values.channel()?,
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
    fn id(&self) -> EffectName {
        EffectName::CrossAxis
    }

    fn alter_channel(&self, channel: &mut Pickup) {
        if let Some(axis) = self.direction.axis()
            && acts_on(self.channel.as_deref(), channel)
            // If the effect names no channel, channels that already read `self.direction` are not changed.
            && (self.channel.is_some() || channel.weights[axis] == 0.0)
        {
            channel.weights[axis] += self.fraction;
        }
    }
}
