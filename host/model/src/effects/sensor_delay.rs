//! A channel, or with no channel named every channel of motion, is late by τ.

use std::sync::Arc;

use super::sensor_gain::meant;
use super::{Effect, Kind, Pickup};

pub(super) const KIND: Kind = Kind {
    name: "sensor-delay",
    keys: "delay_s and channel",
    build: |parameters| {
        Ok(Arc::new(SensorDelay {
            delay_s: parameters.main("delay_s")?,
            channel: parameters.text("channel")?,
        }))
    },
};

#[derive(Clone, Debug)]
struct SensorDelay {
    delay_s: f64,
    channel: Option<String>,
}

impl Effect for SensorDelay {
    fn name(&self) -> &'static str {
        KIND.name
    }

    fn alter_channel(&self, channel: &mut Pickup) {
        if meant(self.channel.as_deref(), channel) {
            channel.delay_s += self.delay_s;
        }
    }
}
