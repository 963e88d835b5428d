//! A channel, or without a name every channel of motion, is late by τ: y(t) = y_t(t − τ), with the true value y_t.

use std::sync::Arc;

use super::sensor_gain::acts_on;
use super::{Class, Effect, EffectName, EffectSpec, Locations, Parameter, Pickup, Treatment};

/// The specification.
pub(super) const SENSOR_DELAY: EffectSpec = EffectSpec {
    id: EffectName::SensorDelay,
    name: "sensor-delay",
    class: Class::Sensor,
    locations: Locations::Channels,
    parameters: &[Parameter::number("delay_s", "s", "delay").main()],
    treatment: Treatment::Sensor,
    candidates: &["one channel, or all channels of motion"],
    shares_term_with: &[],
    summary: "a channel is late",
    equation: "y(t) = y_t(t − τ)",
    shows: "a phase in proportion to frequency over a band, with a measured force or another channel as reference",
    hidden_by: "narrow bands, where it is damping; it changes no amplitude",
    source: "McConnell and Varoto, Vibration Testing (2008)",
    example: "delay_s = 1e-4\nchannel = \"x\"",
    describing_function: None,
    build: |values| {
        Ok(Arc::new(SensorDelay {
            delay_s: values.main("delay_s")?,
            channel: values.channel()?,
        }))
    },
};

#[derive(Clone, Debug)]
struct SensorDelay {
    delay_s: f64,
    channel: Option<String>,
}

impl Effect for SensorDelay {
    fn id(&self) -> EffectName {
        EffectName::SensorDelay
    }

    fn alter_channel(&self, channel: &mut Pickup) {
        if acts_on(self.channel.as_deref(), channel) {
            channel.delay_s += self.delay_s;
        }
    }
}
